"""The safety vetting, densely around every limit."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from snakewalk.config.loader import load_robot
from snakewalk.config.robot import RobotConfig, ServoConfig
from snakewalk.config.run import SafetyConfig
from snakewalk.drivers.protocol.packet import ALERT
from snakewalk.drivers.protocol.registers import Alarm
from snakewalk.drivers.safety.limits import SafetyLimits
from snakewalk.drivers.safety.vet import (
    SafetyMemory,
    Verdict,
    overloaded_joint,
    vet,
    without_alarm,
)
from snakewalk.drivers.types import JointCommand, JointState

J = 3
LIMITS = SafetyLimits(
    joint_names=("joint yaw_01 (ID 7)", "joint yaw_02 (ID 8)", "joint yaw_03 (ID 9)"),
    limit_rad=np.array([1.5, 1.2, 1.5]),
    limit_slack_rad=0.2,
    goal_rate_rad_s=4.0,
    goal_lead_rad=0.8,
    current_limit_a=2.0,
    current_time_s=0.5,
    temperature_limit_c=70.0,
    voltage_min_v=10.0,
    voltage_max_v=14.8,
    voltage_time_s=0.3,
    stale_limit_s=0.1,
    slow_stale_limit_s=3.0,
    following_limit_rad=np.array([0.4, 0.4, 0.4]),
    following_effort_a=np.array([np.inf, 0.05, np.inf]),
    following_time_s=0.5,
    step_rate_rad_s=8.0,
)
NOW = 100.0
DT = 2.0**-6
"""Cycle time, s; a power of two, so that the rate's edge is met exactly."""
TINY = 1e-9
OFFSETS = (-1e-3, -TINY, 0.0, TINY, 1e-3)


def state(**changes: object) -> JointState:
    calm = JointState(
        time_s=NOW,
        position_rad=np.zeros(J),
        velocity_rad_s=np.zeros(J),
        current_a=np.zeros(J),
        temperature_c=np.full(J, 40.0),
        voltage_v=np.full(J, 12.0),
        hardware_error=np.zeros(J, np.uint8),
        error=np.zeros(J, np.uint8),
        age_s=np.zeros(J),
        valid=np.ones(J, np.bool_),
        slow_age_s=np.zeros(J),
    )
    return calm._replace(**changes)  # type: ignore[arg-type]


def memory(goal: float = 0.0, dt_s: float = DT) -> SafetyMemory:
    held = state(time_s=NOW - dt_s, position_rad=np.full(J, goal))
    return SafetyMemory.at_rest(held)


def vetted(
    goal: object = 0.0,
    now: JointState | None = None,
    last: SafetyMemory | None = None,
    now_s: float = NOW,
) -> Verdict:
    goals = np.broadcast_to(np.asarray(goal, float), J).copy()
    return vet(JointCommand(NOW, goals), now or state(), last or memory(), LIMITS, now_s)


def one(value: float, joint: int, others: float = 0.0) -> np.ndarray:
    values = np.full(J, others)
    values[joint] = value
    return values


@pytest.mark.parametrize("joint", range(J))
@pytest.mark.parametrize("sign", [-1, 1])
@pytest.mark.parametrize("offset", OFFSETS)
class TestClampsAtTheirBoundary:
    def test_rate(self, joint: int, sign: int, offset: float) -> None:
        step = 4.0 * DT
        verdict = vetted(one(sign * (step + offset), joint))
        assert verdict.veto is None
        assert verdict.goal_rad[joint] == pytest.approx(sign * (step + min(offset, 0)), abs=1e-15)
        assert verdict.clamped[joint] == (offset > 0)
        assert not np.delete(verdict.clamped, joint).any()

    def test_lead(self, joint: int, sign: int, offset: float) -> None:
        goal = sign * (0.8 + offset)
        verdict = vetted(one(goal, joint), last=memory()._replace(goal_rad=one(goal, joint)))
        assert verdict.veto is None
        assert verdict.goal_rad[joint] == pytest.approx(sign * (0.8 + min(offset, 0)), abs=1e-15)
        assert verdict.clamped[joint] == (offset > 0)

    def test_joint_limit(self, joint: int, sign: int, offset: float) -> None:
        limit = LIMITS.limit_rad[joint]
        goal = one(sign * (limit + offset), joint)
        there = state(position_rad=one(sign * limit, joint))
        verdict = vetted(goal, there, memory()._replace(goal_rad=goal))
        assert verdict.veto is None
        assert verdict.goal_rad[joint] == sign * (limit + min(offset, 0))
        assert verdict.clamped[joint] == (offset > 0)


