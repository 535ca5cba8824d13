"""A wrapped motion source reports what the source does, unless a subclass overrides it."""

import numpy as np

from snakewalk.config.loader import load_robot
from snakewalk.controller.kinematics.links import body_in_world, pose_at
from snakewalk.controller.motion.source import Hold, MotionSource
from snakewalk.controller.motion.source_switch import SourceSwitch
from snakewalk.controller.motion.wrapper import MotionWrapper


class Same(MotionWrapper):
    def step(self, dt_s: float, view: object) -> np.ndarray:
        return self.wrapped.step(dt_s, view)  # type: ignore[arg-type]


def test_it_reports_what_the_source_reports() -> None:
    hold = Hold(np.array([0.1, -0.2]))
    same: MotionSource = Same(hold)
    assert same.needs == hold.needs
    assert same.done
    np.testing.assert_array_equal(same.goal_rad(), [0.1, -0.2])
    np.testing.assert_array_equal(same.velocity_rad_s(), np.zeros(2))
    np.testing.assert_array_equal(same.pace().speed_rad_s, np.zeros(2))


def test_a_switch_reports_the_source_that_it_joined() -> None:
    robot = load_robot("yaw16")
    still, bent = np.zeros(robot.joint_count), np.full(robot.joint_count, 0.1)
    switch = SourceSwitch(robot, Hold(still))
    assert switch.done
    duration_s = switch.join(Hold(bent))
    assert not switch.done
    assert switch.pace().speed_rad_s.max() == robot.joint_speed_limit_rad_s
    view = body_in_world(robot, pose_at(np.zeros(2), 0.0), still)
    for _ in range(int(duration_s / 0.02) + 2):
        switch.step(0.02, view)
    assert switch.done
    np.testing.assert_allclose(switch.goal_rad(), bent, atol=1e-12)
    assert switch.pace().speed_rad_s.max() == 0.0
