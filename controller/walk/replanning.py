"""A path that is planned again, a little in each control cycle."""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.terrain.in_steps import Steps, Unfinished
from snakewalk.controller.terrain.path import SplinePath

UNITS_PER_CYCLE = 1000
"""Work on a path in a control cycle (ours): about a millisecond of a processor of 2020, as long as
a batch of the walk's rollouts."""


class PathPlanner(Protocol):
    """Plans paths."""

    def __call__(
        self, points_m: Floats, heading_rad: float | None, *, avoid_m: Floats, number: int = 1
    ) -> SplinePath:
        """Plan through (n, 2) points in order, from a heading where one is given.

        The path keeps off places ``avoid_m`` (k, 2) where another way exists. ``number`` is that of
        the second point, a waypoint, for messages about it.
        """
        ...


@runtime_checkable
class PlansInSteps(Protocol):
    """A ``PathPlanner`` may offer this."""

    def in_steps(
        self, points_m: Floats, heading_rad: float | None, *, avoid_m: Floats, number: int = 1
    ) -> Steps[SplinePath]:
        """Plan as a call does; each step is one of at most about a millisecond."""
        ...


@dataclass(frozen=True, slots=True)
class PathRequest:
    """A path that is wanted, from where the body was when it was."""

    why: str
    points_m: Floats
    """(n, 2) the head, and the waypoints that are left."""
    heading_rad: float
    avoid_m: Floats
    """(k, 2)"""
    number: int
    """Number of the first waypoint that is left, from 1."""
    is_miss: bool
    """Whether the old path has failed."""


class Replanning:
    """A requested path under way."""

    def __init__(self, request: PathRequest, plan: PathPlanner) -> None:
        self.request = request
        self._unfinished = Unfinished(_steps(request, plan))

    def carry_on(self) -> bool:
        """Do the work of a control cycle; return whether the planning is over."""
        return self._unfinished.carry_on(UNITS_PER_CYCLE)

    @property
    def path(self) -> SplinePath | None:
        """Result, when the planning is over; None if all ways are unsafe."""
        return self._unfinished.result


def _steps(request: PathRequest, plan: PathPlanner) -> Steps[SplinePath | None]:
    points_m, heading_rad = request.points_m, request.heading_rad
    avoid_m, number = request.avoid_m, request.number
    try:
        if isinstance(plan, PlansInSteps):
            return (yield from plan.in_steps(points_m, heading_rad, avoid_m=avoid_m, number=number))
        return plan(points_m, heading_rad, avoid_m=avoid_m, number=number)
    except InputError:
        return None