def vetoed(now: JointState) -> bool:
    verdict = vetted(0.05, now)
    if verdict.veto is not None:
        assert (verdict.goal_rad == 0.0).all()  # the last goals, not the new ones
        assert verdict.memory.time_s == NOW - DT
    return verdict.veto is not None


@pytest.mark.parametrize("joint", range(J))
@pytest.mark.parametrize("offset", OFFSETS)
class TestVetoesAtTheirBoundary:
    def test_measured_beyond_its_limit(self, joint: int, offset: float) -> None:
        for sign in (-1, 1):
            angle = sign * (LIMITS.limit_rad[joint] + 0.2 + offset)
            assert vetoed(state(position_rad=one(angle, joint))) == (offset > 0)

    def test_temperature(self, joint: int, offset: float) -> None:
        assert vetoed(state(temperature_c=one(70.0 + offset, joint, 40.0))) == (offset > 0)

    def test_voltage(self, joint: int, offset: float) -> None:
        assert vetoed(state(voltage_v=one(14.8 + offset, joint, 12.0))) == (offset > 0)

    def test_low_voltage_over_time(self, joint: int, offset: float) -> None:
        low = state(voltage_v=one(9.9, joint, 12.0), slow_age_s=np.full(J, 0.25))
        last = memory()._replace(under_voltage_since_s=one(NOW - 0.55 - offset, joint, np.nan))
        if offset != 0:  # at the edge itself rounding decides
            assert (vetted(now=low, last=last).veto is not None) == (offset > 0)

    def test_voltage_at_its_lower_limit(self, joint: int, offset: float) -> None:
        now = state(voltage_v=one(10.0 + offset, joint, 12.0), slow_age_s=np.full(J, 0.25))
        verdict = vetted(now=now)
        assert verdict.veto is None
        since = verdict.memory.under_voltage_since_s
        assert (since[joint] == NOW - 0.25) == (offset < 0)
        assert np.isnan(np.delete(since, joint)).all()

    def test_stale_state(self, joint: int, offset: float) -> None:
        assert vetoed(state(age_s=one(0.1 + offset, joint))) == (offset > 0)

    def test_stale_temperature_and_voltage(self, joint: int, offset: float) -> None:
        assert vetoed(state(slow_age_s=one(3.0 + offset, joint))) == (offset > 0)

    def test_state_that_aged_since_it_was_read(self, joint: int, offset: float) -> None:
        old = state(age_s=one(0.04, joint), time_s=NOW - 0.06 - offset)
        if offset != 0:  # at the edge itself rounding decides
            assert (vetted(now=old).veto is not None) == (offset > 0)

    def test_current_over_time(self, joint: int, offset: float) -> None:
        hot = state(current_a=one(-3.0, joint))
        last = memory()._replace(over_current_since_s=one(NOW - 0.5 - offset, joint, np.nan))
        verdict = vetted(now=hot, last=last)
        assert (verdict.veto is not None) == (offset >= 0)

    def test_current_at_its_limit(self, joint: int, offset: float) -> None:
        for sign in (-1, 1):
            now = state(current_a=one(sign * (2.0 + offset), joint))
            since = vetted(now=now).memory.over_current_since_s
            assert (since[joint] == NOW) == (offset > 0)
            assert np.isnan(np.delete(since, joint)).all()


def run_currents(currents: list[float], valid: list[bool], dt_s: float = 0.1) -> int | None:
    """Index of the first veto of joint 0, fed with readings ``dt_s`` apart."""
    last = SafetyMemory(0.0, np.zeros(J), *np.full((2, J), np.nan))
    for k, (amps, ok) in enumerate(zip(currents, valid, strict=True)):
        now = state(
            time_s=k * dt_s, current_a=one(amps, 0), valid=np.array([ok, True, True])
        )  # fmt: skip
        verdict = vet(JointCommand(k * dt_s, np.zeros(J)), now, last, LIMITS, k * dt_s)
        if verdict.veto is not None:
            assert "joint yaw_01 (ID 7)" in verdict.veto
            return k
        last = verdict.memory
    return None


