"""A joint that does not follow is noticed; one that lags honestly, or is held off, is not."""

from dataclasses import replace

import numpy as np
import pytest

from snakewalk.config.loader import load_robot
from snakewalk.config.robot import RobotConfig, ServoConfig
from snakewalk.config.run import SafetyConfig
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.errors import SafetyTrippedError
from snakewalk.drivers.safety.following_error import IDLE_TIME_S, LONGEST_STEP_S, FollowingError
from snakewalk.drivers.safety.limits import SafetyLimits
from snakewalk.drivers.safety.safe_link import SafeLink
from snakewalk.drivers.types import JointCommand
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant
from tests.drivers.safety.test_safety_vet import LIMITS, J, one, state

PERIOD_S = 0.02


def run(errors: list[float], joint: int = 0, amps: float = 0.0, valid: bool = True) -> str | None:
    """First fault of a joint whose goal is ahead of it by each of ``errors``, 0.1 s apart."""
    following = FollowingError(LIMITS)
    for k, error in enumerate(errors):
        found = state(
            time_s=0.1 * k,
            current_a=one(amps, joint),
            valid=np.arange(J) != (joint if not valid else -1),
        )
        fault = following.update(found, one(error, joint))
        if fault is not None:
            return f"{k}: {fault}"
    return None


@pytest.mark.parametrize("joint", range(J))
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_beyond_the_limit_for_the_time_is_a_fault_that_names_the_joint(
    joint: int, sign: float
) -> None:
    assert run([sign * 0.4] * 20, joint) is None
    fault = run([sign * 0.401] * 20, joint)
    assert fault is not None
    assert fault.startswith(f"5: {LIMITS.joint_names[joint]}: 0.40 rad from its goal for 0.50 s")


def test_the_time_begins_anew_when_the_joint_has_caught_up() -> None:
    assert run([0.5] * 5 + [0.3] + [0.5] * 5) is None
    assert run([0.5] * 5 + [0.3] + [0.5] * 6) is not None


def test_a_joint_that_is_not_read_is_not_judged_but_keeps_its_time() -> None:
    assert run([0.5] * 20, valid=False) is None
    following = FollowingError(LIMITS)
    goal = one(0.5, 1)
    assert following.update(state(time_s=0.0), goal) is None
    unread = state(time_s=0.3, valid=np.array([True, False, True]))
    assert following.update(unread, np.zeros(J)) is None
    assert following.update(state(time_s=0.5), goal) is not None


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_current_limited_joint_that_pushes_is_held_off_by_the_ground(sign: float) -> None:
    """Joint 2 of the limits is current-limited: 0.05 A towards the goal are effort."""
    assert run([sign * 0.7] * 20, 1, sign * 0.05) is None
    assert run([sign * 0.7] * 20, 1, sign * 0.049) is not None
    assert run([sign * 0.7] * 20, 1, -sign * 0.1) is not None  # away from the goal is no effort
    assert run([sign * 0.7] * 20, 0, sign * 1.9) is not None  # an unlimited one has no excuse


def test_the_joint_that_has_not_followed_for_longest_is_named() -> None:
    following = FollowingError(LIMITS)
    late, both = one(0.5, 2), np.array([0.5, 0.0, 0.5])
    assert following.update(state(time_s=0.0), late) is None
    assert following.update(state(time_s=0.2), both) is None
    fault = following.update(state(time_s=0.5), both)
    assert fault is not None
    assert fault.startswith(LIMITS.joint_names[2])
    following.reset()
    assert following.update(state(time_s=0.6), both) is None


@pytest.mark.parametrize("later_s", [0.0, 0.2])
def test_of_two_joints_the_first_is_named_unless_the_other_has_not_followed_for_longer(
    later_s: float,
) -> None:
    following = FollowingError(LIMITS)
    early = np.array([0.5, 0.0, 0.5 if later_s == 0.0 else 0.0])
    both = np.array([0.5, 0.0, 0.5])
    assert following.update(state(time_s=0.0), early) is None
    assert following.update(state(time_s=0.2), both) is None
    fault = following.update(state(time_s=0.5), both)
    assert fault is not None
    assert fault.startswith(LIMITS.joint_names[0])


