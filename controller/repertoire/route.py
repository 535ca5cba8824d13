"""Following a route: the next action at the end of a cycle, planned before or searched again."""

from collections.abc import Sequence

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.kinematics.frame import body_frame
from snakewalk.controller.kinematics.links import BodyView
from snakewalk.controller.kinematics.rotations import wrap
from snakewalk.controller.repertoire.search import (
    AIM_SHARE,
    MotionPrimitives,
    Route,
    plane_pose,
    search,
)


class RouteFollower:
    """Chooses actions for a ``RepertoireMotion`` and counts the waypoints that are reached."""

    def __init__(
        self,
        primitives: MotionPrimitives,
        route: Route,
        waypoints_m: Sequence[tuple[float, float]],
        radius_m: float,
        *,
        replan: bool = True,
    ) -> None:
        """Start on ``route``; with ``replan`` the search begins again at the end of each cycle."""
        self._primitives = primitives
        self._route = route
        self._waypoints_m, self._radius_m = tuple(waypoints_m), radius_m
        self._replan = replan
        self.reached = 0
        self.chosen: list[int] = [route.actions[0]]
        """Actions that the follower has chosen so far."""
        self.predicted: list[Floats] = [route.pose[1]]
        """(3,) where each action should end, predicted when it began."""
        self.measured: list[Floats] = []
        """(3,) where each action did end."""

    @property
    def done(self) -> bool:
        """Whether every waypoint has been reached."""
        return self.reached == len(self._waypoints_m)

    def count_waypoints(self, view: BodyView) -> None:
        """Count a waypoint when the centre is near it."""
        if self.done:
            return
        off = np.asarray(self._waypoints_m[self.reached]) - view.centre_m[:2]
        self.reached += int(float(np.hypot(*off)) <= self._radius_m)

    def choose(self, view: BodyView) -> int | None:
        """Return the next action; None after the last."""
        pose = plane_pose(body_frame(view.link_m))
        self.measured.append(pose)
        taken = len(self.chosen)
        if not self._replan:
            if taken >= len(self._route.actions):
                return None
            action = self._route.actions[taken]
        else:
            if self.done:
                return None
            ahead = search(
                self._primitives,
                pose,
                self._waypoints_m,
                AIM_SHARE * self._radius_m,
                reached=self.reached,
                beam=100,
                depth=12,
            )
            action = ahead.actions[0]
        self.chosen.append(action)
        self.predicted.append(self._primitives.after(pose, action))
        return action

    def errors(self) -> Floats:
        """(n, 2) distance and turn by which each action missed its prediction, m and rad."""
        predicted = np.array(self.predicted[: len(self.measured)])
        return _errors(np.array(self.measured), predicted)

    def route_errors(self) -> Floats:
        """(n, 2) the same against the route as planned, without measuring in between."""
        count = min(len(self.measured), len(self._route.actions))
        return _errors(np.array(self.measured)[:count], self._route.pose[1 : count + 1])


def _errors(measured: Floats, predicted: Floats) -> Floats:
    if not len(measured):
        return np.zeros((0, 2))
    off = measured - predicted
    return np.column_stack([np.hypot(off[:, 0], off[:, 1]), np.abs(wrap(off[:, 2]))])
