"""A simulated robot driven frame by frame by a motion source: servos, bus, safety, MuJoCo."""

from contextlib import ExitStack
from typing import Any, Self

from snakewalk.config.arrays import Floats
from snakewalk.config.ground import build_ground
from snakewalk.config.loader import checked
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.config.world import WorldConfig
from snakewalk.controller.kinematics.links import BodyView, body_in_world
from snakewalk.controller.run.external.simulated_backend import simulated
from snakewalk.controller.run.prepared_run import pose_with
from snakewalk.drivers.safety.limits import SafetyLimits
from snakewalk.drivers.safety.safe_link import SafeLink
from snakewalk.drivers.types import JointCommand

FRAME_S = 1.0 / 60.0
STEPS = 8
"""Physics steps in a frame."""


class PhysicsBody:
    """Simulated robot that starts in the shape ``joint_rad`` (J,) with its head at ``start_m``.

    It is a context manager.
    """

    def __init__(
        self,
        robot: RobotConfig,
        world: WorldConfig,
        joint_rad: Floats,
        start_m: tuple[float, float] = (0.0, 0.0),
        heading_rad: float = 0.0,
    ) -> None:
        run = checked(
            RunConfig,
            {
                "name": "repertoire",
                "robot": robot.name,
                "world": world.name,
                "waypoints_m": [start_m],
                "start_m": start_m,
                "cycle_hz": 1.0 / FRAME_S,
                "physics_step_s": FRAME_S / STEPS,
            },
            "repertoire",
        )
        self.robot = robot
        initial_pose = pose_with(robot, heading_rad, joint_rad)
        self._backend = simulated(run, robot, world, build_ground(world), initial_pose)
        limits = SafetyLimits.from_config(robot, run.safety)
        self._link = SafeLink(self._backend.chain, limits, self._backend.clock)
        self._open = ExitStack()
        self._due_s = 0.0

    def __enter__(self) -> Self:
        """Torque on."""
        self._open.enter_context(self._link)
        self._link.enable()
        self._due_s = self._backend.clock.now_s()
        self._keep_view()
        return self

    def __exit__(self, *raised: Any) -> None:
        """Torque off."""
        self._open.__exit__(*raised)

    def frame(self, goal_rad: Floats) -> None:
        """One frame: wait for it, read the joints, send goals (J,).

        Raises:
            SafetyTrippedError: the safety has latched.

        """
        self._due_s += FRAME_S
        self._backend.clock.sleep_until_s(self._due_s)
        self._link.read()
        self._keep_view()
        self._link.write(JointCommand(self._due_s, goal_rad))

    @property
    def joint_rad(self) -> Floats:
        """(J,) shaft angles when the joints were read."""
        return self._joint_rad

    def view(self) -> BodyView:
        """Where the links were when the joints were read."""
        return self._view

    def _keep_view(self) -> None:
        # after the read: packets bring the simulated body up to the time, the clock alone does not
        qpos = self._backend.qpos
        pose = self._backend.pose
        assert qpos is not None, "a simulated robot has coordinates"
        assert pose is not None, "a simulated robot has a pose"
        self._joint_rad = qpos()[7:]
        self._view = body_in_world(self.robot, pose(), self._joint_rad)
