"""Current of the chain, fuse and windings: against closed forms and the simulated supply."""

import math
from dataclasses import replace

import numpy as np
import pytest

from snakewalk.config.robot import PowerConfig, RobotConfig
from snakewalk.config.run import SafetyConfig
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.safety.chain_load import (
    LONGEST_STEP_S,
    WINDING_SHARE,
    WINDING_TIME_S,
    ChainLoad,
    motor_columns,
)
from snakewalk.drivers.safety.limits import SafetyLimits
from snakewalk.drivers.safety.load_limits import LoadLimits
from snakewalk.drivers.safety.safe_link import SafeLink
from snakewalk.drivers.types import JointCommand, JointState
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant

J = 4
ROBOT = RobotConfig(name="some", joint_axes="yyyy")
R_OHM, K_V_S = 12.0 / 2.3, 12.0 / (46.0 * math.tau / 60.0)


def state(time_s: float = 0.0, **values: object) -> JointState:
    plain = JointState(
        time_s=time_s,
        position_rad=np.zeros(J),
        velocity_rad_s=np.zeros(J),
        current_a=np.zeros(J),
        temperature_c=np.full(J, 25.0),
        voltage_v=np.full(J, 12.0),
        error=np.zeros(J, np.uint8),
        hardware_error=np.zeros(J, np.uint8),
        age_s=np.zeros(J),
        slow_age_s=np.zeros(J),
        valid=np.ones(J, bool),
    )
    return plain._replace(**values)  # type: ignore[arg-type]


def test_a_motor_at_rest_draws_its_duty_of_its_current() -> None:
    load = ChainLoad(motor_columns(ROBOT))
    load.update(state(current_a=np.array([1.0, -1.0, 0.0, 0.0])))
    assert load.current_a == pytest.approx(J * 0.04 + 2 * R_OHM / 12.0)


def test_a_motor_that_turns_draws_more_and_never_more_than_its_current() -> None:
    load = ChainLoad(motor_columns(ROBOT))
    speed = np.array([1.0, 1.0, -1.0, 50.0])
    load.update(state(current_a=np.array([1.0, -1.0, 1.0, 1.0]), velocity_rad_s=speed))
    driving, braking = (R_OHM + K_V_S) / 12.0, abs(R_OHM - K_V_S) / 12.0
    assert load.current_a == pytest.approx(J * 0.04 + driving + 2 * braking + 1.0)


def test_a_supply_that_sags_draws_more() -> None:
    load = ChainLoad(motor_columns(ROBOT))
    for volts, expected in ((10.0, R_OHM / 10.0), (math.nan, R_OHM / 12.0), (0.0, R_OHM / 12.0)):
        voltage = np.full(J, volts)
        load.update(state(current_a=np.array([1.0, 0, 0, 0]), voltage_v=voltage))
        assert load.current_a == pytest.approx(J * 0.04 + expected)


def test_values_that_were_not_read_draw_nothing() -> None:
    load = ChainLoad(motor_columns(ROBOT))
    load.update(state(current_a=np.full(J, np.nan), velocity_rad_s=np.full(J, np.nan)))
    assert load.current_a == pytest.approx(J * 0.04)
    assert (load.winding_k == 0.0).all()


def test_windings_follow_their_loss_with_their_time_constant() -> None:
    load = ChainLoad(motor_columns(ROBOT))
    amps = np.array([1.0, 0.0, -1.0, 0.5])
    for time_s in np.arange(0.0, WINDING_TIME_S + 1e-9, 0.02):
        load.update(state(float(time_s), current_a=amps))
    final_k = WINDING_SHARE * 6.0 * R_OHM * amps**2
    assert load.winding_k == pytest.approx(final_k * (1.0 - math.exp(-1.0)), rel=1e-6)
    warm = load.winding_c(state(temperature_c=np.full(J, 40.0)))
    assert warm == pytest.approx(40.0 + load.winding_k)


def test_a_pause_counts_as_a_second_at_most_and_no_time_runs_backwards() -> None:
    load = ChainLoad(motor_columns(ROBOT))
    amps = np.full(J, 1.0)
    load.update(state(0.0, current_a=amps))
    load.update(state(100.0, current_a=amps))
    expected = WINDING_SHARE * 6.0 * R_OHM * -math.expm1(-LONGEST_STEP_S / WINDING_TIME_S)
    assert load.winding_k == pytest.approx(np.full(J, expected))
    assert load.charge_ah == pytest.approx(load.current_a / 3600.0)
    load.update(state(50.0, current_a=amps))
    assert load.charge_ah == pytest.approx(load.current_a / 3600.0)


