"""A recording as a motion: its own angles, at a speed and with ramps that the robot accepts."""

import re
from collections.abc import Iterator

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.kinematics.links import BodyView
from snakewalk.controller.motion.recorded import RAMP_S, Recorded

ROBOT = load_robot("yaw16")
MOST_RAD_S = 0.9 * ROBOT.joint_speed_limit_rad_s
MOST_RAD_S2 = 0.9 * ROBOT.joint_acceleration_limit_rad_s2
PLAYED_S = 0.002
BEGIN_S = 7.0
"""Time of the first row."""
NOWHERE = BodyView(np.zeros((17, 3)), np.tile(np.eye(3), (17, 1, 1)), np.zeros(3))


SHARES = 0.4 * np.cos(0.4 * np.arange(ROBOT.joint_count))
"""Share of the second harmonic in each joint's wave."""


def wave(amplitude_rad: float, rad_s: float, half_waves: int) -> tuple[np.ndarray, np.ndarray]:
    """Rows of two harmonics, which have no acceleration at both ends; odd joints stay at 0."""
    phase = np.linspace(0.0, np.pi * half_waves, 40 * half_waves + 41)
    angles = amplitude_rad * shape(phase) * (np.arange(ROBOT.joint_count) % 2 == 0)
    return BEGIN_S + phase / rad_s, angles


def shape(phase: np.ndarray) -> np.ndarray:
    return np.sin(phase)[:, None] + np.sin(2.0 * phase)[:, None] * SHARES


def line(robot: RobotConfig, rad: float, seconds: float) -> Recorded:
    """All joints from 0 to ``rad`` at a constant speed."""
    time_s = BEGIN_S + np.linspace(0.0, seconds, 40)
    shares = np.linspace(0.0, 1.0, 40)
    return Recorded(robot, time_s, np.outer(rad * shares, np.ones(robot.joint_count)))


def played(recording: Recorded) -> Iterator[np.ndarray]:
    """Goals at 0, then after each step; the last step ends with the recording."""
    yield recording.goal_rad()
    while not recording.done:
        yield recording.step(PLAYED_S, NOWHERE)


@pytest.mark.parametrize(
    ("amplitude_rad", "rad_s", "half_waves"),
    [(0.4, 2.0, 4), (0.4, 20.0, 12), (0.01, 80.0, 60), (0.4, 6.0, 1)],
)
def test_the_pace_is_that_of_the_played_goals(
    amplitude_rad: float, rad_s: float, half_waves: int
) -> None:
    recording = Recorded(ROBOT, *wave(amplitude_rad, rad_s, half_waves))
    goals = np.array([*played(recording)])[:-1]
    speed = np.abs(np.diff(goals, axis=0)).max(axis=0) / PLAYED_S
    acceleration = np.abs(np.diff(goals, 2, axis=0)).max(axis=0) / PLAYED_S**2
    pace = recording.pace()
    if half_waves > 1:  # else it is never at its full rate
        np.testing.assert_allclose(speed, pace.speed_rad_s, rtol=0.01)
    assert (speed <= 1.001 * pace.speed_rad_s).all()
    np.testing.assert_allclose(acceleration, pace.acceleration_rad_s2, rtol=0.01)
    assert (pace.speed_rad_s <= MOST_RAD_S * (1.0 + 1e-9)).all()
    assert (pace.acceleration_rad_s2 <= MOST_RAD_S2 * (1.0 + 1e-6)).all()


@pytest.mark.parametrize(
    ("amplitude_rad", "rad_s", "half_waves"), [(0.4, 2.0, 4), (0.4, 20.0, 12), (0.01, 80.0, 60)]
)
def test_a_recording_is_slowed_by_its_speed_or_by_its_acceleration(
    amplitude_rad: float, rad_s: float, half_waves: int
) -> None:
    phase = np.linspace(0.0, 2.0 * np.pi, 2000)
    unit = shape(phase)[:, ::2]
    rise = np.abs(np.gradient(unit, phase, axis=0)).max()
    bend = np.abs(np.gradient(np.gradient(unit, phase, axis=0), phase, axis=0)).max()
    fast = amplitude_rad * rad_s * rise / MOST_RAD_S
    hard = amplitude_rad * rad_s**2 * bend / MOST_RAD_S2
    recording = Recorded(ROBOT, *wave(amplitude_rad, rad_s, half_waves))
    slowed = max(1.0, fast, np.sqrt(hard))
    assert recording.slowed == pytest.approx(slowed, rel=2e-3)
    length_s = half_waves * np.pi / rad_s
    assert recording.duration_s == pytest.approx(length_s * recording.slowed + RAMP_S)


