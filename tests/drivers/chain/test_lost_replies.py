"""Replies that get lost or arrive late are reported once, with the likely cause."""

import numpy as np
import pytest

from snakewalk.config.robot import RobotConfig
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.chain.lost_replies import LATE_READS, LOSS_READS, LOSSES, LostReplies
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.types import JointCommand
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant


def test_losses_without_late_bytes_are_noise() -> None:
    found = LostReplies()
    lines = [found.update(2 - k % 2, 2) for k in range(2 * LOSSES)]
    (line,) = [each for each in lines if each is not None]
    assert line.startswith(f"replies got lost {LOSSES} times")


def test_late_bytes_are_reported_at_the_third_read() -> None:
    found = LostReplies()
    lines = [found.update(1, 2, late_bytes=20 * k) for k in range(LATE_READS + 3)]
    assert [each is not None for each in lines] == [k == LATE_READS for k in range(LATE_READS + 3)]
    assert str(lines[LATE_READS]).startswith("replies arrive after the time-out: an adapter")


def test_rare_late_bytes_are_not_reported() -> None:
    found = LostReplies()
    for k in range(5 * LOSS_READS):
        assert found.update(2, 2, late_bytes=20 * (k // (LOSS_READS // 2))) is None


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