def limits(fuse_a: float = math.inf, winding_c: float = math.inf) -> SafetyLimits:
    robot = ROBOT
    if math.isfinite(fuse_a):
        robot = robot.model_copy(update={"power": PowerConfig(fuse_a=fuse_a)})
    return SafetyLimits.from_config(robot, SafetyConfig(winding_limit_c=min(winding_c, 1e9)))


DRAWN_A = J * 0.04 + J * R_OHM / 12.0
"""By four motors at rest at 1 A."""


@pytest.mark.parametrize(("share", "trips"), [(0.999, True), (1.001, False)])
def test_a_fuse_is_exceeded_for_the_time_of_a_current_limit(share: float, *, trips: bool) -> None:
    judge, found = LoadLimits(limits(fuse_a=share * DRAWN_A)), None
    times = np.arange(0.0, 2.0, 0.02)
    for time_s in times:
        found = judge.update(state(float(time_s), current_a=np.full(J, 1.0)))
        if found is not None:
            break
    assert (found is not None) == trips
    if trips:
        assert time_s == pytest.approx(SafetyConfig().current_time_s)
        assert found == (
            f"the chain draws about {DRAWN_A:.1f} A for 0.50 s, more than its fuse of "
            f"{share * DRAWN_A:g} A (power.fuse_a of the robot)"
        )


def test_a_current_below_the_fuse_ends_the_count() -> None:
    judge = LoadLimits(limits(fuse_a=DRAWN_A - 0.1))
    for k in range(200):
        amps = np.full(J, 0.5 if k % 25 == 24 else 1.0)
        assert judge.update(state(0.02 * k, current_a=amps)) is None


@pytest.mark.parametrize(("margin_c", "trips"), [(-0.004, True), (0.004, False)])
def test_a_winding_beyond_its_limit_ends_the_run(margin_c: float, *, trips: bool) -> None:
    amps, warm = np.array([0.0, 0.0, 1.0, 0.0]), np.full(J, 25.0)
    seconds = 19.98
    reached_c = 25.0 + WINDING_SHARE * 6.0 * R_OHM * -math.expm1(-seconds / WINDING_TIME_S)
    judge = LoadLimits(limits(winding_c=reached_c + margin_c))
    lines = [
        judge.update(state(0.02 * k, current_a=amps, temperature_c=warm))
        for k in range(round(seconds / 0.02) + 1)
    ]
    assert lines[:-1] == [None] * (len(lines) - 1)
    assert (lines[-1] is not None) == trips
    if trips:
        name = "joint yaw_03 (ID 3): winding at about"
        assert str(lines[-1]).startswith(f"{name} {reached_c:.0f} C, over ")
        assert str(lines[-1]).endswith(": its housing is at 25 C")


def test_a_temperature_that_was_never_read_is_no_reason() -> None:
    judge = LoadLimits(limits(winding_c=26.0))
    for k in range(500):
        hot = state(0.02 * k, current_a=np.full(J, 1.0), temperature_c=np.full(J, np.nan))
        assert judge.update(hot) is None


def test_without_records_of_the_motors_nothing_is_estimated() -> None:
    judge = LoadLimits(replace(limits(fuse_a=0.001), motor=None))
    assert judge.update(state(current_a=np.full(J, 9.0))) is None
    assert judge.load is None


def test_the_estimate_is_the_current_of_the_simulated_supply_and_a_fuse_ends_a_run() -> None:
    """Four shafts that are blocked push: the supply sees what the estimate says."""
    robot = ROBOT.model_copy(update={"power": PowerConfig(fuse_a=3.0)})
    line = SimLine(ServoBank(robot.servo_ids), BenchPlant(J))
    safety = SafetyConfig(following_time_s=5.0, goal_lead_rad=1.0)
    link = SafeLink(
        ServoChain(DynamixelBus(line), robot), SafetyLimits.from_config(robot, safety), line.clock
    )
    with link:
        link.enable()
        line.firmware.block_shafts(np.arange(J))
        estimates, truths = [], []
        for k in range(200):
            line.clock.advance(0.02)
            link.read()
            if link.tripped is not None:
                break
            link.write(JointCommand(line.clock.now_s(), np.full(J, min(0.22, 0.004 * k))))
            output, speed = line.firmware._motor_output, line.firmware.plant.velocity_rad_s
            assert link.load is not None
            estimates.append(link.load.current_a - J * 0.04)
            truths.append(float(np.abs(output.pwm(speed) * output.current_a()).sum()))
        assert "more than its fuse of 3 A" in str(link.tripped)
    assert max(truths) > 3.0
    assert np.array(estimates[20:-1]) == pytest.approx(np.array(truths[20:-1]), rel=0.05, abs=0.1)
