"""Registry of plug-ins, found without importing their packages.

A package lists its plug-ins in a manifest: a module without imports whose ``PLUGINS`` is a tuple of
``(kind, name, help, "module:attribute", group)``. snakewalk's own manifests are
``snakewalk/controller/*/manifest.py``. Another distribution declares an entry point of the group
``snakewalk.plugins`` that names its manifest. The module of a plug-in is imported on use.
``docs/how-to/add-a-plug-in.md`` shows one of each kind.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cache
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Any

from snakewalk.config.errors import InputError
from snakewalk.controller.console.imports import without_collections

ENTRY_POINTS = "snakewalk.plugins"
"""Group of the entry points of other distributions."""
KINDS = (
    "command",
    "run",
    "motion",
    "joints",
    "pose",
    "map",
    "observer",
    "look",
    "planner",
    "results",
    "backend",
    "stage",
)
"""Kinds of plug-ins."""
OWN = "snakewalk"


class PluginError(InputError):
    """A plug-in cannot be imported."""


@dataclass(frozen=True, slots=True)
class Plugin:
    """One plug-in, as a manifest lists it."""

    kind: str
    """Kind of the plug-in, one of ``KINDS``."""
    name: str
    """Words of a command; the value of an option for the other kinds."""
    help: str
    """Description of the plug-in in one line."""
    target: str
    """Place of the code: ``module:attribute``."""
    group: str
    """Group of a command in ``--help``."""
    package: str
    """Distribution, or package of snakewalk, that provides it."""

    @property
    def is_builtin(self) -> bool:
        """Whether the plug-in is snakewalk's own."""
        return self.package.startswith(f"{OWN}.")

    def load(self) -> Any:
        """Import the plug-in.

        Raises:
            PluginError: its module does not import, or lacks the attribute.

        """
        module, _, attribute = self.target.partition(":")
        try:
            with without_collections():
                return getattr(import_module(module), attribute)
        except InputError:
            raise
        except Exception as error:
            if self.is_builtin:
                raise
            raise PluginError(
                f"{self.kind} {self.name} of {self.package}: cannot be imported "
                f"({type(error).__name__}: {error}); repair or uninstall {self.package}"
            ) from error


def plugins(kind: str | None = None) -> tuple[Plugin, ...]:
    """Return all plug-ins, or those of one kind, snakewalk's own first."""
    return tuple(
        plugin for plugin in (*builtin_plugins(), *foreign_plugins()) if kind in (None, plugin.kind)
    )


def find(kind: str, name: str) -> Plugin | None:
    """Return a plug-in; snakewalk's own have priority."""
    for offered in (builtin_plugins, foreign_plugins):
        for plugin in offered():
            if plugin.kind == kind and plugin.name == name:
                return plugin
    return None


def names(kind: str) -> list[str]:
    """Return the names of all plug-ins of a kind."""
    return list(dict.fromkeys(plugin.name for plugin in plugins(kind)))


def require(kind: str, name: str, option: str, others: Iterable[str] = ()) -> Plugin:
    """Return a plug-in that an option names.

    ``option`` is for the message; ``others`` are further valid values, which are not plug-ins.

    Raises:
        InputError: the plug-in does not exist; lists the valid values.

    """
    plugin = find(kind, name)
    if plugin is None:
        raise InputError(unknown(option, name, [*others, *names(kind)]))
    return plugin


def unknown(option: str, name: str, valid: Iterable[str]) -> str:
    """Message about an unknown value, with the probable one."""
    valid = list(dict.fromkeys(valid))
    near = get_close_matches(name, valid, 1, 0.7)
    meant = f"did you mean {near[0]}? " if near else ""
    return f"{option} {name}: unknown; {meant}valid: {', '.join(valid)}"


@cache
def builtin_plugins() -> tuple[Plugin, ...]:
    """Return the plug-ins of snakewalk's own packages."""
    manifests = sorted(Path(__file__).parents[1].glob("*/manifest.py"))
    return tuple(
        plugin
        for file in manifests
        for plugin in _read(
            import_module(f"snakewalk.controller.{file.parent.name}.manifest").PLUGINS,
            f"{OWN}.{file.parent.name}",
        )
    )


@cache
def foreign_plugins() -> tuple[Plugin, ...]:
    """Return the plug-ins of other distributions; a broken manifest becomes a problem."""
    return tuple(
        plugin for entry in entry_points(group=ENTRY_POINTS) for plugin in _plugins_of_entry(entry)
    )


def _plugins_of_entry(entry: EntryPoint) -> Iterator[Plugin]:
    package = entry.dist.name if entry.dist is not None else entry.value
    try:
        yield from _read(entry.load().PLUGINS, package)
    except Exception as error:
        _problems.append(
            f"plug-ins of {package}: ignored, its manifest cannot be read "
            f"({type(error).__name__}: {error})"
        )


_problems: list[str] = []


def take_problems() -> list[str]:
    """Return why manifests are ignored, once each, for a command to report."""
    taken, _problems[:] = list(_problems), []
    return taken


def _read(rows: Iterable[tuple[str, ...]], package: str) -> list[Plugin]:
    declared = []
    for kind, name, about, target, *group in rows:
        if kind not in KINDS:
            raise ValueError(f"unknown kind {kind!r}; valid: {', '.join(KINDS)}")
        declared.append(Plugin(kind, name, about, target, "".join(group), package))
    return declared
