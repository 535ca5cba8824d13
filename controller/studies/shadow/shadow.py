"""A simulated chain that receives another chain's goals at the same times."""

from collections.abc import Callable
from typing import cast

from snakewalk.config.arrays import Floats
from snakewalk.config.heightfield import HeightField
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.config.world import WorldConfig
from snakewalk.controller.run.deviation import NO_DEVIATION, Deviation
from snakewalk.controller.run.external.simulated_backend import simulated
from snakewalk.controller.runlog.record import InitialPose
from snakewalk.drivers.types import BodyPose, JointCommand, JointState


class Shadow:
    """A simulated chain, ready for its first step.

    Args:
        run: start, rate and physics step.
        robot: the chain's.
        world: its assumed ground.
        ground: the world's height field.
        initial_pose: heading of the head link, and initial joint angles.
        deviation: differences of the simulated robot and its ground.

    """

    def __init__(
        self,
        run: RunConfig,
        robot: RobotConfig,
        world: WorldConfig,
        ground: HeightField | None,
        initial_pose: InitialPose,
        deviation: Deviation = NO_DEVIATION,
    ) -> None:
        backend = simulated(run, robot, world, ground, initial_pose, deviation)
        self._chain = backend.chain
        self._clock = backend.clock
        self.head_pose = cast(Callable[[], BodyPose], backend.pose)
        """Pose of its head; a simulated body always has one."""
        self._lay_down = cast(Callable[[InitialPose], None], backend.lay_down)
        self._chain.enable()
        self._start_s = self._clock.now_s()

    def restart(self, pose: InitialPose) -> None:
        """Put the chain at another pose, at rest, and restart its time; quick, on level ground."""
        self._lay_down(pose)
        self._start_s = self._clock.now_s()

    def step(
        self,
        since_start_s: float,
        sent_rad: Floats,
        delay_s: float = 0.0,
        *,
        sent_after_s: float = 0.0,
    ) -> JointState:
        """Read at the other chain's time, then send its goals (J,).

        Args:
            since_start_s: time of the read.
            sent_rad: (J,) goals.
            delay_s: computing time of the host between reply and goals.
            sent_after_s: least time from measurement to goals.

        """
        self._clock.sleep_until_s(self._start_s + since_start_s)
        state = self._chain.read()
        goals_s = max(state.time_s + delay_s, measured_s(state) + sent_after_s)
        if goals_s > self._clock.now_s():
            self._clock.sleep_until_s(goals_s)
        self._chain.write(JointCommand(self._clock.now_s(), sent_rad))
        self._chain.check_servos()
        return state


def measured_s(state: JointState) -> float:
    """Return when the joints were measured, or the end of a failed read."""
    age_s = state.age_s[state.valid]
    return state.time_s - (float(age_s.min()) if len(age_s) else 0.0)
