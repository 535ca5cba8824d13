"""Shape compliance: closed forms, passivity, limits, and what an old current does."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from snakewalk.config.compliance import ComplianceConfig
from snakewalk.config.errors import InputError
from snakewalk.config.loader import checked, load_robot
from snakewalk.config.run import RunConfig, SafetyConfig
from snakewalk.controller.motion.compliance import Compliance, chatters
from snakewalk.controller.run.servo_setup import check_compliance
from snakewalk.drivers.safety.limits import SafetyLimits
from snakewalk.drivers.safety.vet import SafetyMemory, vet
from snakewalk.drivers.types import JointCommand, JointState

ROBOT = load_robot("alternating16")
J = ROBOT.joint_count
PERIOD_S = 0.02
FREE = ComplianceConfig(joints="all", yield_limit_rad=3.0, yield_rate_rad_s=10.0)
currents = st.lists(st.floats(-2.0, 2.0), min_size=1, max_size=40)


def state(current_a: float | np.ndarray, *, valid: bool = True, at_s: float = 0.0) -> JointState:
    return JointState(
        time_s=at_s,
        position_rad=np.zeros(J),
        velocity_rad_s=np.zeros(J),
        current_a=np.zeros(J) + current_a,
        temperature_c=np.full(J, 30.0),
        voltage_v=np.full(J, 12.0),
        hardware_error=np.zeros(J, np.uint8),
        error=np.zeros(J, np.uint8),
        age_s=np.full(J, 0.0 if valid else 0.02),
        valid=np.full(J, valid),
        slow_age_s=np.zeros(J),
    )


def test_at_rest_it_yields_by_current_over_stiffness() -> None:
    config = FREE.model_copy(update={"stiffness_a_rad": 0.8, "deadband_a": 0.1})
    one = Compliance(config, ROBOT)
    for _ in range(2000):
        goal = one.step(np.zeros(J), state(-0.3), PERIOD_S)
    np.testing.assert_allclose(goal, (0.3 - 0.1) / 0.8, rtol=1e-9)  # with the load, not against it


def test_it_goes_there_as_a_spring_and_a_damper_do_at_any_cycle() -> None:
    """``x(t) = I/k (1 - exp(-t k / b))``: the step is exact, so the rate of cycles is no matter."""
    config = FREE.model_copy(update={"stiffness_a_rad": 0.5, "damping_a_s_rad": 0.4})
    for cycles in (10, 200):
        one = Compliance(config, ROBOT)
        for _ in range(cycles):
            goal = one.step(np.zeros(J), state(0.1), 0.6 / cycles)
        np.testing.assert_allclose(goal, -0.2 * (1.0 - math.exp(-0.6 * 0.5 / 0.4)), rtol=1e-9)


@pytest.mark.parametrize("windows", [None, 1, 4])
@pytest.mark.parametrize("deadband_a", [0.0, 0.2])
def test_no_load_changes_no_bit(windows: int | None, deadband_a: float) -> None:
    config = FREE.model_copy(update={"windows": windows, "deadband_a": deadband_a})
    one, goal = Compliance(config, ROBOT), np.linspace(-1.0, 1.0, J)
    for _ in range(5):
        assert one.step(goal, state(deadband_a), PERIOD_S).tobytes() == goal.tobytes()


@given(currents)
@settings(max_examples=60)
def test_it_is_passive(load_a: list[float]) -> None:
    """What the load has put in is never less than what the spring holds, so none comes from it."""
    one, before = Compliance(FREE, ROBOT), np.zeros(J)
    put_in, held = np.zeros(J), np.zeros(J)
    for amps in load_a:
        now = one.step(np.zeros(J), state(-amps), PERIOD_S)
        put_in += amps * (now - before)  # in amperes times radians; the torque constant is a factor
        before, held = now, 0.5 * FREE.stiffness_a_rad * now**2
        assert (put_in >= held - 1e-12).all()


@given(currents, st.floats(-1.2, 1.2))
@settings(max_examples=60)
def test_goals_keep_range_rate_and_greatest_yield(load_a: list[float], goal_rad: float) -> None:
    config = ComplianceConfig(joints="all", stiffness_a_rad=0.1, damping_a_s_rad=0.1)
    one, goal, before = Compliance(config, ROBOT), np.full(J, goal_rad), np.zeros(J)
    for amps in load_a:
        sent = one.step(goal, state(amps), PERIOD_S)
        assert (np.abs(sent) <= np.array(ROBOT.limit_rad) + 1e-12).all()
        assert (np.abs(one.yield_rad) <= config.yield_limit_rad + 1e-12).all()
        assert (np.abs(one.yield_rad - before) <= config.yield_rate_rad_s * PERIOD_S + 1e-12).all()
        before = one.yield_rad


def test_safety_clamps_nothing_of_what_yields() -> None:
    """A motion at the plan's limit of speed and a yield at its own stay below the safety layer."""
    safety, config = SafetyConfig(), ComplianceConfig(joints="all", stiffness_a_rad=0.1)
    limits, one = SafetyLimits.from_config(ROBOT, safety), Compliance(config, ROBOT)
    memory, at = SafetyMemory.at_rest(state(0.0)), np.zeros(J)
    for k in range(1, 20):
        at = at + ROBOT.joint_speed_limit_rad_s * PERIOD_S
        goal = one.step(at, state(-1.0), PERIOD_S)
        now = state(-1.0, at_s=k * PERIOD_S)._replace(position_rad=goal - 0.1)
        found = vet(JointCommand(now.time_s, goal), now, memory, limits, now.time_s)
        assert found.veto is None
        assert not found.clamped.any()
        memory = found.memory


