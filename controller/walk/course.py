"""The course: the path through the waypoints, and the body's progress on it.

A waypoint counts when the body's centre is near it. Another path is planned from the head if the
body passes by a waypoint, is 0.75 body lengths off the path, or stalls. That path avoids the places
of earlier stalls. The planning is spread over control cycles, in which the body follows the old
path. The waypoints may change during the motion.
"""

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.kinematics.rotations import wrap
from snakewalk.controller.terrain.in_steps import at_once
from snakewalk.controller.terrain.path import SplinePath
from snakewalk.controller.walk.replanning import PathPlanner, PathRequest, Replanning

_OFF_PATH_BODIES = 0.75
# Body lengths of travel before another path may be planned: a turn needs about as much.
_REPLAN_AFTER_BODIES = 2.0
# A body that gains less than this on its path over this travel is stalled.
_STALL_BODIES = 0.25
_STALL_AFTER_BODIES = 5.0
_KEPT_PATH_M = 0.3
"""Length of the path ahead of the head that a new plan keeps, because the body will be on it."""
_BEND_RAD = 0.8
"""Largest bend of a renewed path where it continues (ours)."""
_BEYOND_PATH_WEIGHT = 1.5
"""Weight of a straight metre that no path covers yet, metres of path (ours)."""


def aim_rad(path: SplinePath, from_m: Floats, along_m: float, carrot_m: float) -> float:
    """Direction from a point to the carrot ``carrot_m`` beyond ``along_m`` on the path.

    The path continues straight beyond its end: the last carrot does not turn the body around.
    """
    carrot_along_m = along_m + carrot_m
    carrot = path.position(min(carrot_along_m, path.length_m))
    if carrot_along_m > path.length_m:
        before = path.position(path.length_m - 0.05)
        step = carrot - before
        carrot = carrot + step / max(np.hypot(*step), 1e-9) * (carrot_along_m - path.length_m)
    return float(np.arctan2(carrot[1] - from_m[1], carrot[0] - from_m[0]))


@dataclass(frozen=True, slots=True)
class _Onward:
    path: SplinePath
    passed_m: list[float]
    """Arc lengths at the waypoints."""
    length_m: float
    """Length of the path, and of the weighted straight rest from its end to the last waypoint."""


class OnCourse:
    """Progress of a motion along a course: part of ``PathProgress``."""

    def __init__(self, course: "Course") -> None:
        self.course = course
        """Course that the motion follows."""

    @property
    def path(self) -> SplinePath:
        """The path in force."""
        return self.course.path

    @property
    def reached(self) -> int:
        """Number of waypoints reached."""
        return self.course.reached

    @property
    def missed(self) -> int:
        """Number of paths planned again after a missed waypoint."""
        return self.course.missed

    @property
    def replanned(self) -> str | None:
        """Reason for a new path in the last step, or None."""
        return self.course.replanned

    @property
    def along_m(self) -> float:
        """Arc length of the path point nearest to the body's centre."""
        return self.course.along_m

    def path_m(self, count: int) -> Floats:
        """(count, 2) points along the path in force."""
        return self.course.path_m(count)


