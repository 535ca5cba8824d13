"""Simulators of a sweep, as plug-ins; each yields finished measurements."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Protocol

from snakewalk.config.errors import InputError
from snakewalk.config.extras import require_extra
from snakewalk.controller.console.command import plugin
from snakewalk.controller.console.plugins import require
from snakewalk.controller.console.pool import each
from snakewalk.controller.studies.sweep_measure import Measurement, measure
from snakewalk.controller.studies.sweep_points import Point

Result = tuple[Point, Measurement]


@dataclass(frozen=True, slots=True)
class SweepOptions:
    """Options of the command that concern the backend."""

    argument: str
    """Text behind ``NAME:`` in ``--backend``; empty without one."""
    workers: int
    dask: str | None


_Sweep = Callable[[Sequence[Point], str | None], Iterator[Result]]
"""Type of ``warp_sweep.measure_together``."""


class SweepBackend(Protocol):
    """Simulates points."""

    def __init__(self, options: SweepOptions) -> None:
        """Check the options, and whether the packages are installed.

        Raises:
            InputError: an option is wrong, or a package is missing.

        """
        ...

    def measure(self, points: Sequence[Point]) -> Iterator[Result]:
        """Yield each point with its measurement, in any order."""
        ...


def open_backend(text: str, workers: int, dask: str | None) -> SweepBackend:
    """Return the backend of ``--backend NAME[:ARGUMENT]``.

    Raises:
        InputError: it does not exist, or rejects the options.

    """
    name, _, argument = text.partition(":")
    kind: type[SweepBackend] = require("backend", name, "--backend").load()
    return kind(SweepOptions(argument, workers, dask))


@plugin("backend", "processes")
class ProcessBackend:
    """Compiled simulator with bus and servos, one point per process at a time."""

    def __init__(self, options: SweepOptions) -> None:
        if options.argument:
            raise InputError(f"--backend processes:{options.argument}: accepts no argument")
        require_extra("a sweep needs", "mujoco" if options.dask is None else "distributed")
        self._options = options

    def measure(self, points: Sequence[Point]) -> Iterator[Result]:
        """Yield each point as its process finishes it."""
        options = self._options
        return each(measure, points, workers=options.workers, dask=options.dask)


@plugin("backend", "warp")
class WarpBackend:
    """MuJoCo-Warp for many robots at once on a level floor; the argument is a Warp device."""

    def __init__(self, options: SweepOptions) -> None:
        if options.dask is not None:
            raise InputError("--backend warp: does not run on a Dask cluster; omit --dask")
        require_extra("--backend warp needs", "warp", "mujoco_warp")
        # its imports need the packages
        module = import_module("snakewalk.controller.studies.warp_sweep")
        self._sweep: _Sweep = module.measure_together
        self._device = options.argument or None

    def measure(self, points: Sequence[Point]) -> Iterator[Result]:
        """Yield the points of each batch, then those of the compiled simulator."""
        return self._sweep(points, self._device)
