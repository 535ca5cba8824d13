"""A suite that a user would write for a driver: it uses each part of the fixture, many times.

Its results must not depend on the load of the machine.
"""

import json
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator

import pytest
import serial

from snakewalk.sim.serve.servo_bus import ServoBus

MakeBus = Callable[..., ServoBus]
PROGRAM = "from snakewalk.controller.cli.main import main; main()"
REPEATED = (
    pytest.mark.parametrize("repetition", range(100)),
    pytest.mark.fast_cases(1),
    pytest.mark.slow_cases(2, "repetitions show an effect of the load"),
)


def repeated(test: Callable[..., None]) -> Callable[..., None]:
    """Repeat a test 100 times."""
    for mark in REPEATED:
        test = mark(test)
    return test


class Driver:
    """A driver of Protocol 1.0 servos on pyserial, as many people write it."""

    def __init__(self, url: str, baud: int = 1_000_000) -> None:
        self.port = serial.serial_for_url(url, baud, timeout=0.05)

    def ask(self, servo_id: int, code: int, *params: int) -> bytes | None:
        """Send an instruction; return the parameters of its reply, None without one."""
        body = bytes([servo_id, len(params) + 2, code, *params])
        self.port.reset_input_buffer()
        self.port.write(b"\xff\xff" + body + bytes([~sum(body) & 0xFF]))
        head = self.port.read(4)
        if len(head) < 4 or head[2] != servo_id:
            return None
        rest = self.port.read(head[3])
        is_complete = len(rest) == head[3] and (sum(head[2:] + rest) & 0xFF) == 0xFF
        return rest[1:-1] if is_complete else None

    def position(self, servo_id: int) -> int | None:
        """Read the position of an STS3215."""
        raw = self.ask(servo_id, 2, 56, 2)
        return None if raw is None else int.from_bytes(raw, "little")

    def move(self, servo_id: int, goal: int) -> None:
        """Switch torque on and set a goal."""
        self.ask(servo_id, 3, 40, 1)
        self.ask(servo_id, 3, 42, *goal.to_bytes(2, "little"))


@repeated
def test_a_goal_is_reached(servo_bus: MakeBus, repetition: int) -> None:
    bus = servo_bus("1-3:STS3215", virtual_time=True)
    driver = Driver(bus.url)
    driver.move(2, 2400)
    begin_s = time.monotonic()
    while abs((driver.position(2) or 0) - 2400) > 20:
        time.sleep(0.02)
        assert time.monotonic() - begin_s < 2.0
    assert bus["Torque Enable"].tolist() == [0, 1, 0]


@repeated
def test_a_fault_in_the_middle(servo_bus: MakeBus, repetition: int) -> None:
    bus = servo_bus("1-3:STS3215", virtual_time=True)
    driver = Driver(bus.url)
    assert driver.position(3) == 2048
    bus.fault("mute", ids=[3], for_s=0.5)
    assert driver.position(3) is None
    assert driver.position(1) == 2048
    time.sleep(0.6)
    assert driver.position(3) == 2048
    bus.fault("corrupt")
    assert driver.position(1) is None


@repeated
def test_packets_are_readable(servo_bus: MakeBus, repetition: int) -> None:
    bus = servo_bus("7:STS3215")
    Driver(bus.url).ask(7, 1)
    assert [str(packet) for packet in bus.packets] == [
        "-> 7 ping ff ff 07 02 01 f5",
        "<- 7 ok ff ff 07 02 00 f6",
    ]


@repeated
def test_another_baud_rate_has_no_reply(servo_bus: MakeBus, repetition: int) -> None:
    bus = servo_bus([1, 2, 3])
    assert Driver(bus.url, 57_600).ask(1, 1) is None
    assert bus["Torque Enable"].tolist() == [0, 0, 0]


@pytest.fixture(scope="module")
def shared(module_servo_bus: MakeBus) -> ServoBus:
    """One bus for the tests of this module."""
    return module_servo_bus("1-2:STS3215")


@repeated
def test_a_bus_of_the_module_keeps_its_state(shared: ServoBus, repetition: int) -> None:
    driver = Driver(shared.url)
    driver.move(1, 2048 + repetition)
    shared.line.clock.advance(1.0)
    assert abs(int(shared["Present Position"][0]) - 2048 - repetition) < 20


@pytest.fixture(scope="module")
def served() -> Iterator[str]:
    """Servos that another process serves in virtual time."""
    words = ["bus", "serve", "--servos", "1-3:STS3215", "--virtual-time", "--json"]
    with subprocess.Popen(
        [sys.executable, "-c", PROGRAM, *words], text=True, stdout=subprocess.PIPE
    ) as process:
        assert process.stdout is not None
        yield json.loads(process.stdout.readline())["port"]
        process.send_signal(signal.SIGTERM)


@pytest.mark.parametrize("repetition", range(100))
@pytest.mark.fast_cases(0)
@pytest.mark.slow_cases(2, "repetitions show an effect of the load")
def test_a_bus_of_another_process(served: str, repetition: int) -> None:
    driver = Driver(served)
    goal = 2000 + repetition
    driver.move(3, goal)
    asked = 0
    with driver.port:
        while abs((driver.position(3) or 0) - goal) > 20:  # silence is an error of more than 20
            asked += 1
            assert asked < 5000