def test_over_current_counts_only_while_it_lasts() -> None:
    assert run_currents([3.0] * 10, [True] * 10) == 5
    assert run_currents([3.0, 3.0, 3.0, 1.0] * 5, [True] * 20) is None
    # what was not read is not an all-clear: the time goes on at the next reading
    assert run_currents([3.0] * 10, [True, True] + [False] * 5 + [True] * 3) == 5


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("joint", range(J))
def test_what_is_not_a_number_is_vetoed(bad: float, joint: int) -> None:
    verdict = vetted(one(bad, joint))
    assert verdict.veto == f"{LIMITS.joint_names[joint]}: commanded {bad}: not a number"
    assert (verdict.goal_rad == 0.0).all()
    for name in ("position_rad", "velocity_rad_s", "current_a", "age_s", "slow_age_s"):
        assert vetted(now=state(**{name: one(bad, joint)})).veto is not None or (
            name in ("age_s", "slow_age_s") and bad == -np.inf
        )


def test_a_command_for_another_robot_is_vetoed() -> None:
    verdict = vet(JointCommand(NOW, np.zeros(J + 1)), state(), memory(), LIMITS, NOW)
    assert verdict.veto == f"command of shape ({J + 1},) for {J} joints"


@pytest.mark.parametrize("bit", range(8))
def test_every_hardware_error_is_vetoed(bit: int) -> None:
    errors = np.array([0, 1 << bit, 0], np.uint8)
    assert vetted(now=state(hardware_error=errors)).veto is not None
    alert = vetted(now=state(error=np.array([0, 0, 0x80], np.uint8)))
    assert alert.veto == (
        "joint yaw_03 (ID 9): alarm: the alert bit is set, but no alarm was read from "
        "Hardware Error Status"
    )


def test_the_veto_names_the_alarm() -> None:
    errors = np.array([0, 0x24, 0], np.uint8)
    assert vetted(now=state(hardware_error=errors)).veto == (
        "joint yaw_02 (ID 8): alarm: overheating, overload"
    )


@pytest.mark.parametrize("code", range(1, 8))
def test_a_refused_read_alone_is_no_veto(code: int) -> None:
    assert vetted(now=state(error=np.array([code, 0, 0], np.uint8))).veto is None


def test_what_was_not_read_yet_is_no_reason() -> None:
    unread = np.full(J, np.nan)
    never = np.full(J, np.inf)
    now = state(temperature_c=unread, voltage_v=unread, slow_age_s=never)
    assert vetted(now=now).veto is None


angles = st.floats(-3.0, 3.0)
three = st.lists(angles, min_size=J, max_size=J).map(np.array)


@given(three, three, three, st.floats(0.0, 5.0))
def test_what_passes_keeps_all_promises(
    goal: np.ndarray, last_goal: np.ndarray, share: np.ndarray, dt_s: float
) -> None:
    measured = share / 3.0 * (LIMITS.limit_rad + 0.2)
    held = np.clip(last_goal, -LIMITS.limit_rad, LIMITS.limit_rad)
    last = SafetyMemory(NOW - dt_s, held, *np.full((2, J), np.nan))
    verdict = vetted(goal, state(position_rad=measured), last)
    assert verdict.veto is None
    passed = verdict.goal_rad
    assert (np.abs(passed) <= LIMITS.limit_rad).all()
    step = 4.0 * min(dt_s, 0.1)
    assert (np.abs(passed - held) <= step + 1e-12).all()
    # farther ahead than the lead only where the rate lets the goal come no nearer to the joint
    nearest = np.maximum(np.abs(held - measured) - step, 0.8)
    assert (np.abs(passed - measured) <= nearest + 1e-9).all()
    assert (verdict.clamped == (passed != goal)).all()
    assert (verdict.memory.goal_rad == passed).all()


@given(three)
def test_a_vetted_goal_passes_unchanged_when_asked_again(goal: np.ndarray) -> None:
    first = vetted(goal)
    again = vet(JointCommand(NOW, first.goal_rad), state(), first.memory, LIMITS, NOW)
    assert not again.clamped.any()


