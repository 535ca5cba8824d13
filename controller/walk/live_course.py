"""A live course: an operator sets the waypoints of a motion while it runs.

The motion rests at the last waypoint and waits for another. It is done when the operator ends it.
"""

import math
from collections.abc import Callable, Iterable
from typing import Protocol

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.kinematics.links import BodyView
from snakewalk.controller.motion.command import Refused
from snakewalk.controller.motion.path_progress import Decision, PathProgress
from snakewalk.controller.motion.refusals import Refusals
from snakewalk.controller.motion.source import MotionSource
from snakewalk.controller.motion.wrapper import MotionWrapper
from snakewalk.controller.walk.course import Course, OnCourse

ADD = "waypoint"
"""Command ``waypoint=X,Y``: go there after the waypoints that are left."""
NEXT = "next"
"""Command ``next=X,Y``: go there, and leave the other waypoints out."""
CLEAR = "clear"
"""Command ``clear``: leave out the waypoints that are left."""
END = "end"
"""End the run at rest, without the remaining waypoints."""
WAYPOINTS_MAX = 1000
"""Most waypoints that a run accepts (ours)."""
_COMMANDS_MAX = 10
"""Largest number of commands in a step (ours): a person clicks less often."""
_LEAST_DISTANCE_M = 0.05
"""Least distance between the begin and the goal of a path (ours)."""


class MotionOnCourse(MotionSource, PathProgress, Protocol):
    """A motion that a live course steers."""

    @property
    def course(self) -> Course:
        """In force."""
        ...


class LiveCourse(MotionWrapper, OnCourse):
    """A ``MotionSource`` with ``PathProgress`` and ``OpenWaypoints``."""

    def __init__(
        self,
        motion: MotionOnCourse,
        commands: Callable[[], Iterable[str | Refused]],
        check: Callable[[Floats], None],
        on_event: Callable[[str, str], None],
    ) -> None:
        """Follow the waypoints of the motion's course.

        Args:
            motion: along a course.
            commands: returns those since the last call: ``ADD``, ``NEXT``, ``CLEAR``, ``END``;
                others are rejected.
            check: raises ``InputError`` for a point (2,) that cannot be a waypoint on any path.
            on_event: called with ("operator", text) for an action, ("refused", text) for a
                rejection.

        """
        OnCourse.__init__(self, motion.course)
        MotionWrapper.__init__(self, motion)
        self._motion = motion
        self._commands = commands
        self._check = check
        self._on_event = on_event
        self._refusals = Refusals(lambda why: on_event("refused", why))
        self._time_s = 0.0
        self._changed: str | None = None
        self._ends = self._reported_complete = False

    @property
    def waypoints_m(self) -> Floats:
        """(w, 2) in force, reached ones first."""
        return self.course.waypoints_m

    @property
    def replanned(self) -> str | None:
        """Reason for a new path in the last step, or None."""
        return self._changed or self.course.replanned

    @property
    def done(self) -> bool:
        """Whether the operator has ended the run and the motion rests."""
        return self._ends and self._motion.done

    @property
    def pulse_m_s(self) -> float:
        """Speed of the shape along the body."""
        return self._motion.pulse_m_s

    @property
    def decision(self) -> Decision | None:
        """Decision of the last step, or None."""
        return self._motion.decision

    def begin(self, view: BodyView) -> Floats:
        """(J,) where the motion begins."""
        return self._motion.begin(view)

    def step(self, dt_s: float, view: BodyView) -> Floats:
        """Advance by ``dt_s``, and carry out the commands."""
        self._changed = None
        goal_rad = self._motion.step(dt_s, view)
        self._time_s += dt_s
        commands = list(self._commands())
        for command in commands[:_COMMANDS_MAX]:
            self._carry_out(command, view)
        if len(commands) > _COMMANDS_MAX:
            why = f"{len(commands)} commands at once; only the first {_COMMANDS_MAX} count"
            self._refusals.add(why, self._time_s)
        self._refusals.step(self._time_s)
        if self.course.complete and not self._reported_complete and not self._ends:
            self._on_event("operator", "no waypoint is left: the body holds, and waits for another")
        self._reported_complete = self.course.complete
        return goal_rad

    def _carry_out(self, command: str | Refused, view: BodyView) -> None:
        if isinstance(command, Refused):
            self._refusals.add(command.why, self._time_s)
            return
        word, _, value = command.partition("=")
        if self._ends:
            return
        if word not in (ADD, NEXT, CLEAR, END):
            self._refusals.add(f"{command}: no command for waypoints", self._time_s)
            return
        left_m = self.waypoints_m[self.reached :]
        try:
            if word in (ADD, NEXT):
                point_m = self._point_m(value, left_m if word == ADD else left_m[:0], view)
                self._lead_to(np.vstack([left_m, point_m] if word == ADD else [point_m]), view)
                text = f"waypoint {len(self.waypoints_m)} at {_point_text(point_m)}"
            else:
                self._lead_to(left_m[:0], view)
                self._ends = word == END
                text = "the body comes to rest, and the run ends" if self._ends else "it stops here"
        except InputError as error:
            self._refusals.add(error.faults[0], self._time_s)
            return
        if word != ADD and len(left_m):
            text += f"; waypoints left out: {len(left_m)}"
        self._on_event("operator", text)

    def _lead_to(self, left_m: Floats, view: BodyView) -> None:
        path = self.course.path
        self.course.lead_to(left_m, lambda: view.heading_rad)
        if self.course.path is not path:
            self._changed = "waypoints were set"

    def _point_m(self, text: str, left_m: Floats, view: BodyView) -> Floats:
        """(2,) of X,Y in metres.

        Raises:
            InputError: the text is not a point, it repeats the last one, or none is allowed there.

        """
        try:
            x_m, y_m = (float(part) for part in text.split(","))
        except ValueError:
            x_m = y_m = math.nan
        point_m = np.array([x_m, y_m])
        if not np.isfinite(point_m).all():
            raise InputError(f"waypoint {text}: expected X,Y in metres")
        if len(self.waypoints_m) >= WAYPOINTS_MAX:
            raise InputError(
                f"waypoint {_point_text(point_m)}: a run accepts {WAYPOINTS_MAX} at most"
            )
        self._check(point_m)
        before_m = left_m[-1] if len(left_m) else view.link_m[0, :2]
        if np.hypot(*(point_m - before_m)) < _LEAST_DISTANCE_M:
            what = "the waypoint before it" if len(left_m) else "the head"
            raise InputError(f"waypoint {_point_text(point_m)}: {what} is there")
        return point_m


def _point_text(point_m: Floats) -> str:
    x_m, y_m = (round(float(coordinate), 2) + 0.0 for coordinate in point_m)  # avoids -0.00
    return f"({x_m:.2f}, {y_m:.2f})"
