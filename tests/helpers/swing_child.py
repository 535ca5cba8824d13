"""A program that swings three joints on the port it is given until somebody ends it."""

import numpy as np

from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import SafetyConfig
from snakewalk.controller.runtime.loop import ticks
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.port.serial_port import SerialPort
from snakewalk.drivers.safety.limits import SafetyLimits
from snakewalk.drivers.safety.safe_link import SafeLink
from snakewalk.drivers.safety.stop_button import StopButton
from snakewalk.drivers.types import JointCommand

ROBOT = RobotConfig(name="trio", joint_axes="yyy")
WATCHDOG_S = 2.5
"""Almost the longest of a servo, so that a busy test machine does not trip it."""


def swing(device: str, how: str) -> None:
    """Swing; ``crash`` raises in the middle of it."""
    safety = SafetyConfig(
        stale_limit_s=10.0,
        slow_stale_limit_s=20.0,
        watchdog_s=WATCHDOG_S,
        following_time_s=20.0,
    )
    with SerialPort(device) as port:
        bus = DynamixelBus(port, latency_s=0.1)
        chain = ServoChain(bus, ROBOT, watchdog_s=WATCHDOG_S)
        limits = SafetyLimits.from_config(ROBOT, safety)
        with (
            StopButton("swing", device) as button,
            SafeLink(chain, limits, port.clock, stop_requested=button.pressed) as link,
        ):
            link.enable()
            for tick in ticks(port.clock, 0.02, port.clock.now_s() + 600.0):
                link.read()
                goal = 0.3 * np.sin(2.0 * port.clock.now_s())
                link.write(JointCommand(port.clock.now_s(), np.full(3, goal)))
                if tick.number >= 20:
                    print("moving", flush=True)
                    if how == "crash":
                        raise RuntimeError("planner crashed")