def test_an_old_current_moves_nothing() -> None:
    """A joint whose read failed keeps its yield, however long; the others go on."""
    one = Compliance(FREE, ROBOT)
    for _ in range(5):
        one.step(np.zeros(J), state(-0.2), PERIOD_S)
    held = one.yield_rad.copy()
    lost = state(-2.0)
    lost = lost._replace(valid=np.arange(J) != 3)
    for _ in range(20):
        one.step(np.zeros(J), lost, PERIOD_S)
    assert one.yield_rad[3] == held[3]
    assert (np.delete(one.yield_rad - held, 3) > 0.1).all()


def test_only_the_chosen_joints_yield() -> None:
    for joints, rows in (("yaw", ROBOT.yaw_joints), ("pitch", ROBOT.pitch_joints)):
        one = Compliance(ComplianceConfig(joints=joints), ROBOT)
        one.step(np.zeros(J), state(-1.0), PERIOD_S)
        assert tuple(np.flatnonzero(one.yield_rad)) == rows


def test_windows_scale_bends_and_keep_their_kind() -> None:
    """A load against the bends straightens them; one across a window's shape leaves it alone."""
    config = FREE.model_copy(update={"windows": 2, "stiffness_a_rad": 1.0})
    one, bends = Compliance(config, ROBOT), np.sin(np.arange(J) + 0.5) * 0.6
    first = np.arange(J) < J // 2
    load_a = np.where(first, 0.3 * bends, 0.0)
    for _ in range(500):
        goal = one.step(bends, state(load_a), PERIOD_S)
    share = goal / bends
    square = float((bends[first] ** 2).sum())
    expected = 1.0 - 0.3 * square / (square + 0.1**2)  # the least bend that counts is 0.1 rad
    np.testing.assert_allclose(share[first], expected, rtol=1e-9)
    np.testing.assert_allclose(share[~first], 1.0, rtol=1e-12)
    across = np.where(first, np.cos(np.arange(J)), 0.0)
    across -= bends * first * (across @ bends) / square
    fresh = Compliance(config, ROBOT)
    np.testing.assert_allclose(fresh.step(bends, state(across), PERIOD_S), bends, atol=1e-12)


@pytest.mark.parametrize("gain_a_rad", [2.0, 10.6, 60.0])
def test_a_blocked_shaft_tells_where_it_would_chatter(gain_a_rad: float) -> None:
    """At the least damping the goal comes to rest from one side; at a third, it swings."""
    least_a_s_rad = (gain_a_rad + FREE.stiffness_a_rad) * PERIOD_S
    for damping, calm in ((1.001 * least_a_s_rad, True), (least_a_s_rad / 3.0, False)):
        config = FREE.model_copy(update={"damping_a_s_rad": damping, "yield_limit_rad": 3.0})
        assert (chatters(config, gain_a_rad, PERIOD_S) is None) == calm
        one, goal, errors = Compliance(config, ROBOT), 0.05, []
        rest = 0.05 / (1.0 + gain_a_rad / config.stiffness_a_rad)
        for _ in range(60):
            goal = float(one.step(np.full(J, 0.05), state(gain_a_rad * goal), PERIOD_S)[0])
            errors.append(goal - rest)
        turns = sum(a * b < -1e-18 for a, b in itertools.pairwise(errors))
        assert (turns == 0) == calm


def test_faults_are_refused_before_torque_with_what_would_be_right() -> None:
    def run(**values: float) -> RunConfig:
        fields = {"name": "x", "motion": "source", "compliance": values}
        return checked(RunConfig, fields, "x.toml")

    check_compliance(run(), ROBOT)
    with pytest.raises(InputError, match=r"at most 2") as caught:
        check_compliance(run(yield_rate_rad_s=3.0, damping_a_s_rad=0.01), ROBOT)
    assert len(caught.value.faults) == 2
    assert "chatter" in caught.value.faults[1]
