"""A rollout on a twin: a piece of track is tried on a simulated body.

Unlike the balance of forces on paper, it includes weight that rests on few links on rough ground.
It costs a hundred times as much.
"""

from collections.abc import Callable, Iterator
from typing import Protocol, runtime_checkable

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import FrictionConfig
from snakewalk.controller.kinematics.links import BodyView, body_in_world
from snakewalk.controller.mechanics.rollout import Followed, Rolled
from snakewalk.controller.walk.steering import PathPose
from snakewalk.controller.walk.twin import Twin, seen_state

LENGTH_BODIES = 1.0
"""Length of pulse that is rolled out."""
_LONGEST_ROLLOUT_S = 6.0


@runtime_checkable
class UsesTwin(Protocol):
    """A motion that can try its next pieces on a twin."""

    def use_twin(self, twin: "TwinRollout") -> None:
        """Try pieces on this twin."""
        ...


class TwinRollout:
    """Predictor that simulates motions of one robot on its twin."""

    def __init__(
        self, robot: RobotConfig, make_twin: Callable[[], Twin], friction: FrictionConfig
    ) -> None:
        """``make_twin`` is called before each rollout; it may return the same twin."""
        self._robot = robot
        self._make_twin = make_twin
        self.friction = friction
        """Friction of the ground that the twin is laid on."""
        self._seen: list[BodyView] = []
        self._dt_s = 0.0

    @property
    def cycle_s(self) -> float:
        """Length of the observed and the simulated cycles."""
        return self._dt_s

    def observe(self, view: BodyView, dt_s: float) -> None:
        """Store the measured body, ``dt_s`` after the last."""
        self._seen = [*self._seen[-1:], view]
        self._dt_s = dt_s

    def forget(self) -> None:
        """Discard observed bodies: the next one does not follow them by one cycle."""
        self._seen = []

    def roll(
        self, pose: PathPose, is_over: Callable[[], bool], move: Callable[[float, BodyView], Floats]
    ) -> Rolled:
        """Move the twin from the robot's pose until ``is_over``, which is first False.

        Args:
            pose: contains the path to measure progress on.
            is_over: called before each cycle.
            move: called with the length of a cycle and the body; returns goals (J,).

        """
        followed = Followed(pose.path, pose.path_at)
        view = self._seen[-1]
        bodies = self.bodies(move, _LONGEST_ROLLOUT_S)
        while not is_over():
            next_view = next(bodies, None)
            if next_view is None:
                break
            view = next_view
            followed.note(view.centre_m[:2], self._dt_s)
        return followed.rolled(view.headings_rad, view.link_m[:, :2] - view.centre_m[:2])

    def bodies(
        self, move: Callable[[float, BodyView], Floats], longest_s: float
    ) -> Iterator[BodyView]:
        """Yield the twin's body after each cycle, from the robot's pose, for ``longest_s``.

        ``move`` as in ``roll``.
        """
        twin = self._make_twin()
        robot = self._robot
        view = self._seen[-1]
        twin.use_friction(self.friction)
        before, before_rad = seen_state(robot, self._seen[0])
        now, now_rad = seen_state(robot, view)
        twin.begin(before, now, before_rad, now_rad, self._dt_s)
        time_s = 0.0
        while time_s < longest_s:
            now, now_rad = twin.step(move(self._dt_s, view), self._dt_s)
            view = body_in_world(robot, now, now_rad)
            time_s += self._dt_s
            yield view