@pytest.mark.parametrize("rad_s", [2.0, 20.0])
def test_between_the_ramps_time_passes_evenly_and_speeds_are_slopes(rad_s: float) -> None:
    _, joints = rows = wave(0.4, rad_s, int(rad_s) + 3)
    recording = Recorded(ROBOT, *rows)
    goals = [recording.goal_rad()]
    slopes = [recording.velocity_rad_s()]
    while not recording.done:
        goals.append(recording.step(PLAYED_S, NOWHERE))
        slopes.append(recording.velocity_rad_s())
    np.testing.assert_allclose(goals[0], joints[0], atol=1e-12)
    np.testing.assert_allclose(goals[-1], joints[-1], atol=1e-12)
    np.testing.assert_allclose(slopes[0], 0.0, atol=1e-12)
    np.testing.assert_allclose(slopes[-1], 0.0, atol=1e-12)
    moves = 0.5 * PLAYED_S * (np.array(slopes[1:-1]) + slopes[:-2])  # the last step is shorter
    np.testing.assert_allclose(np.diff(goals[:-1], axis=0), moves, atol=2e-7)
    # a ramp takes half as much from the recording as it lasts
    now_s = PLAYED_S * np.arange(len(goals))
    is_even = (now_s > RAMP_S) & (now_s < recording.duration_s - RAMP_S)
    phase = rad_s * (now_s[is_even] - 0.5 * RAMP_S) / recording.slowed
    expected = 0.4 * shape(phase)[:, ::2]
    np.testing.assert_allclose(np.array(goals)[is_even][:, ::2], expected, atol=1e-4)


@pytest.mark.parametrize("most_rad_s2", [25.0, 1.0, 0.5, 0.2])
@pytest.mark.parametrize("seconds", [0.2, 0.4, 1.0, 3.0])
def test_ramps_grow_up_to_the_length_before_a_recording_is_slowed(
    seconds: float, most_rad_s2: float
) -> None:
    """A quintic ramp to a speed accelerates by 15/8 of speed over time."""
    robot = RobotConfig(name="calm", joint_axes="yyy", joint_acceleration_limit_rad_s2=most_rad_s2)
    rad = 0.6
    recording = line(robot, rad, seconds)
    slowed = max(1.0, rad / seconds / (0.9 * robot.joint_speed_limit_rad_s))
    length_s = slowed * seconds
    ramp_s = recording.duration_s - seconds * recording.slowed
    speed = rad / (seconds * recording.slowed)
    assert recording.pace().speed_rad_s == pytest.approx(speed, rel=1e-6)
    most = recording.pace().acceleration_rad_s2
    assert most == pytest.approx(1.875 * speed / ramp_s, rel=1e-3)
    assert (most <= 0.9 * most_rad_s2 * (1.0 + 1e-6)).all()
    least_s = 1.875 * rad / length_s / (0.9 * most_rad_s2)
    if least_s <= min(RAMP_S, length_s):
        assert recording.slowed == pytest.approx(slowed)
        assert ramp_s == pytest.approx(min(RAMP_S, length_s))
    elif least_s <= length_s:
        assert recording.slowed == pytest.approx(slowed)
        assert least_s <= ramp_s <= min(1.2 * least_s, length_s + 1e-9)
    else:  # the shortest that fits has ramps alone
        shortest_s = np.sqrt(1.875 * rad / (0.9 * most_rad_s2))
        assert shortest_s <= seconds * recording.slowed <= 1.06 * shortest_s
        assert shortest_s / 1.06 <= ramp_s <= seconds * recording.slowed + 1e-9


def test_a_bad_recording_is_refused() -> None:
    time_s, joints = wave(0.4, 2.0, 4)
    for count, rows in ((len(time_s), joints[:, :3]), (len(time_s), joints[1:]), (1, joints[:1])):
        with pytest.raises(InputError, match="16 joints, and two times are the least"):
            Recorded(ROBOT, time_s[:count], rows)
    for times in (time_s[::-1], np.sort([*time_s[1:], time_s[3]])):
        with pytest.raises(InputError, match="must grow"):
            Recorded(ROBOT, times, joints)


def test_the_joint_that_bends_farthest_beyond_its_limit_is_named() -> None:
    time_s, joints = wave(0.4, 2.0, 5)
    bump = np.exp(-(((np.arange(len(time_s)) - 80) / 20.0) ** 2))
    joints[:, 3] = 3.0 * bump
    joints[:, 5] = -6.3 * np.roll(bump, 50)
    said = (
        rf"{re.escape(ROBOT.joint_label(5))} bends to 6\.30 rad in frame 130; its limit is "
        rf"{ROBOT.limit_rad[5]:.2f}.*--scale 0\.23"  # 1.5 of 6.3 is 0.238
    )
    with pytest.raises(InputError, match=said):
        Recorded(ROBOT, time_s, joints)
    joints[:, 3] = joints[:, 5] = 1.5 * bump
    Recorded(ROBOT, time_s, joints)  # at the limit itself


@pytest.mark.parametrize("axis", ["y", "p", ""])
def test_a_recording_needs_the_joints_that_it_moves(axis: str) -> None:
    robot = load_robot("alternating16")
    joints = np.zeros((50, robot.joint_count))
    if axis:  # one joint, in one frame
        joints[20, robot.joint_axes.rindex(axis)] = 0.1
    needs = Recorded(robot, 0.1 * np.arange(50), joints).needs
    assert (needs.yaw, needs.pitch) == (axis == "y", axis == "p")
