"""The supply under load: the joints wiggle a little, and the servos measure their voltage."""

import math
from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Bytes, Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import SafetyConfig
from snakewalk.controller.bench.cable_drop import cable_finding, drawn_a
from snakewalk.controller.console.finding import Finding
from snakewalk.drivers.bus.chain_bus import ChainBus, GroupCycle
from snakewalk.drivers.chain.joint_codec import voltages_v
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.errors import DriverError
from snakewalk.drivers.safety.limits import SafetyLimits
from snakewalk.drivers.safety.safe_link import SafeLink
from snakewalk.drivers.safety.stop_button import StopButton
from snakewalk.drivers.types import JointCommand

_AMPLITUDE_RAD = 0.15
_FREQUENCY_HZ = 3.0
_CYCLES = 6
"""Cycles of the wiggle. Its speed is at most 2.8 rad/s: within the limits of a run (4 rad/s) and of
the servos' motors."""
_GROWING_CYCLES = 3
"""Cycles in which the wiggle grows: a cable that is nearly broken is measured before an alarm ends
it."""
_PERIOD_S = 0.02
"""Period of a cycle, as of a run at 50 Hz. With each step of the goal the motors draw most of their
current within a few milliseconds."""
_DELAYS_S = (1e-3, 2e-3, 3e-3, 5e-3, 8e-3)
"""Delays of a reading behind a step, in turns: at one phase alone the readings might always miss
the current.
"""
_SAG_SHARE = 0.08
"""Share of the voltage at rest that the supply may lose (ours); a walk asks for more than this."""
_OUTPUT = "Present PWM"
_VOLTAGE_AT = 20
"""Place of Present Input Voltage(144) in a block from Present PWM(124) on."""
_SUPPLY_BYTES = 3
"""A block of Present Input Voltage and Present Temperature alone."""
_LEAST_READINGS = 10
"""Readings of a wiggle that ended early, from which on they are judged (ours)."""


@dataclass(frozen=True, slots=True)
class Wiggle:
    """Measurements of S servos in T cycles while all joints moved."""

    rest_v: Floats
    """(S,) supply voltages at rest, before the motion."""
    voltage_v: Floats
    """(T, S) supply voltages during the motion."""
    drawn_a: Floats
    """(T, S) from the supply; NaN of servos without a current sensor."""
    fault: DriverError | None
    """Error that ended the measurement early."""


def supply_under_load(bus: ChainBus, robot: RobotConfig, safety: SafetyConfig) -> list[Finding]:
    """Wiggle all joints, and judge the supply and the drop of the cables.

    Raises:
        PortError: the port vanished, and torque could not be switched off.

    """
    check = "supply under load"
    wiggled = wiggle(bus, robot, safety)
    enough = len(wiggled.voltage_v) >= _LEAST_READINGS
    cables = [cable_finding(robot, wiggled.voltage_v, wiggled.drawn_a)] if enough else []
    if wiggled.fault is not None:
        text = f"the wiggle ended: {wiggled.fault}"
        return [Finding(check, "fail", text, "remove the cause first"), *cables]
    if not enough:
        text = f"only {len(wiggled.voltage_v)} readings of all servos were complete"
        return [Finding(check, "fail", text, "see the check line: cables, plugs, a common ground")]
    lowest_v, rest_v = wiggled.voltage_v.min(axis=0), float(wiggled.rest_v.min())
    sag_v = float((wiggled.rest_v - lowest_v).max())
    supply_text = f"{rest_v:.1f} V at rest, {lowest_v.min():.1f} V in motion"
    if sag_v > _SAG_SHARE * rest_v:
        remedy = "charge the battery; thicker or shorter cables; inject power at more places"
        return [Finding(check, "fail", f"{supply_text}: it sags by {sag_v:.1f} V", remedy), *cables]
    return [Finding(check, "ok", supply_text), *cables]


def wiggle(bus: ChainBus, robot: RobotConfig, safety: SafetyConfig) -> Wiggle:
    """Set the chain up as a run does, wiggle all joints by up to 0.15 rad for 2 s, torque off.

    Raises:
        PortError: the port vanished, and torque could not be switched off.

    """
    chain = ServoChain(bus, robot, watchdog_s=safety.watchdog_s)
    limits = SafetyLimits.from_config(robot, safety)
    clock = chain.clock
    rest_v = np.full(robot.joint_count, np.nan)
    voltage_v: list[Floats] = []
    drawn: list[Floats] = []
    fault = None
    try:
        with (
            StopButton("doctor", [part.port.name for part in bus.parts]) as button,
            SafeLink(chain, limits, clock, stop_requested=button.pressed) as link,
        ):
            start = link.enable()
            rest_v = start.voltage_v
            block = _supply_block(bus, robot, fast=chain.fast)
            begin_s = clock.now_s()
            for cycle in range(round(_CYCLES / _FREQUENCY_HZ / _PERIOD_S)):
                clock.sleep_until_s(begin_s + cycle * _PERIOD_S)
                time_s = clock.now_s()
                turns = _FREQUENCY_HZ * cycle * _PERIOD_S
                size_rad = _AMPLITUDE_RAD * min(turns / _GROWING_CYCLES, 1.0)
                goal = start.position_rad + size_rad * math.sin(math.tau * turns)
                link.read()
                link.write(JointCommand(time_s, goal))
                clock.sleep_until_s(clock.now_s() + _DELAYS_S[cycle % len(_DELAYS_S)])
                reply = block.read()
                if reply.valid.all():
                    voltage_v.append(voltages_v(reply.data[:, _voltage_at(reply.data) :]))
                    drawn.append(_drawn_a(robot, reply.data))
    except DriverError as error:
        fault = error
    shape = -1, robot.joint_count
    return Wiggle(rest_v, np.array(voltage_v).reshape(shape), np.array(drawn).reshape(shape), fault)


def _supply_block(bus: ChainBus, robot: RobotConfig, *, fast: bool) -> GroupCycle:
    ids = robot.servo_ids
    if all(_OUTPUT in bus.table_of(servo_id) for servo_id in ids):
        return bus.block(ids, _OUTPUT, "Present Input Voltage", fast=fast)
    return bus.slow_cycle(ids, fast=fast)


def _voltage_at(blocks: Bytes) -> int:
    return 0 if blocks.shape[1] == _SUPPLY_BYTES else _VOLTAGE_AT


def _drawn_a(robot: RobotConfig, blocks: Bytes) -> Floats:
    """(S,) drawn from the supply, of blocks (S, B) that begin with output and current, or NaN."""
    if blocks.shape[1] == _SUPPLY_BYTES:
        return np.full(len(blocks), np.nan)
    output, current = np.ascontiguousarray(blocks[:, :4]).view("<i2").T
    models = robot.servo_records
    unit_a = [math.nan if (a := model.units.current_a) is None else a for model in models]
    full = np.array([model.units.full_pwm or math.nan for model in models])
    return drawn_a(robot, output / full, current * np.array(unit_a))
