"""The gaits by name: every concrete ``Gait`` in a module of this package."""

import inspect
from collections.abc import Iterator
from importlib import import_module
from pkgutil import iter_modules
from typing import Any, Final

from snakewalk.config.errors import InputError
from snakewalk.controller import gaits
from snakewalk.controller.gaits.gait import Gait
from snakewalk.controller.gaits.spine import SpineGait, heading_loop

_FIRST: Final = (
    "lateral_undulation",
    "sidewinding",
    "rolling",
    "turn_in_place",
    "rectilinear",
    "concertina",
    "compound_serpenoid",
    "helix",
    "spine",
    "trot",
    "erect",
)
"""Modules whose gaits come first in lists; the other modules follow by name."""
_WITHOUT_GAITS: Final = ("registry", "backbone", "spine_heading")
"""Modules that define no gait; two of them are slow to import."""


def gaits_by_name() -> dict[str, type[Gait]]:
    """Return the gaits by name; ``docs/how-to/add-a-gait.md`` describes how to add one."""
    return {gait.name: gait for gait in _gaits()}


def _gaits() -> Iterator[type[Gait]]:
    """Yield the gaits of each module in the order of their definition."""
    found = {each.name for each in iter_modules(gaits.__path__) if not each.ispkg}
    for name in [*_FIRST, *sorted(found - {*_FIRST, *_WITHOUT_GAITS})]:
        module = import_module(f"{gaits.__name__}.{name}")
        for each in vars(module).values():
            if (
                isinstance(each, type)
                and issubclass(each, Gait)
                and each.__module__ == module.__name__
                and not inspect.isabstract(each)
                and hasattr(each, "name")
            ):
                yield each


GAITS: Final = gaits_by_name()

SPINE_GAITS: tuple[str, ...] = tuple(
    name for name, gait in GAITS.items() if issubclass(gait, SpineGait)
)
"""Names of the gaits that move a spine without a robot."""


def make_gait(name: str, values: dict[str, Any] | None = None, source: str = "") -> Gait:
    """Make a gait by name with parameters in place of defaults.

    Raises:
        InputError: unknown gait or parameters, or values out of range; one line each.

    """
    heading_loop()  # compiled here, not during a run
    if name not in GAITS:
        raise InputError(f"{name}: no such gait; there are {', '.join(GAITS)}")
    return GAITS[name].of(values, source)
