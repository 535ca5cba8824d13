"""Map source of a run: the world's ground, or a plug-in that maps it."""

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.heightfield import HeightField
from snakewalk.controller.console.plugins import require
from snakewalk.controller.run.backend import Backend
from snakewalk.controller.run.prepared_run import PreparedRun
from snakewalk.controller.runtime.drive import OnEvent, PoseSource

if TYPE_CHECKING:
    from snakewalk.controller.terrain.growing_map import GrowingMap


@dataclass(frozen=True, slots=True)
class MapContext:
    """Parts of a run that a map source may use."""

    prepared: PreparedRun
    backend: Backend
    measure: PoseSource
    """Measures the pose."""
    folder: Path
    """Folder of the run."""
    on_event: OnEvent


class MapPlugin(Protocol):
    """A map source, as a plug-in provides it."""

    def faults(self, prepared: PreparedRun, *, on_port: bool) -> list[str]:
        """Return the faults of the source in a run, one per line."""
        ...

    def open(self, context: MapContext) -> AbstractContextManager["MapProvider"]:
        """Open the source for the time of a run."""
        ...


def _source(name: str) -> MapPlugin:
    source: MapPlugin = require("map", name, "mapping.source").load()()
    return source


def map_faults(prepared: PreparedRun, *, metal: bool) -> None:
    """Reject a run that cannot map its ground.

    Raises:
        InputError: one line per fault, or a missing extra.

    """
    mapping = prepared.run.mapping
    if mapping is None:
        return
    faults = _source(mapping.source).faults(prepared, on_port=metal)
    if faults:
        raise InputError(faults)


@dataclass
class MapProvider:
    """Map of a run's ground next to its pose, and its accuracy."""

    measure: PoseSource
    """Measures the pose, and captures due pictures."""
    ground_map: "GrowingMap | None" = None
    """Map that the walk makes of its ground; None if it knows the ground from the world."""
    true_ground: HeightField | None = None
    head_m: float = 0.0
    """Way of the head so far, in plan."""
    head_over_unknown_m: float = 0.0
    """Part of it over ground that was unmapped when the head arrived."""
    _last_place_m: Floats | None = None

    def follow(self, head_m: Floats) -> None:
        """Note where the head (3,) is now."""
        if self.ground_map is not None and self._last_place_m is not None:
            step_m = float(np.hypot(*(head_m - self._last_place_m)[:2]))
            self.head_m += step_m
            if not self.ground_map.is_known(float(head_m[0]), float(head_m[1])):
                self.head_over_unknown_m += step_m
        self._last_place_m = np.array(head_m)

    def facts(self) -> dict[str, float | int]:
        """Numbers for log and answer; none without a map."""
        ground_map = self.ground_map
        ground = self.true_ground
        if ground_map is None or ground is None or not ground_map.known.any():
            return {}
        error_m = np.abs(ground_map.errors_m(ground))
        return {
            "pictures": ground_map.pictures,
            "seen_m2": round(float(ground_map.known.sum()) * ground_map.spacing_m**2, 2),
            "height_error_rms_m": round(float(np.sqrt((error_m**2).mean())), 4),
            "height_error_median_m": round(float(np.median(error_m)), 4),
            "height_error_95_m": round(float(np.quantile(error_m, 0.95)), 4),
            "head_m": round(self.head_m, 2),
            "head_over_unknown_m": round(self.head_over_unknown_m, 2),
        }


@contextmanager
def map_provider(
    prepared: PreparedRun, backend: Backend, measure: PoseSource, folder: Path, on_event: OnEvent
) -> Iterator[MapProvider]:
    """Map the ground during the run if the run requests it."""
    mapping = prepared.run.mapping
    if mapping is None:
        yield MapProvider(measure)
        return
    with _source(mapping.source).open(
        MapContext(prepared, backend, measure, folder, on_event)
    ) as provider:
        yield provider