def test_the_error_that_is_told_is_from_where_the_joint_is() -> None:
    following = FollowingError(LIMITS)
    for time_s in (0.0, 0.5):
        fault = following.update(state(time_s=time_s, position_rad=one(0.3, 1)), one(0.9, 1))
    assert fault is not None
    assert fault.startswith(f"{LIMITS.joint_names[1]}: 0.60 rad from its goal")


def test_limits_leave_room_for_the_lag_of_the_p_gain_and_stay_within_the_lead() -> None:
    """At P gain 800 full output comes at 0.217 rad (e-manual: PWM 885, gain over 128)."""
    usual = SafetyLimits.from_config(load_robot("alternating16"), SafetyConfig())
    assert usual.following_limit_rad[:2] == pytest.approx([0.4345, 0.4], abs=1e-3)
    assert usual.following_effort_a[:2].tolist() == [np.inf, pytest.approx(0.05)]
    soft = RobotConfig(name="soft", joint_axes="yp", servo=ServoConfig(position_p_gain=200))
    wide = SafetyLimits.from_config(soft, SafetyConfig())
    assert wide.following_limit_rad.tolist() == pytest.approx([0.72, 0.4])
    gentle = SafetyLimits.from_config(soft, SafetyConfig(goal_lead_rad=0.4))
    assert gentle.following_limit_rad.tolist() == pytest.approx([0.36, 0.36])


ROBOT = RobotConfig(name="four", joint_axes="ypyp")


def swing(
    change: str | None, joint: int, seconds: float = 4.0, amplitude_rad: float = 0.8
) -> SafeLink:
    """Swing all joints; after a second something happens to one of them."""
    line = SimLine(ServoBank(ROBOT.servo_ids), BenchPlant(4))
    clock = line.clock
    limits = SafetyLimits.from_config(ROBOT, SafetyConfig())
    link = SafeLink(ServoChain(DynamixelBus(line), ROBOT), limits, clock)
    link.enable()
    start_s = clock.now_s()
    for k in range(int(seconds / PERIOD_S)):
        clock.sleep_until_s(start_s + k * PERIOD_S)
        if k == 50 and change == "stuck":
            line.firmware.block_shafts(np.array([joint]))
        if k == 50 and change == "limp":
            line.settle()
            line.firmware.cut_output(np.array([joint]), on=True)  # its registers do not show it
        try:
            link.read()
            goal = np.sin(2.0 * (clock.now_s() - start_s) + np.arange(4)) - np.sin(np.arange(4))
            link.write(JointCommand(clock.now_s(), amplitude_rad * goal))
        except SafetyTrippedError:
            break
    return link


def test_a_swing_within_the_plan_follows() -> None:
    assert swing(None, 0).tripped is None


@pytest.mark.fast_cases(3)
@pytest.mark.parametrize("joint", [0, 1])
@pytest.mark.parametrize("amplitude_rad", [0.8, 0.36, 0.15])
def test_a_joint_without_power_behind_healthy_registers_stops_the_run(
    joint: int, amplitude_rad: float
) -> None:
    """At 0.36 rad and below it was silent: the error stays under the limit of 0.4 rad."""
    tripped = swing("limp", joint, amplitude_rad=amplitude_rad).tripped
    assert tripped is not None
    assert ("joint yaw_01 (ID 1)", "joint pitch_02 (ID 2)")[joint] in tripped
    assert "its motor does not push" in tripped


def test_a_blocked_joint_stops_the_run() -> None:
    assert "joint yaw_01 (ID 1)" in str(swing("stuck", 0).tripped)


STALL_A, LIMIT_A = 2.0, 0.1
JUDGED = replace(
    LIMITS,
    output=np.array([[5.0] * J, [STALL_A] * J, [np.inf, LIMIT_A, np.inf]]),
)
"""Full output at an error of 0.2 rad; joint 2 is current-limited."""


