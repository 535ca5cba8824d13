"""A recording with gaps: nothing that was not measured reaches a servo."""

import numpy as np
import pytest

from snakewalk.config.loader import load_robot
from snakewalk.controller.kinematics.links import BodyView
from snakewalk.controller.motion.parted_recording import PartedRecording, gaps, recording
from snakewalk.controller.motion.recorded import Recorded
from snakewalk.controller.motion.source import HEADROOM

STEP_S = 0.002
ROBOT = load_robot("yaw16")
NOWHERE = BodyView(np.zeros((17, 3)), np.tile(np.eye(3), (17, 1, 1)), np.zeros(3))


def wave(*missing: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
    """A wave of 1 Hz and 0.4 rad over 12 s, without the rows between the times of each pair."""
    time_s = 0.02 * np.arange(600)
    kept = np.all([(time_s <= a) | (time_s >= b) for a, b in missing], axis=0)
    phase = 2.0 * np.pi * (time_s[:, None] - np.arange(16) / 16.0)
    return time_s[kept], 0.4 * np.sin(phase)[kept]


@pytest.mark.parametrize("missing", [[(2.0, 9.0)], [(1.1, 1.5), (6.0, 6.04 + 0.3)]])
def test_joints_stay_within_what_was_recorded_and_within_their_limits(
    missing: list[tuple[float, float]],
) -> None:
    time_s, joints = wave(*missing)
    motion = recording(ROBOT, time_s, joints)
    assert isinstance(motion, PartedRecording)
    slowed = recording(ROBOT, time_s, joints, 1.0 / motion.slowed)
    goals = [slowed.goal_rad()]
    speeds = [slowed.velocity_rad_s()]
    while not slowed.done:
        goals.append(slowed.step(STEP_S, NOWHERE))
        speeds.append(slowed.velocity_rad_s())
    goal = np.array(goals)
    assert (goal <= joints.max(axis=0) + 1e-3).all()
    assert (goal >= joints.min(axis=0) - 1e-3).all()
    np.testing.assert_allclose(goal[0], joints[0], atol=1e-9)
    np.testing.assert_allclose(goal[-1], joints[-1], atol=1e-9)
    acceleration = np.abs(np.diff(speeds, axis=0)).max() / STEP_S
    assert acceleration <= 1.05 * HEADROOM * ROBOT.joint_acceleration_limit_rad_s2
    assert np.abs(speeds).max() <= HEADROOM * ROBOT.joint_speed_limit_rad_s + 1e-9
    assert slowed.pace().speed_rad_s.max() >= np.abs(speeds).max() - 1e-9
    assert len(goal) * STEP_S == pytest.approx(slowed.duration_s, abs=6 * STEP_S)


def test_one_row_between_two_gaps_is_passed_at_rest() -> None:
    time_s, joints = wave((2.0, 5.0), (5.0, 9.0))
    motion = recording(ROBOT, time_s, joints)
    near = []
    while not motion.done:
        near.append(np.abs(motion.step(STEP_S, NOWHERE) - joints[time_s == 5.0][0]).max())
    assert min(near) < 1e-6


def test_a_few_missing_rows_are_no_gap() -> None:
    assert not len(gaps(wave((2.0, 2.06))[0]))
    assert not len(gaps(np.arange(20) * 0.04))
    assert isinstance(recording(ROBOT, *wave((2.0, 2.06))), Recorded)
    assert gaps(wave((2.0, 9.0))[0]).tolist() == [101]
