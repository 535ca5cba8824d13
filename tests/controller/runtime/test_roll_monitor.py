"""The roll monitor tells once, after a while, in both directions."""

import numpy as np

from snakewalk.config.robot import RobotConfig
from snakewalk.controller.kinematics.links import body_in_world
from snakewalk.controller.runtime.roll_monitor import RollMonitor
from snakewalk.drivers.attitude import rotation_by
from snakewalk.drivers.types import BodyPose

ROBOT = RobotConfig(name="four", joint_axes="ypyp")


def told(rolls_deg: list[float], step_s: float = 0.1) -> list[tuple[float, str]]:
    monitor, lines = RollMonitor(), []
    for k, roll_deg in enumerate(rolls_deg):
        turn = rotation_by(np.array([np.deg2rad(roll_deg), 0.0, 0.0]))
        view = body_in_world(ROBOT, BodyPose(0.0, np.zeros(3), turn), np.zeros(4))
        line = monitor.update(view, k * step_s)
        if line is not None:
            lines.append((round(k * step_s, 1), line))
    return lines


def test_over_and_upright_are_told_once_each() -> None:
    lines = told([0.0] * 10 + [170.0] * 40 + [10.0] * 40)
    assert lines == [
        (2.5, "rolled over: the links lie 170 degrees off upright"),
        (6.5, "upright again"),
    ]


def test_a_turn_of_a_rolling_body_is_none() -> None:
    assert told([float(k * 36 % 360) for k in range(100)]) == []


def test_what_sways_between_the_two_marks_changes_nothing() -> None:
    assert told([70.0, 55.0] * 50) == []
    assert len(told([100.0] * 20 + [70.0, 55.0] * 50)) == 1