def idle(
    error_rad: float,
    amps: float,
    *,
    joint: int = 0,
    speed_rad_s: float = 0.0,
    moved_rad_s: float = 0.0,
    seconds: float = 0.4,
    following: FollowingError | None = None,
    start_s: float = 0.0,
    step_s: float = 2.0**-6,
) -> float | None:
    """Time after which a joint, held at an error with a current, is a fault; None if never."""
    following = following or FollowingError(JUDGED)
    for k in range(round(seconds / step_s) + 1):
        position_rad = moved_rad_s * k * step_s
        found = state(
            time_s=start_s + k * step_s,
            position_rad=one(position_rad, joint),
            current_a=one(amps, joint),
            velocity_rad_s=one(speed_rad_s, joint),
        )
        fault = following.update(found, one(position_rad + error_rad, joint))
        if fault is not None:
            assert fault.startswith(JUDGED.joint_names[joint])
            assert "its motor does not push" in fault
            return k * step_s
    return None


@pytest.mark.parametrize("sign", [-1.0, 1.0])
@pytest.mark.parametrize("joint", range(J))
def test_a_motor_that_draws_no_current_off_its_goal_is_a_fault_after_its_time(
    joint: int, sign: float
) -> None:
    found_s = idle(sign * 0.1, 0.0, joint=joint)
    assert found_s is not None
    assert IDLE_TIME_S <= found_s < IDLE_TIME_S + 2.0**-6


@pytest.mark.parametrize(
    ("joint", "error_rad", "is_judged"),
    [(0, 0.05, True), (0, 0.0499, False), (1, 0.05, True), (1, 0.0499, False)],
)
def test_the_error_must_be_worth_a_share_of_full_output(
    joint: int, error_rad: float, *, is_judged: bool
) -> None:
    assert (idle(error_rad, 0.0, joint=joint) is not None) == is_judged


@pytest.mark.parametrize("sign", [-1.0, 1.0])
@pytest.mark.parametrize(
    ("joint", "error_rad", "least_a"),
    [(0, 0.1, 0.1), (0, 0.3, 0.2), (1, 0.1, 0.01), (1, 0.3, 0.01)],
)
def test_a_tenth_of_the_expected_current_towards_the_goal_shows_that_it_works(
    joint: int, error_rad: float, least_a: float, sign: float
) -> None:
    assert idle(sign * error_rad, sign * (least_a + 1e-9), joint=joint) is None
    assert idle(sign * error_rad, sign * (least_a - 1e-9), joint=joint) is not None
    assert idle(sign * error_rad, -sign * least_a, joint=joint) is not None  # the wrong way


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_joint_that_turns_towards_its_goal_may_draw_no_current(sign: float) -> None:
    """The motor's own voltage takes the output up."""
    assert idle(sign * 0.1, 0.0, speed_rad_s=sign * 0.3, moved_rad_s=sign * 0.31) is None
    assert idle(sign * 0.1, 0.0, speed_rad_s=sign * 0.299, moved_rad_s=sign * 0.31) is not None
    assert idle(sign * 0.1, 0.0, speed_rad_s=-sign * 2.0) is not None


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_dead_velocity_sensor_does_not_hide_a_motor_without_current(sign: float) -> None:
    """A velocity that always read 2.4 rad/s hid a dead output stage for the whole run."""
    assert idle(sign * 0.1, 0.0, speed_rad_s=sign * 2.4) is not None
    assert idle(sign * 0.1, 0.0, speed_rad_s=sign * 2.4, moved_rad_s=sign * 0.29) is not None


def test_the_time_without_current_adds_up_between_errors_that_show_nothing() -> None:
    following = FollowingError(JUDGED)
    assert idle(0.1, 0.0, seconds=0.2, following=following) is None
    assert idle(0.019, 1.0, seconds=1.0, following=following, start_s=0.2) is None
    assert idle(0.1, 0.0, seconds=0.2, following=following, start_s=1.2) is not None


