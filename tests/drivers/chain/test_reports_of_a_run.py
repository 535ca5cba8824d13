"""A run reports a dead sensor and a slow adapter."""

import numpy as np
import pytest

from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import SafetyConfig
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.safety.limits import SafetyLimits
from snakewalk.drivers.safety.safe_link import SafeLink
from snakewalk.drivers.types import JointCommand
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant
from tests.drivers.chain.test_motion_sensors import ROBOT, STEP_S


def test_a_run_reports_a_dead_current_sensor() -> None:
    """The run went on without a word, and nothing watched the load of the joint."""
    line = SimLine(ServoBank(ROBOT.servo_ids), BenchPlant(2))
    chain = ServoChain(DynamixelBus(line), ROBOT)
    events: list[str] = []
    chain.on_event = events.append
    link = SafeLink(chain, SafetyLimits.from_config(ROBOT, SafetyConfig()), line.clock)
    link.enable()
    line.firmware.set_reading(np.array([0]), "Present Current", 30)
    start_s = line.clock.now_s()
    for k in range(150):
        line.clock.sleep_until_s(start_s + k * STEP_S)
        link.read()
        link.write(JointCommand(line.clock.now_s(), np.full(2, 0.3 * np.sin(2.5 * k * STEP_S))))
    (event,) = events
    assert event.startswith("joint yaw_01 (ID 1): current reads 0.08 A constantly")


@pytest.mark.parametrize(("latency_s", "is_late"), [(0.001, False), (0.016, True)])
def test_an_adapter_that_becomes_slow_is_named(latency_s: float, *, is_late: bool) -> None:
    """The run named noise, a loose plug, and no power."""
    robot = RobotConfig(name="four", joint_axes="yyyy")
    line = SimLine(ServoBank(robot.servo_ids), BenchPlant(4), usb_latency_s=1e-3)
    chain, events = ServoChain(DynamixelBus(line, latency_s=0.003), robot), list[str]()
    chain.enable()
    chain.on_event = events.append
    line.usb_latency_s = latency_s
    start_s = line.clock.now_s()
    for k in range(6):
        line.clock.sleep_until_s(start_s + 0.02 * k)
        chain.read()
        chain.write(JointCommand(line.clock.now_s(), np.zeros(4)))
    assert any("after the time-out" in event for event in events) == is_late
    assert not any("noise" in event for event in events)
