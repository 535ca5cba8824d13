"""The scan asks single IDs only where somebody replies, and names each servo by its number."""

from types import SimpleNamespace
from typing import Any

import pytest

from snakewalk.drivers.bus.feetech_scan import (
    FeetechServo,
    feetech_bauds,
    find_feetech,
    identify,
    identify_at,
)
from snakewalk.drivers.errors import BusError
from snakewalk.sim.serve.bench_line import bench_line
from snakewalk.sim.serve.chain_spec import parse_chain
from tests.helpers.scripted_port import ScriptedPort


def named(head: list[int], servo_id: int) -> FeetechServo | None:
    """Identify a servo by its first five registers."""
    bus: Any = SimpleNamespace(read_bytes=lambda servo, register: bytes(head))
    return identify(bus, servo_id, 1_000_000)


def test_servos_are_found_at_their_rate_alone_and_the_port_keeps_its_own() -> None:
    line: Any = bench_line(parse_chain("1,2,250:STS3215"), 500_000)
    line.setBaudRate(1_000_000)
    steps: list[str] = []
    servos = find_feetech(line, [115_200, 500_000], steps.append)
    assert [(each.servo_id, each.model, each.baud) for each in servos] == [
        (servo_id, "STS3215", 500_000) for servo_id in (1, 2, 250)
    ]
    assert steps == [
        "Feetech servos at 115200 baud",
        "Feetech servos at 500000 baud",
        "Feetech servos at 500000 baud, ID by ID",
    ]
    assert line.getBaudRate() == 1_000_000


def test_an_adapter_that_only_echoes_has_no_servos() -> None:
    """Its echo may hide a reply, so that it is asked ID by ID."""
    port: Any = ScriptedPort(lambda packet: [(1e-4, packet)])
    steps: list[str] = []
    assert find_feetech(port, [1_000_000], steps.append) == []
    assert len(steps) == 2


def test_a_rate_that_the_port_lacks_is_left_out() -> None:
    line: Any = bench_line(parse_chain("1:STS3215"), 1_000_000)
    line.setBaudRate = lambda baud: False
    assert find_feetech(line, [1_000_000]) == []


@pytest.mark.parametrize("model", ["STS3215", "SCS0009", "HLS3606"])
def test_the_order_of_bytes_is_that_of_register_2(model: str) -> None:
    line: Any = bench_line(parse_chain(f"7:{model}"), 1_000_000)
    servo = identify_at(line, 7, 0.004)
    assert servo is not None
    assert (servo.servo_id, servo.model, servo.baud) == (7, model, 1_000_000)
    assert identify_at(line, 8, 0.004) is None


def test_a_servo_of_protocol_1_has_its_id_in_register_3() -> None:
    """An AX-12A has the number 12; a Feetech servo may have firmware 12."""
    assert named([12, 0, 0, 5, 9], 5) is None
    feetech = FeetechServo(6, "Feetech, number 2309", 12, 1_000_000)
    assert named([12, 0, 0, 5, 9], 6) == feetech
    assert named([12, 1, 0, 6, 9], 6) is not None
    assert named([9, 0, 0, 6, 12], 6) is not None
    big = FeetechServo(6, f"Feetech, number {5 * 256 + 9}", 12, 1_000_000)
    assert named([12, 0, 1, 5, 9], 6) == big


def test_an_unknown_order_of_bytes_is_no_feetech_servo() -> None:
    assert named([3, 0, 2, 9, 3], 1) is None


def test_a_servo_that_cannot_be_read_has_no_model() -> None:
    def fail(servo: int, register: object) -> bytes:
        raise BusError("no reply")

    bus: Any = SimpleNamespace(read_bytes=fail)
    assert identify(bus, 1, 1_000_000) is None


def test_rates_of_the_factory_come_first() -> None:
    rates = feetech_bauds()
    assert rates[0] == 1_000_000
    assert len(rates) == len(set(rates))
    assert {500_000, 38_400} <= set(rates)