@pytest.mark.parametrize("way", ["current", "reset"])
def test_the_time_without_current_begins_again(way: str) -> None:
    following = FollowingError(JUDGED)
    assert idle(0.1, 0.0, seconds=0.25, following=following) is None
    if way == "reset":
        following.reset()
    else:  # at a tenth of full output a current is evidence
        assert idle(0.021, 0.022, seconds=0.0, following=following, start_s=0.25) is None
    assert idle(0.1, 0.0, seconds=0.25, following=following, start_s=0.26) is None


def test_a_pause_counts_for_little_and_a_clock_that_runs_back_not_at_all() -> None:
    steps = 1 + round(IDLE_TIME_S / LONGEST_STEP_S + 0.5)
    following = FollowingError(JUDGED)
    faults = [
        following.update(state(time_s=10.0 * k), one(0.1, 0)) is not None for k in range(steps)
    ]
    assert faults[-1]
    assert not any(faults[:3])
    back = FollowingError(JUDGED)
    assert not any(back.update(state(time_s=-10.0 * k), one(0.1, 0)) for k in range(20))


def test_a_joint_that_is_not_read_shows_nothing_about_its_motor() -> None:
    following = FollowingError(JUDGED)
    for k in range(40):
        unread = state(time_s=0.1 * k, valid=np.zeros(J, np.bool_))
        assert following.update(unread, one(0.1, 0)) is None


def test_the_first_motor_without_current_is_named_before_a_joint_that_does_not_follow() -> None:
    following = FollowingError(JUDGED)
    amps = np.array([1.9, 0.0, 0.0])
    faults = [
        following.update(state(time_s=0.1 * k, current_a=amps), np.array([0.5, 0.1, 0.1]))
        for k in range(8)
    ]
    assert faults[:3] == [None] * 3
    assert str(faults[3]).startswith(JUDGED.joint_names[1])
    assert "0.10 rad from its goal with 0.00 A, expected about 0.10 A" in str(faults[3])


def test_a_motor_that_does_not_push_is_told_from_a_joint_that_does_not_follow() -> None:
    following = FollowingError(JUDGED)
    assert not following.is_idle
    assert idle(0.1, 0.0, following=following) is not None
    assert following.is_idle
    following = FollowingError(JUDGED)
    following._idle_s[1] = IDLE_TIME_S  # the limit itself
    assert following.update(state(), np.zeros(J)) is not None
    assert following.is_idle
    following = FollowingError(LIMITS)
    for k in range(8):
        fault = following.update(state(time_s=0.1 * k), one(0.5, 0))
    assert fault is not None
    assert not following.is_idle


def test_the_output_of_a_robots_motors_is_that_of_their_models() -> None:
    limits = SafetyLimits.from_config(load_robot("alternating16"), SafetyConfig())
    assert limits.output is not None
    assert limits.output[:, 0] == pytest.approx([1 / 0.2172, 2.3, np.inf], rel=1e-3)
    assert limits.output[:, 1] == pytest.approx([0.5 / 0.2172, 2.3, 0.1], rel=1e-3)
    weak = RobotConfig(name="weak", joint_axes="yp", servo=ServoConfig(pitch_current_limit_a=0.049))
    found = SafetyLimits.from_config(weak, SafetyConfig()).output
    assert found is not None
    assert (found[0] > 0.0).tolist() == [True, False]


def test_a_dead_stage_is_told_from_a_sensor_that_dies_under_a_load() -> None:
    """Without its motor a joint falls behind; with a dead sensor it stays where it was."""
    for before_rad, is_named in ((0.03, True), (0.1, False)):
        following = FollowingError(JUDGED)
        said = None
        for k in range(40):
            error_rad, amps = (before_rad, 0.3) if k < 5 else (0.1, 0.0)
            seen = state(time_s=0.02 * k, current_a=one(amps, 0))
            said = said or following.update(seen, one(error_rad, 0))
        assert "does not push: dead output stage" in str(said)
        assert ("else a dead current sensor" not in str(said)) == is_named
