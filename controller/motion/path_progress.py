"""Progress of a motion along a path, in addition to its joint targets."""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.kinematics.links import BodyView
from snakewalk.controller.motion.source import MotionSource


@dataclass(frozen=True, slots=True)
class Decision:
    """Shape that a walk has chosen, and from how many."""

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
        """How often another path was laid: a waypoint was passed by, the body off it, or stuck."""
        ...

    @property
    def replanned(self) -> str | None:
        """Why another path was laid in the last step, if one was."""
        ...

    @property
    def along_m(self) -> float:
        """Arc length of the body on the path; NaN without a path."""
        ...

    @property
    def pulse_m_s(self) -> float:
        """How fast the shape travels along the body; 0 where this does not predict the speed."""
        ...

    @property
    def decision(self) -> Decision | None:
        """Decision of the last step, if there was one."""
        ...

    def path_m(self, count: int) -> Floats:
        """(count, 2) points along the path in force."""
        ...

    def begin(self, view: BodyView) -> Floats:
        """Fit the first shape to the ground under the body; returns the first targets (J,)."""
        ...


@runtime_checkable
class OpenWaypoints(Protocol):
    """Optional interface of a motion along a path whose waypoints are set during the run."""

    @property
    def waypoints_m(self) -> Floats:
        """(w, 2) in force, those reached first; another array when they change."""
        ...


class NoPath:
    """Progress of a motion that follows no path."""

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
        """(J,) where the source begins, whatever the ground."""
        return self._source.goal_rad()


def path_progress(source: MotionSource) -> PathProgress:
    """Return the source itself where it follows a path, and ``NoPath`` elsewhere."""
    return source if isinstance(source, PathProgress) else NoPath(source)
