"""Planning of a new path, spread over control cycles."""

from dataclasses import dataclass
from typing import Protocol

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.terrain.in_steps import Steps, Unfinished
from snakewalk.controller.terrain.path import SplinePath

UNITS_PER_CYCLE = 1000
"""Work on a path in a control cycle (ours): about a millisecond of a processor of 2020."""


class PathPlanner(Protocol):
    """Plans paths."""

    def __call__(
        self, points_m: Floats, heading_rad: float | None, *, avoid_m: Floats, number: int = 1
    ) -> Steps[SplinePath]:
        """Plan in steps through (n, 2) points in order, from a heading if one is given.

        The path avoids places ``avoid_m`` (k, 2) if possible. ``number`` is the second point's, for
        messages. Each step lasts about a millisecond at most.
        """
        ...


@dataclass(frozen=True, slots=True)
class PathRequest:
    """A requested path, from the body's position at that time."""

    why: str
    points_m: Floats
    """(n, 2) the head, and the waypoints that are left."""
    heading_rad: float
    avoid_m: Floats
    """(k, 2) places that the path avoids, m."""
    number: int
    """Number of the first waypoint that is left, from 1."""
    is_miss: bool
    """Whether the old path has failed."""


class Replanning:
    """Planning of a requested path."""

    def __init__(self, request: PathRequest, plan: PathPlanner) -> None:
        self.request = request
        self._unfinished = Unfinished(_steps(request, plan))

    def carry_on(self) -> bool:
        """Do one control cycle's work; return whether the planning is over."""
        return self._unfinished.carry_on(UNITS_PER_CYCLE)

    @property
    def path(self) -> SplinePath | None:
        """Result after the planning; None if every path is unsafe."""
        return self._unfinished.result


def _steps(request: PathRequest, plan: PathPlanner) -> Steps[SplinePath | None]:
    heading_rad, number = request.heading_rad, request.number
    try:
        return (
            yield from plan(request.points_m, heading_rad, avoid_m=request.avoid_m, number=number)
        )
    except InputError:
        return None
