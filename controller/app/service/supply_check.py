"""The supply under load: the joints wiggle a little, and the servos measure their voltage."""

import math

import numpy as np

from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import SafetyConfig
from snakewalk.controller.app.service.finding import Finding
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.chain.joint_codec import voltages_v
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.errors import DriverError
from snakewalk.drivers.safety.limits import SafetyLimits
from snakewalk.drivers.safety.safe_link import SafeLink
from snakewalk.drivers.safety.stop_button import StopButton
from snakewalk.drivers.types import JointCommand

_AMPLITUDE_RAD, _FREQUENCY_HZ, _CYCLES = 0.15, 2.0, 4
_PERIOD_S = 0.02
_SAG_SHARE = 0.08
"""Share of the voltage at rest that the supply may lose (ours); a walk asks for more than this."""


def supply_under_load(bus: DynamixelBus, robot: RobotConfig, safety: SafetyConfig) -> Finding:
    """Set the chain up as a run does, wiggle all joints by 0.15 rad for 2 s, torque off.

    Raises:
        PortError: the port vanished, and torque could not be switched off.

    """
    check = "supply under load"
    chain = ServoChain(bus, robot, watchdog_s=safety.watchdog_s)
    limits, clock = SafetyLimits.from_config(robot, safety), bus.port.clock
    lowest_v = np.full(robot.joint_count, np.inf)
    try:
        with (
            StopButton("doctor", bus.port.name) as button,
            SafeLink(chain, limits, clock, stop_requested=button.pressed) as link,
        ):
            start = link.enable()
            voltage = bus.slow_cycle(robot.servo_ids, fast=chain.fast)
            begin_s = clock.now_s()
            for cycle in range(round(_CYCLES / _FREQUENCY_HZ / _PERIOD_S)):
                clock.sleep_until_s(begin_s + cycle * _PERIOD_S)
                time_s = clock.now_s()
                link.read()
                phase = 2.0 * math.pi * _FREQUENCY_HZ * cycle * _PERIOD_S
                goal = start.position_rad + _AMPLITUDE_RAD * math.sin(phase)
                link.write(JointCommand(time_s, goal))
                reply = voltage.read()
                measured_v = np.where(reply.valid, voltages_v(reply.data), np.inf)
                lowest_v = np.minimum(lowest_v, measured_v)
    except DriverError as fault:
        return Finding(check, "fail", f"the wiggle ended: {fault}", "remove the cause first")
    rest_v = float(start.voltage_v.min())
    sag_v = float((start.voltage_v - lowest_v).max())
    found = f"{rest_v:.1f} V at rest, {lowest_v.min():.1f} V in motion"
    if sag_v > _SAG_SHARE * rest_v:
        remedy = "charge the battery; thicker or shorter cable; feed the chain at both ends"
        return Finding(check, "fail", f"{found}: it sags by {sag_v:.1f} V", remedy)
    return Finding(check, "ok", found)
