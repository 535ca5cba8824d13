"""Servos that were not read are asked again after torque off, and one cause is named."""

import os
import subprocess
from collections.abc import Callable

import pytest

from snakewalk.config.robot import RobotConfig
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.chain.silence_cause import _dead_line_cause, silence_cause
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant

ROBOT = RobotConfig(name="four", joint_axes="yyyy")
Tamper = Callable[[bytes], list[bytes]]


def cause(silent: list[int], tamper: Tamper | None = None, latency_s: float = 1e-3) -> str:
    line = SimLine(ServoBank(ROBOT.servo_ids), BenchPlant(4), usb_latency_s=latency_s)
    line.tamper = tamper
    return silence_cause(DynamixelBus(line, latency_s=0.004), ROBOT, silent)


def mute(*ids: int) -> Tamper:
    return lambda raw: [] if raw[4] in ids else [raw]


def damaged(*ids: int) -> Tamper:
    return lambda raw: [raw[:-1] + bytes([raw[-1] ^ 1])] if raw[4] in ids else [raw]


@pytest.mark.parametrize(
    ("silent", "tamper", "expected"),
    [
        ([1], mute(2), "it sends no byte: its connection is lost"),
        ([2, 3], mute(3, 4), "all behind joint yaw_02 (ID 2) are silent: the cable there"),
        ([0, 2], mute(1, 3), "it sends no byte: its connection is lost"),
        ([0, 1, 2, 3], mute(1, 2, 3, 4), "no byte comes back: their supply, or the first cable"),
        ([1], damaged(2), "only replies of joint yaw_02 (ID 2) are damaged: two servos with its"),
        ([1], damaged(2, 4), "other replies are damaged too: noise on the line"),
        ([1], None, "it replies again: a loose contact"),
        ([0, 1, 2, 3], None, "servos reply again: supply or first cable failed briefly, or this"),
        (
            [1],
            lambda raw: [raw] if len(raw) == 14 else [],
            "joint yaw_02 (ID 2) answers pings, but no reads: its Status Return Level",
        ),
    ],
)
def test_the_cause_follows_from_the_bytes(
    silent: list[int], tamper: Tamper | None, expected: str
) -> None:
    assert cause(silent, tamper).startswith(expected)


def test_a_reply_to_an_earlier_request_is_no_second_servo() -> None:
    """A slow adapter was called two servos with one ID."""
    line = SimLine(ServoBank(ROBOT.servo_ids), BenchPlant(4), usb_latency_s=0.016)
    bus = DynamixelBus(line, latency_s=0.004)
    line.write(bus._probe_packet(1, (132, 4)))
    assert "high latency" in silence_cause(bus, ROBOT, [0, 1, 2, 3])


def test_a_slow_adapter_delays_each_reply() -> None:
    said = cause([0, 1, 2, 3], latency_s=0.016)
    assert said.startswith("each reply is at least 1")
    assert said.endswith("ms late: high latency of the adapter")


def test_a_pause_of_a_served_bus_is_no_loose_contact() -> None:
    """On a busy computer the first motion of ``setup`` was said to have one."""
    master, device = os.openpty()
    port = SimLine(ServoBank(ROBOT.servo_ids), BenchPlant(4))
    port.label = os.ttyname(device)
    said = silence_cause(DynamixelBus(port, latency_s=0.004), ROBOT, [0, 1, 2, 3])
    os.close(master)
    os.close(device)
    assert said.endswith("the program that simulates them paused; close other programs")


def test_a_program_that_takes_all_bytes_is_named() -> None:
    """A run named the supply, the cable or the adapter."""
    master, device = os.openpty()
    port = SimLine(ServoBank((1,)), BenchPlant(1))
    port.label = os.ttyname(device)
    with subprocess.Popen(["sleep", "60"], stdin=device) as other:
        try:
            assert _dead_line_cause(port) == f"sleep (process {other.pid}) reads from the port too"
        finally:
            other.kill()
            os.close(master)
            os.close(device)
