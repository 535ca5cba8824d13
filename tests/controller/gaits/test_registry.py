"""Gaits of other packages, by entry points."""

from importlib.metadata import EntryPoint

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot
from snakewalk.controller.gaits import registry
from snakewalk.controller.gaits.rolling import Rolling
from snakewalk.controller.run.kinds.gait_factory import gait_by_name


class Sway(Rolling):
    """A gait that another package defines."""

    name = "sway"


def entry(name: str, value: str) -> EntryPoint:
    return EntryPoint(name, f"{__name__}:{value}" if ":" not in value else value, "snakewalk.gaits")


@pytest.fixture
def installed(monkeypatch: pytest.MonkeyPatch) -> dict[str, type[registry.Gait]]:
    """The gaits, with those of a package that declares three entry points."""
    entries = [entry("sway", "Sway"), entry("gone", "nosuch:Gait"), entry("text", "__name__")]
    monkeypatch.setattr(registry, "entry_points", lambda group: entries)
    monkeypatch.setattr(registry, "BROKEN", {})
    gaits = registry.gaits_by_name()
    monkeypatch.setattr(registry, "GAITS", gaits)
    return gaits


def test_a_gait_of_another_package_moves_the_robot(
    installed: dict[str, type[registry.Gait]],
) -> None:
    assert list(installed)[-1] == "sway"
    sway = registry.make_gait("sway")
    assert isinstance(sway, Sway)
    assert sway.joints_rad(load_robot("alternating16"), np.array([0.3])).shape == (1, 16)


@pytest.mark.usefixtures("installed")
@pytest.mark.parametrize(
    ("name", "fault"),
    [("gone", "cannot be imported .*No module named 'nosuch'"), ("text", "cannot be imported")],
)
def test_a_broken_one_is_one_line(name: str, fault: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("snakewalk.controller.run.kinds.gait_factory.BROKEN", registry.BROKEN)
    with pytest.raises(InputError, match=f"gait {name} of .*: {fault}.*; repair or uninstall it"):
        gait_by_name(name, None)


def test_a_gait_of_snakewalk_has_priority(monkeypatch: pytest.MonkeyPatch) -> None:
    foreign = type("Foreign", (Rolling,), {"name": "rolling", "__module__": __name__})
    monkeypatch.setitem(globals(), "Foreign", foreign)
    monkeypatch.setattr(registry, "entry_points", lambda group: [entry("rolling", "Foreign")])
    assert registry.gaits_by_name()["rolling"] is Rolling