def test_a_wrong_answer_moves_no_goal_faster_than_the_rate() -> None:
    """The lead won over the rate: a forged angle moved a goal by 0.77 rad in one cycle."""
    forged = state(position_rad=np.full(J, -1.1))
    verdict = vetted(0.45, forged, memory(0.45))
    assert np.abs(verdict.goal_rad - 0.45) == pytest.approx(np.full(J, 4.0 * DT))


def test_a_pause_gives_no_allowance_for_a_jump() -> None:
    verdict = vetted(1.0, state(position_rad=np.full(J, 0.9)), memory(dt_s=60.0))
    assert verdict.goal_rad == pytest.approx(np.full(J, 4.0 * 0.1))


def test_limits_come_from_the_files() -> None:
    limits = SafetyLimits.from_config(load_robot("alternating16"), SafetyConfig())
    assert limits.limit_rad[:2].tolist() == [1.5, 1.2]
    assert (limits.goal_rate_rad_s, limits.stale_limit_s) == (4.0, 0.1)


def test_supply_limits_are_those_of_the_robot_unless_the_run_gives_its_own() -> None:
    """A robot on 5 V stopped at its first cycle: 10 V were the limit of every run."""
    small = RobotConfig(
        name="small", joint_axes="yy", servo=ServoConfig(model="XL330-M288", supply_v=5.0)
    )
    limits = SafetyLimits.from_config(small, SafetyConfig())
    assert limits.voltage_min_v < 4.5 < 5.5 < limits.voltage_max_v
    own = SafetyLimits.from_config(small, SafetyConfig(voltage_min_v=4.9, voltage_max_v=5.1))
    assert (own.voltage_min_v, own.voltage_max_v) == (4.9, 5.1)
    usual = SafetyLimits.from_config(load_robot("yaw16"), SafetyConfig())
    assert (usual.voltage_min_v, usual.voltage_max_v) == pytest.approx((10.0, 14.8))


def test_a_supply_outside_its_own_limits_is_refused() -> None:
    with pytest.raises(ValueError, match="supply_v = 5 is not within supply_min_v = 10"):
        ServoConfig(supply_v=5.0, supply_min_v=10.0)


def test_the_names_of_a_joint_are_its_place_from_the_head_and_its_id() -> None:
    robot = RobotConfig(name="far", joint_axes="yyy", servo=ServoConfig(first_id=41))
    assert SafetyLimits.from_config(robot, SafetyConfig()).joint_names == (
        "joint yaw_01 (ID 41)",
        "joint yaw_02 (ID 42)",
        "joint yaw_03 (ID 43)",
    )


@pytest.mark.parametrize("joint", range(J))
def test_an_overload_is_a_joint_s_if_it_is_the_only_alarm(joint: int) -> None:
    other = (joint + 1) % J
    none, overload = np.zeros(J, np.uint8), np.zeros(J, np.uint8)
    alert, result = none.copy(), none.copy()
    overload[joint], alert[joint], result[other] = Alarm.OVERLOAD, ALERT, 1
    assert overloaded_joint(state()) is None
    assert overloaded_joint(state(hardware_error=overload)) == joint
    assert overloaded_joint(state(hardware_error=overload, error=alert)) == joint
    assert overloaded_joint(state(hardware_error=overload, error=result)) == joint
    assert overloaded_joint(state(error=alert)) is None
    hot = overload | np.uint8(Alarm.OVERHEATING)
    assert overloaded_joint(state(hardware_error=hot)) is None
    both, alerts = overload.copy(), alert.copy()
    both[other], alerts[other] = Alarm.OVERLOAD, ALERT
    assert overloaded_joint(state(hardware_error=both)) is None
    assert overloaded_joint(state(hardware_error=overload, error=alerts)) is None


def test_without_its_alarm_a_joint_shows_what_else_is_wrong() -> None:
    hardware_error, error = np.full(J, Alarm.OVERLOAD, np.uint8), np.full(J, ALERT | 1, np.uint8)
    before = state(hardware_error=hardware_error, error=error)
    found = without_alarm(before, 1)
    others = [k for k in range(J) if k != 1]
    assert found.hardware_error[1] == 0
    assert found.error[1] == 1
    assert (found.hardware_error[others] == Alarm.OVERLOAD).all()
    assert (found.error[others] == ALERT | 1).all()
    assert (before.hardware_error == Alarm.OVERLOAD).all()
    assert (before.error == ALERT | 1).all()
