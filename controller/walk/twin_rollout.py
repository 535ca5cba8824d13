"""A rollout on a twin: a piece of track is tried on a simulated body.

The balance of forces on paper knows no weight that rests on few links of a body on rough ground; a
body that physics moves does. It costs a hundred times as much.
"""

from collections.abc import Callable, Iterator
from typing import Protocol, runtime_checkable

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import FrictionConfig
from snakewalk.controller.kinematics.links import BodyView, body_in_world, chain_angles_rad
from snakewalk.controller.mechanics.rollout import Followed, Rolled
from snakewalk.controller.walk.steering import PathPose
from snakewalk.drivers.types import BodyPose

LENGTH_BODIES = 1.0
"""Length of pulse that is rolled out."""
_LONGEST_S = 6.0


class Twin(Protocol):
    """A simulated body of the robot."""

    def begin(
        self, before: BodyPose, now: BodyPose, before_rad: Floats, now_rad: Floats, dt_s: float
    ) -> None:
        """Put it where the robot is, moving as the robot did since ``dt_s`` ago."""
        ...

    def use_friction(self, friction: FrictionConfig) -> None:
        """Lay it on ground with this friction."""
        ...

    def step(self, goal_rad: Floats, dt_s: float) -> tuple[BodyPose, Floats]:
        """Hold goals (J,) for ``dt_s``; returns the head's pose and the joints (J,) then."""
        ...


@runtime_checkable
class UsesTwin(Protocol):
    """A motion that tries what it will do, where it is given the means."""

    def use_twin(self, twin: "TwinRollout") -> None:
        """Try it on this twin."""
        ...


class TwinRollout:
    """Rolls out motions of one robot on its twin."""

    def __init__(
        self, robot: RobotConfig, make_twin: Callable[[], Twin], friction: FrictionConfig
    ) -> None:
        """``make_twin`` is asked before each rollout, and may return the same one."""
        self._robot, self._make_twin = robot, make_twin
        self.friction = friction
        """Friction of the ground that the twin is laid on."""
        self._seen: list[BodyView] = []
        self._dt_s = 0.0

    @property
    def cycle_s(self) -> float:
        """Length of the cycles that were seen, and of those that are tried."""
        return self._dt_s

    def observe(self, view: BodyView, dt_s: float) -> None:
        """Process the measured body, ``dt_s`` after the last."""
        self._seen = [*self._seen[-1:], view]
        self._dt_s = dt_s

    def forget(self) -> None:
        """Leave out what was seen: the next body is not seen one cycle after it."""
        self._seen = []

    def roll(
        self, pose: PathPose, is_over: Callable[[], bool], move: Callable[[float, BodyView], Floats]
    ) -> Rolled:
        """Move the twin, from where the robot is, until ``is_over``.

        Args:
            pose: with the path to measure by.
            is_over: asked before each cycle; not yet at once.
            move: called with the length of a cycle and the body; returns goals (J,).

        """
        followed, view = Followed(pose.path, pose.path_at), self._seen[-1]
        bodies = self.bodies(move, _LONGEST_S)
        while not is_over():
            found = next(bodies, None)
            if found is None:
                break
            view = found
            followed.note(view.centre_m[:2], self._dt_s)
        return followed.rolled(view.headings_rad, view.link_m[:, :2] - view.centre_m[:2])

    def bodies(
        self, move: Callable[[float, BodyView], Floats], longest_s: float
    ) -> Iterator[BodyView]:
        """Move the twin from where the robot is; its body after each cycle, for ``longest_s``.

        Args:
            move: as for ``roll``.
            longest_s: until it ends by itself.

        """
        twin, robot, view = self._make_twin(), self._robot, self._seen[-1]
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


def seen_state(robot: RobotConfig, view: BodyView) -> tuple[BodyPose, Floats]:
    """Head's pose and joints (J,) of a body seen."""
    pose = BodyPose(0.0, view.link_m[0], view.rotation[0])
    return pose, chain_angles_rad(robot, view)