class Course:
    """Waypoints in order, and the path to the remaining ones."""

    def __init__(
        self,
        plan: PathPlanner,
        waypoints_m: Sequence[tuple[float, float]],
        *,
        start_m: Floats,
        radius_m: float,
        length_m: float,
        travel_per_body: float,
        travel: float = 0.0,
        feedback: bool = True,
    ) -> None:
        """Plan the first path from the head ``start_m`` (2,) through the waypoints in order.

        A centre within ``radius_m`` counts. ``travel`` and ``travel_per_body`` (a body length) have
        the motion's own unit. ``feedback``: a failed path is replaced.

        Raises:
            InputError: as the planner.

        """
        self._plan = plan
        self.waypoints_m = np.asarray(waypoints_m, float)
        """(k, 2) in order."""
        self._goals_m: list[list[float]] = self.waypoints_m.tolist()  # plain numbers, for speed
        self._radius_m = radius_m
        self.length_m = length_m
        self._per_body = travel_per_body
        self.feedback = feedback
        self._followers_m, self._gap_m = np.empty((2, 2)), np.empty(2)
        self._along_m = np.zeros(2)
        """Place of the body's centre on the path, and of its head."""
        self._travel = travel
        self._replan_after = 0.0
        self._gained_m, self._gained_at = 0.0, travel
        self._stalls_m: list[Floats] = []
        self._missed_before = -1
        self._replanning: Replanning | None = None
        self.reached = 0
        """Number of waypoints reached."""
        self.missed = 0
        """Number of times that another path was laid to a waypoint."""
        self.stalls = 0
        """Number of stalls within a body length of the last one, itself included."""
        self.replanned: str | None = None
        """Reason for another path in the last step, or None."""
        self.path: SplinePath
        """Path that the motion follows."""
        self._passed_m: list[float]
        """Arc lengths of the waypoints; infinite where the path does not lead to one."""
        self._lay(np.asarray(start_m, float), None)

    @property
    def complete(self) -> bool:
        """Whether every waypoint has been reached."""
        return self.reached == len(self._goals_m)

    def ahead_m(self, reach_m: float) -> Floats:
        """(2,) the point ``reach_m`` ahead on the path, at most the next waypoint."""
        target_along_m = min(float(self._along_m[0]) + reach_m, self._passed_m[self.reached])
        return self.path.position(target_along_m)  # the path's end if it leads to no waypoint yet

    @property
    def next_waypoint(self) -> tuple[Floats, float] | None:
        """The next waypoint (2,) and its arc length on the path; None after the last.

        The arc length is infinite if the path does not lead to it.
        """
        if self.complete:
            return None
        return self.waypoints_m[self.reached], self._passed_m[self.reached]

    @property
    def leads_on(self) -> bool:
        """Whether the path leads to every remaining waypoint."""
        return not math.isinf(self._passed_m[-1])

    @property
    def astray(self) -> bool:
        """Whether the next waypoint has been missed before."""
        return self._missed_before == self.reached

    @property
    def along_m(self) -> float:
        """Arc length of the path point nearest to the body's centre."""
        return float(self._along_m[0])

    @property
    def head_along_m(self) -> float:
        """Arc length of the path point nearest to the head."""
        return float(self._along_m[1])

    def path_m(self, count: int) -> Floats:
        """(count, 2) points along the path in force."""
        return self.path.position(np.linspace(0.0, self.path.length_m, count))

    def observe(
        self,
        centre_m: Floats,
        head_m: Floats,
        fall_back: Callable[[bool], None] = lambda lost: None,
    ) -> bool:
        """Update the progress; count a waypoint near the centre, and return whether there is one.

        Arguments as in ``follow``.
        """
        self._followers_m[0], self._followers_m[1] = centre_m, head_m
        self.path.project(self._followers_m, self._along_m, self._gap_m)
        self.replanned = None
        if self.complete:
            return False
        x_m, y_m = self._goals_m[self.reached]
        if math.hypot(x_m - centre_m[0], y_m - centre_m[1]) > self._radius_m:
            return False
        self.reached += 1
        self._replanning = None  # its path would lead to this waypoint first
        fall_back(False)
        return True

    def follow(
        self,
        centre_m: Floats,
        head_m: Floats,
        heading_rad: Callable[[], float],
        travel: float,
        fall_back: Callable[[bool], None] = lambda lost: None,
    ) -> None:
        """Count a waypoint near the centre; request another path if this one failed.

        ``heading_rad`` is called only for another path. ``travel`` counts whether or not the body
        advanced. ``fall_back`` is called with False when a waypoint is reached.
        """
        self._travel = travel
        if self.observe(centre_m, head_m, fall_back) or self.complete or self.is_planning:
            return
        if self.feedback and travel >= self._replan_after:
            self._note_gain()
            why = self._failing(centre_m)
            if why is None:
                return
            if self._body_is_stalled:
                self._stalls_m.append(np.array(head_m))
                self.stalls = sum(math.dist(m, head_m) < self.length_m for m in self._stalls_m)
            self._request(why, heading_rad, is_miss=True)

    @property
    def is_planning(self) -> bool:
        """Whether another path is being planned."""
        return self._replanning is not None

    def cancel_planning(self) -> None:
        """Drop the requested path."""
        self._replanning = None

    def continue_planning(self, fall_back: Callable[[bool], None] = lambda lost: None) -> None:
        """Do one cycle's work on the requested path; put it in force when it is complete.

        Without a safe path the old one stays. ``fall_back`` is called with whether the same
        waypoint was missed again.
        """
        replanning = self._replanning
        if replanning is None or not replanning.carry_on():
            return
        self._replanning = None
        request = replanning.request
        self._replan_after = self._travel + _REPLAN_AFTER_BODIES * self._per_body
        if request.is_miss:
            self.replanned = request.why
            self.missed += 1
            fall_back(self.reached == self._missed_before)
            self._missed_before = self.reached
        if replanning.path is not None:
            self.replanned = request.why
            self._follow_path(replanning.path)

    def renew(
        self,
        why: str,
        is_clear: Callable[[Floats], bool],
        heading_rad: Callable[[], float],
    ) -> None:
        """Plan the path again beyond its next piece, because more of the ground is known.

        If that piece is not clear (test of points (n, 2)), the new path begins at the head, in the
        body's direction. Without a new path the old one stays.
        """
        path = self.path
        along_m = float(self._along_m[1])
        join_m = min(along_m + _KEPT_PATH_M, path.length_m)
        if self._passed_m[-1] <= join_m:
            return
        if self._gap_m[1] > _KEPT_PATH_M or not is_clear(path.piece_m(along_m, join_m)):
            with suppress(InputError):
                self._lay(self._followers_m[1].copy(), heading_rad())
                self.replanned = why
            return
        onwards: list[_Onward] = []
        for at_m in dict.fromkeys((join_m, max(join_m, path.length_m - _KEPT_PATH_M))):
            if is_clear(path.piece_m(join_m, at_m)):
                with suppress(InputError):
                    onwards.append(self._onward(at_m))
        best = min(onwards, key=lambda onward: onward.length_m, default=None)
        if best is not None and best.path is not path:
            self.path = best.path
            self._passed_m = best.passed_m
            self.replanned = why

    @property
    def off_path_m(self) -> float:
        """Distance of the body's centre from the path."""
        return float(self._gap_m[0])

    def lay_from_here(self, why: str, heading_rad: Callable[[], float]) -> None:
        """Request another path from the head, in the body's direction; it counts as no miss."""
        self._request(why, heading_rad, is_miss=False)

    def lead_to(self, left_m: Floats, heading_rad: Callable[[], float]) -> None:
        """Replace the remaining waypoints by (k, 2) others; none end the course here.

        If the new ones begin with the remaining ones, the path is extended from its end; else it
        begins at the head, and ``heading_rad`` is called.

        Raises:
            InputError: as the planner; then nothing has changed.

        """
        before = (self.waypoints_m, self._goals_m)
        self._replanning = None
        kept = self.waypoints_m[self.reached :]
        if np.array_equal(kept, left_m):
            return
        goes_on = 0 < len(kept) < len(left_m) and np.array_equal(kept, left_m[: len(kept)])
        self.waypoints_m = np.vstack([self.waypoints_m[: self.reached], left_m])
        self._goals_m = self.waypoints_m.tolist()
        try:
            if goes_on:
                onward = self._onward(self.path.length_m)
                self.path = onward.path
                self._passed_m = onward.passed_m
            elif len(left_m):
                self._lay(self._followers_m[1].copy(), heading_rad())
                self._missed_before = -1
                self._replan_after = self._travel + _REPLAN_AFTER_BODIES * self._per_body
            else:
                self._passed_m = self._passed_m[: self.reached]
        except InputError:
            self.waypoints_m, self._goals_m = before
            raise

    def _onward(self, join_m: float) -> "_Onward":
        """Keep the path up to ``join_m``, and plan from there.

        The new part keeps the direction, unless the path ends there and the bend is small.

        Raises:
            InputError: as the planner.

        """
        path = self.path
        behind = [passed_m for passed_m in self._passed_m if passed_m <= join_m]
        left_m, kept_m = self.waypoints_m[len(behind) :], path.piece_m(0.0, join_m)
        if not len(left_m):
            return _Onward(path, self._passed_m, path.length_m)
        points_m = np.vstack([kept_m[-1], left_m])
        avoid_m = self._avoid_m
        heading = path.heading_rad(max(join_m - 0.05, 0.0))
        number = len(behind) + 1
        more = at_once(self._plan(points_m, None, avoid_m=avoid_m, number=number))
        if abs(wrap(more.heading_rad(0.05) - heading)) > _BEND_RAD:
            more = at_once(self._plan(points_m, heading, avoid_m=avoid_m, number=number))
        more_m = more.piece_m(0.0, more.length_m)
        passes = [pass_m + join_m for pass_m in self._passes(more, left_m)]
        gaps_m = [more_m[-1], *left_m[np.isinf(passes)]]
        beyond_m = float(np.hypot(*np.diff(gaps_m, axis=0).T).sum())
        tabulated = SplinePath.tabulated(np.vstack([kept_m, more_m[1:]]))
        # tabulating again shortens the path slightly: keep its last waypoint within it
        passes = [
            pass_m if math.isinf(pass_m) else min(pass_m, tabulated.length_m) for pass_m in passes
        ]
        return _Onward(
            tabulated, [*behind, *passes], tabulated.length_m + _BEYOND_PATH_WEIGHT * beyond_m
        )

    def _failing(self, centre_m: Floats) -> str | None:
        if self._body_is_stalled:
            return "no advance on the path"
        if self._has_passed_waypoint(centre_m):
            return f"waypoint {self.reached + 1} passed by"
        if self._gap_m[0] > _OFF_PATH_BODIES * self.length_m:
            return f"{self._gap_m[0]:.2f} m off the path"
        return None

    def _note_gain(self) -> None:
        along_m = float(self._along_m[0])
        if along_m > self._gained_m + _STALL_BODIES * self.length_m:
            self._gained_m, self._gained_at = along_m, self._travel

    @property
    def _body_is_stalled(self) -> bool:
        return (self._travel - self._gained_at) / self._per_body > _STALL_AFTER_BODIES

    def _has_passed_waypoint(self, centre_m: Floats) -> bool:
        """Whether the body is beyond the next waypoint on the path, which it did not come near."""
        path = self.path
        end_m = self.path.length_m
        along_m = float(self._along_m[0])
        if (
            along_m >= end_m - 1e-6
        ):  # add the distance beyond the end, along the path's last direction
            last = path.position([end_m - 0.05, end_m])
            ahead = (last[1] - last[0]) / 0.05
            along_m += float((centre_m - last[1]) @ ahead)
        return bool(along_m > self._passed_m[self.reached] + self._radius_m)

    def _request(self, why: str, heading_rad: Callable[[], float], *, is_miss: bool) -> None:
        points_m = np.vstack([self._followers_m[1], self.waypoints_m[self.reached :]])
        request = PathRequest(
            why, points_m, heading_rad(), self._avoid_m, self.reached + 1, is_miss
        )
        self._replanning = Replanning(request, self._plan)

    def _lay(self, from_m: Floats, heading_rad: float | None) -> None:
        """Plan from a point, with the body's heading, through the remaining waypoints."""
        points_m = np.vstack([from_m, self.waypoints_m[self.reached :]])
        self._replanning = None
        plan = self._plan(points_m, heading_rad, avoid_m=self._avoid_m, number=self.reached + 1)
        self._follow_path(at_once(plan))

    @property
    def _avoid_m(self) -> Floats:
        """(n, 2) places at which the body made no progress."""
        return np.array(self._stalls_m).reshape(-1, 2)

    def _follow_path(self, path: SplinePath) -> None:
        """Put a path in force that begins at the head."""
        self.path = path
        self._gained_m, self._gained_at = 0.0, self._travel
        self._along_m[:] = 0.0
        left_m = self.waypoints_m[self.reached :]
        self._passed_m = [0.0] * self.reached + self._passes(self.path, left_m)

    def _passes(self, path: SplinePath, waypoints_m: Floats) -> list[float]:
        """Arc lengths of a path at waypoints (k, 2); infinite from the first out of reach.

        A path on a partial map may end before a waypoint.
        """
        passes = path.passes(waypoints_m)
        on = True
        for k, (waypoint, pass_m) in enumerate(zip(waypoints_m, passes, strict=True)):
            on = on and float(np.hypot(*(path.position(pass_m) - waypoint))) <= self._radius_m
            passes[k] = pass_m if on else math.inf
        return passes
