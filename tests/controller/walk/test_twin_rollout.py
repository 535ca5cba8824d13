"""What a twin is told, and when."""

import numpy as np

from snakewalk.config.loader import load_robot
from snakewalk.config.world import FrictionConfig
from snakewalk.controller.kinematics.links import BodyView, body_in_world
from snakewalk.controller.mechanics.rollout import TabulatedPath
from snakewalk.controller.walk.steering import PathPose
from snakewalk.controller.walk.twin_rollout import TwinRollout
from snakewalk.drivers.types import BodyPose

ROBOT = load_robot("yaw16")
DT_S = 0.02
STRAIGHT = TabulatedPath.of(np.column_stack([np.arange(0.0, 2.0, 0.01), np.zeros(200)]))


def body(x_m: float, bend_rad: float = 0.0) -> BodyView:
    head = BodyPose(0.0, np.array([x_m, 0.0, 0.03]), np.eye(3))
    return body_in_world(ROBOT, head, np.full(ROBOT.joint_count, bend_rad))


class Glider:
    """A twin whose head goes on as it was seen to move; its joints take their goals."""

    def begin(
        self,
        before: BodyPose,
        now: BodyPose,
        before_rad: np.ndarray,
        now_rad: np.ndarray,
        dt_s: float,
    ) -> None:
        self.head_m = now.head_in_world_m
        self.velocity_m_s = (now.head_in_world_m - before.head_in_world_m) / dt_s
        self.begun_rad = now_rad

    def use_friction(self, friction: FrictionConfig) -> None:
        self.friction = friction

    def step(self, goal_rad: np.ndarray, dt_s: float) -> tuple[BodyPose, np.ndarray]:
        self.head_m = self.head_m + self.velocity_m_s * dt_s
        return BodyPose(0.0, self.head_m, np.eye(3)), goal_rad


def rolled_m(rollout: TwinRollout, cycles: int) -> float:
    """Roll out so many cycles with straight goals; the distance along the path."""
    pose = PathPose(0.0, 0.0, np.zeros(2), 0.0, STRAIGHT, 20)
    left = iter(range(cycles))
    goals = np.zeros(ROBOT.joint_count)
    rolled = rollout.roll(pose, lambda: next(left, None) is None, lambda dt_s, view: goals)
    assert abs(rolled.time_s[0] - cycles * DT_S) < 1e-9
    return float(rolled.along_m[0])


def test_it_begins_where_the_body_is_with_its_speed_and_joints() -> None:
    glider = Glider()
    rollout = TwinRollout(ROBOT, lambda: glider, FrictionConfig())
    centre_m = -body(0.0).centre_m[0] + 0.2  # here the centre is at the path's twentieth point
    rollout.observe(body(centre_m - 0.01, 0.1), DT_S)
    rollout.observe(body(centre_m), DT_S)
    assert abs(rolled_m(rollout, 40) - 0.4) < 0.006  # 0.5 m/s for 0.8 s, in steps of 1 cm
    np.testing.assert_allclose(glider.begun_rad, 0.0, atol=1e-12)


def test_after_forgetting_a_body_is_at_rest() -> None:
    """It has moved meanwhile otherwise, for longer than a cycle: that is no speed."""
    rollout = TwinRollout(ROBOT, Glider, FrictionConfig())
    rollout.observe(body(-3.0), DT_S)
    rollout.forget()
    rollout.observe(body(0.0), DT_S)
    assert abs(rolled_m(rollout, 40)) < 0.25


def test_each_rollout_lays_the_twin_on_the_friction_of_the_moment() -> None:
    glider = Glider()
    asked: list[Glider] = []

    def make() -> Glider:
        asked.append(glider)
        return glider

    rollout = TwinRollout(ROBOT, make, FrictionConfig())
    rollout.observe(body(0.0), DT_S)
    assert not asked  # a twin is made when it is first needed
    for along in (0.1, 0.2):
        rollout.friction = FrictionConfig(along=along)
        glider.friction = FrictionConfig(along=0.5)  # another has used it meanwhile
        rolled_m(rollout, 2)
        assert glider.friction.along == along
