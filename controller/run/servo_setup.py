"""Servos of a run: gains for its motion; checks of supply, current, rate and compliance."""

from collections.abc import Sequence

from snakewalk.config.errors import InputError
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.controller.motion.compliance import chatters
from snakewalk.controller.runlog.record import Winding
from snakewalk.drivers.bus.budget import check_ages, robot_budget
from snakewalk.drivers.compiling import is_compiling
from snakewalk.drivers.protocol.registers import CURRENT_POSITION_MODE
from snakewalk.sim.servo.motor import known_motors, p_gain_per_rad

GAIT_PITCH_SHARE = 0.75
"""Goal current of pitch joints that lift, as a share of safety's limit (1.5 A of an XM430; ours):
soft ones would not carry the links."""

UNCOMPILED_HZ = 50.0
"""Highest rate of cycles without numba: it uses half of a core with 16 servos (ours;
docs/how-to/small-computer.md)."""


def check_supply(robot: RobotConfig) -> None:
    """Reject a supply at which a servo would only raise its alarm.

    Raises:
        InputError: with the model's range of voltages, and the recommended one.

    """
    for facts in robot.models_by_id.values():
        if facts.motor is None:  # its file does not state it
            continue
        low_v, high_v = facts.motor.voltage_v
        if not low_v <= robot.servo.supply_v <= high_v:
            raise InputError(
                f"robot {robot.name}: servo.supply_v = {robot.servo.supply_v:g}: {facts.model} "
                f"accepts {low_v:g} to {high_v:g} V; use supply_v = {facts.motor.nominal_v:g}"
            )


def check_servos(run: RunConfig, robot: RobotConfig) -> None:
    """Reject a wrong supply, a cycle that does not fit the bus, and an unreachable current.

    Raises:
        InputError: with the model's voltages; the highest rate, or the age of the values; the stall
            current.

    """
    check_supply(robot)
    if run.safety.current_limit_a is not None:
        try:
            robot.check_over_current("safety.current_limit_a", run.safety.current_limit_a)
        except ValueError as fault:
            raise InputError(f"run {run.name}: {fault}") from None
    _check_hold(run, robot)
    _check_fuse(robot)
    _check_uncompiled_rate(run)
    budget = robot_budget(robot, robot.servo.baud, fast=True)
    safety = run.safety
    budget.check(run.cycle_hz)
    check_ages(
        budget,
        run.cycle_hz,
        stale_limit_s=safety.stale_limit_s,
        watchdog_s=safety.watchdog_s,
    )


def _check_uncompiled_rate(run: RunConfig) -> None:
    if run.cycle_hz > UNCOMPILED_HZ and not is_compiling():
        raise InputError(
            f"run {run.name}: cycle_hz = {run.cycle_hz:g}: without numba the loops of a cycle "
            f"sustain at most {UNCOMPILED_HZ:g} Hz; set --set run.cycle_hz={UNCOMPILED_HZ:g}, or "
            "install it: pip install numba"
        )


def _check_hold(run: RunConfig, robot: RobotConfig) -> None:
    if run.safety.on_trip == "off":
        return
    for facts in robot.models_by_id.values():
        if not (facts.measures_current and CURRENT_POSITION_MODE in facts.modes):
            raise InputError(
                f"run {run.name}: safety.on_trip = hold: {facts.model} has no current-based "
                "position control, so its joints cannot hold with a low current; set "
                "safety.on_trip to off"
            )


def _check_fuse(robot: RobotConfig) -> None:
    if robot.power is None or robot.power.fuse_a is None:
        return
    for facts in robot.models_by_id.values():
        if facts.motor is None:
            raise InputError(
                f"robot {robot.name}: power.fuse_a = {robot.power.fuse_a:g}: the file of "
                f"{facts.model} has no [motor], so its current cannot be estimated; add it: "
                "docs/how-to/add-a-servo-model.md"
            )


def with_gains(robot: RobotConfig, *, pitch: bool, soft: Sequence[int] = ()) -> RobotConfig:
    """Set the servos up: pitch joints that carry links, all as soft as the least of ``soft``."""
    servo = robot.servo
    changes: dict[str, float] = {}
    if pitch:
        changes["pitch_p_gain"] = max(servo.pitch_p_gain, servo.position_p_gain)
        carry_a = GAIT_PITCH_SHARE * robot.over_current_a
        changes["pitch_current_limit_a"] = max(servo.pitch_current_limit_a, carry_a)
    if soft:
        changes["position_p_gain"] = changes["pitch_p_gain"] = min(soft)
    joints = []
    for joint, axis in zip(robot.joints, robot.all_axes, strict=False):  # there may be none
        gains: dict[str, float | None] = {}
        for key, least in (
            ("position_p_gain", changes.get("pitch_p_gain")),
            ("current_limit_a", changes.get("pitch_current_limit_a")),
        ):
            value = getattr(joint, key)
            if value is not None and least is not None and axis == "p":
                gains[key] = max(value, least)
        if soft:
            gains["position_p_gain"] = None
        joints.append(joint.model_copy(update=gains))
    return robot.model_copy(
        update={"servo": servo.model_copy(update=changes), "joints": tuple(joints)}
    )


def check_compliance(run: RunConfig, robot: RobotConfig) -> None:
    """Reject compliance that safety would clamp, or that would chatter at a blocked shaft.

    Raises:
        InputError: one line for each fault.

    """
    config = run.compliance
    if config is None:
        return
    faults = []
    allowed = run.safety.goal_rate_rad_s - robot.joint_speed_limit_rad_s
    if config.yield_rate_rad_s > allowed:
        faults.append(
            f"run {run.name}: compliance.yield_rate_rad_s {config.yield_rate_rad_s:g}: together "
            f"with the robot's joint_speed_limit_rad_s {robot.joint_speed_limit_rad_s:g} it is "
            f"over safety.goal_rate_rad_s {run.safety.goal_rate_rad_s:g}; at most {allowed:g}"
        )
    chatter = chatters(config, _current_gain_a_rad(robot), 1.0 / run.cycle_hz)
    if chatter is not None:
        faults.append(f"run {run.name}: {chatter}")
    if faults:
        raise InputError(faults)


def _current_gain_a_rad(robot: RobotConfig) -> float:
    """Current of the stiffest joint per radian of lead; 0 without a known motor."""
    gains_a_rad = [0.0]
    for motor, gain in zip(known_motors(robot), robot.position_p_gains, strict=True):
        if motor is not None:
            per_rad = float(p_gain_per_rad(gain, motor))
            gains_a_rad.append(per_rad * robot.servo.supply_v / motor.resistance_ohm)
    return max(gains_a_rad)


def motor_constants(robot: RobotConfig) -> tuple[float, Winding | None]:
    """Torque constant (N m/A) and winding of the robot's servos.

    NaN and None if the model has no motor, or there are several models.
    """
    motors = set(known_motors(robot))
    motor = motors.pop()
    if motor is None or motors:
        return float("nan"), None
    return motor.torque_constant_n_m_a, Winding(motor.resistance_ohm, motor.back_emf_v_s)
