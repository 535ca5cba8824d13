"""A joint that does not follow is noticed; one that lags honestly, or is held off, is not."""

import numpy as np
import pytest

from snakewalk.config.loader import load_robot
from snakewalk.config.robot import RobotConfig, ServoConfig
from snakewalk.config.run import SafetyConfig
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.errors import SafetyTrippedError
from snakewalk.drivers.safety.following_error import FollowingError
from snakewalk.drivers.safety.limits import SafetyLimits
from snakewalk.drivers.safety.safe_link import SafeLink
from snakewalk.drivers.types import JointCommand
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant

from .test_safety_vet import LIMITS, J, one, state

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


def swing(change: str | None, joint: int, seconds: float = 4.0) -> SafeLink:
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
            line.firmware.drive.pwm_limit[joint] = 0.0  # its registers do not show it
        try:
            link.read()
            goal = 0.8 * np.sin(2.0 * (clock.now_s() - start_s) + np.arange(4))
            link.write(JointCommand(clock.now_s(), goal - 0.8 * np.sin(np.arange(4))))
        except SafetyTrippedError:
            break
    return link


def test_a_swing_within_the_plan_follows() -> None:
    assert swing(None, 0).tripped is None


@pytest.mark.parametrize("joint", [0, 1])
def test_a_joint_without_power_behind_healthy_registers_stops_the_run(joint: int) -> None:
    tripped = swing("limp", joint).tripped
    assert tripped is not None
    assert ("joint yaw_01 (ID 1)", "joint pitch_02 (ID 2)")[joint] in tripped
    assert "it does not follow" in tripped


def test_a_blocked_joint_stops_the_run() -> None:
    assert "joint yaw_01 (ID 1)" in str(swing("stuck", 0).tripped)
