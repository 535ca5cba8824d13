"""Gaits of other packages, by entry points."""

from collections.abc import Callable
from importlib.metadata import entry_points
from pathlib import Path

import numpy as np
import pytest
from pytest_mock import MockerFixture

from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot
from snakewalk.controller.gaits import registry
from snakewalk.controller.gaits.rolling import Rolling
from snakewalk.controller.run.kinds.gait_factory import gait_by_name


class Sway(Rolling):
    """A gait that another package defines."""

    name = "sway"


Install = Callable[[dict[str, str]], None]


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, mocker: MockerFixture) -> Install:
    """Install a package that declares entry points."""
    mocker.patch.dict(registry.GAITS)
    mocker.patch.dict(registry.BROKEN, clear=True)

    def write(entries: dict[str, str]) -> None:
        folder = tmp_path / "foreign-1.dist-info"
        folder.mkdir()
        (folder / "METADATA").write_text("Metadata-Version: 2.1\nName: foreign\nVersion: 1\n")
        lines = [f"{name} = {value}" for name, value in entries.items()]
        (folder / "entry_points.txt").write_text("\n".join(["[snakewalk.gaits]", *lines, ""]))
        monkeypatch.syspath_prepend(tmp_path)

    return write


@pytest.fixture
def installed(install: Install) -> dict[str, type[registry.Gait]]:
    """The gaits, with those of a package that declares three entry points."""
    install({"sway": f"{__name__}:Sway", "gone": "nosuch:Gait", "text": f"{__name__}:__name__"})
    registry.GAITS.update(registry.gaits_by_name())
    return registry.GAITS


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
def test_a_broken_one_is_one_line(name: str, fault: str) -> None:
    with pytest.raises(
        InputError, match=f"gait {name} of foreign: {fault}.*; repair or uninstall it"
    ):
        gait_by_name(name, None)


class Foreign(Rolling):
    """A gait of another package with the name of one of snakewalk."""

    name = "rolling"


def test_a_gait_of_snakewalk_has_priority(install: Install) -> None:
    install({"rolling": f"{__name__}:Foreign"})
    (entry,) = entry_points(group=registry.ENTRY_POINTS, name="rolling")
    assert entry.load() is Foreign
    assert registry.gaits_by_name()["rolling"] is Rolling
