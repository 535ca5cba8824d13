"""Progress of a motion along a path, in addition to its joint targets."""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.kinematics.links import BodyView
from snakewalk.controller.motion.source import MotionSource


@dataclass(frozen=True, slots=True)
class Decision:
    """Shape chosen by a walk, and the number of candidates."""

    state: int
    heading_error_rad: float
    """Mean heading of the placed shape minus the aim, before the ramp."""
    ramp_rad: float
    candidates: int
    """Shapes within the heading tolerance; 0 means that the nearest few were taken instead."""
    visited: int
    """Distinct states visited so far."""
    carrier_rad: float = 0.0
    """Amplitude of the wide wave on which the shape rides; 0 without one."""


@runtime_checkable
class PathProgress(Protocol):
    """Optional interface of a ``MotionSource``; callers get it from ``path_progress``."""

    @property
    def reached(self) -> int:
        """Number of waypoints reached."""
        ...

    @property
    def missed(self) -> int:
        """Number of new paths: a waypoint was passed by, or the body was off the path or stuck."""
        ...

    @property
    def replanned(self) -> str | None:
        """Reason for a new path in the last step, or None."""
        ...

    @property
    def along_m(self) -> float:
        """Arc length of the body on the path; NaN without a path."""
        ...

    @property
    def pulse_m_s(self) -> float:
        """Speed of the shape along the body; 0 where it does not predict the body's speed."""
        ...

    @property
    def decision(self) -> Decision | None:
        """Decision of the last step, or None."""
        ...

    def path_m(self, count: int) -> Floats:
        """(count, 2) points along the present path."""
        ...

    def begin(self, view: BodyView) -> Floats:
        """Fit the first shape to the ground under the body; return the first targets (J,)."""
        ...


@runtime_checkable
class OpenWaypoints(Protocol):
    """Optional interface of a path motion whose waypoints are set during the run."""

    @property
    def waypoints_m(self) -> Floats:
        """(w, 2) present waypoints, reached ones first; a new array after each change."""
        ...


class NoPath:
    """Progress of a motion without a path."""

    reached = missed = 0
    along_m = float("nan")
    pulse_m_s = 0.0
    decision: Decision | None = None
    replanned: str | None = None

    def __init__(self, source: MotionSource) -> None:
        self._source = source

    def path_m(self, count: int) -> Floats:
        """(count, 2) of NaN."""
        return np.full((count, 2), np.nan)

    def begin(self, view: BodyView) -> Floats:
        """(J,) initial targets of the source, for any ground."""
        return self._source.goal_rad()


def path_progress(source: MotionSource) -> PathProgress:
    """Return the source itself if it follows a path, else ``NoPath``."""
    return source if isinstance(source, PathProgress) else NoPath(source)
