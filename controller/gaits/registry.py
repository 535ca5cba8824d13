"""The gaits by name: every concrete ``Gait`` of this package, and those of other packages."""

import inspect
from collections.abc import Iterator
from importlib import import_module
from importlib.metadata import entry_points
from pkgutil import iter_modules
from typing import Any

from snakewalk.config.errors import InputError
from snakewalk.controller import gaits
from snakewalk.controller.gaits.gait import Gait
from snakewalk.controller.gaits.spine import SpineGait, heading_loop

_FIRST_MODULES = (
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
_WITHOUT_GAITS = ("registry", "backbone", "spine_heading")
"""Modules that define no gait; two of them are slow to import."""
ENTRY_POINTS = "snakewalk.gaits"
"""Group of the entry points of other packages, each of which names a gait."""
BROKEN: dict[str, str] = {}
"""Why a gait of another package cannot be used, by the name of its entry point."""


def gaits_by_name() -> dict[str, type[Gait]]:
    """Return the gaits by name; ``docs/how-to/add-a-gait.md`` describes how to add one."""
    by_name: dict[str, type[Gait]] = {}
    for gait in (*_gaits(), *_foreign_gaits()):
        by_name.setdefault(gait.name, gait)
    return by_name


def _foreign_gaits() -> Iterator[type[Gait]]:
    for entry in entry_points(group=ENTRY_POINTS):
        try:
            gait = entry.load()
            fault = "" if issubclass(gait, Gait) else "is not a Gait"
        except Exception as error:
            fault = f"cannot be imported ({type(error).__name__}: {error})"
        if not fault:
            yield gait
            continue
        package = entry.value if entry.dist is None else entry.dist.name
        BROKEN[entry.name] = f"gait {entry.name} of {package}: {fault}; repair or uninstall it"


def _gaits() -> Iterator[type[Gait]]:
    """Yield the gaits of each module in the order of their definition."""
    modules = {
        module_info.name for module_info in iter_modules(gaits.__path__) if not module_info.ispkg
    }
    for name in [*_FIRST_MODULES, *sorted(modules - {*_FIRST_MODULES, *_WITHOUT_GAITS})]:
        module = import_module(f"{gaits.__name__}.{name}")
        for value in vars(module).values():
            if (
                isinstance(value, type)
                and issubclass(value, Gait)
                and value.__module__ == module.__name__
                and not inspect.isabstract(value)
                and hasattr(value, "name")
            ):
                yield value


GAITS = gaits_by_name()

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
        raise InputError(BROKEN.get(name, f"{name}: no such gait; there are {', '.join(GAITS)}"))
    return GAITS[name].of(values, source)
