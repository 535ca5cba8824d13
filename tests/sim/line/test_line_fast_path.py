"""The fast path of a simulated line against the calls of the wire that it stands for."""

from collections.abc import Callable
from dataclasses import astuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from snakewalk.drivers.bus.control_cycle import ControlCycle
from snakewalk.drivers.errors import PortError
from snakewalk.drivers.protocol.packet import Instruction, InstructionPacket, encode_instruction
from snakewalk.sim.line.sim_line import LineFastPath, SimLine
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant

IDS = (1, 2, 3, 4)
PING = encode_instruction(InstructionPacket(2, Instruction.PING))
Between = Callable[[SimLine, int], object]
"""What happens to a line before a cycle."""


class Called(SimLine):
    """A line that says what is written: so all goes through its calls."""

    def write(self, data: bytes) -> None:
        super().write(data)


def make(kind: type[SimLine], delay: int = 0, usb_latency_s: float = 0.0) -> SimLine:
    bank = ServoBank(IDS)
    bank["Return Delay Time"][:] = delay
    line = kind(bank, BenchPlant(len(IDS)), usb_latency_s=usb_latency_s)
    bank["Torque Enable"][:] = 1
    line.firmware.apply_registers()
    return line


def run(line: SimLine, between: Between, *, fast: bool = True, address: int = 126) -> list[object]:
    """All that a host can see of 25 cycles of 20 ms, and what the servos hold after each."""
    cycle = ControlCycle(line, IDS, fast=fast, registers=(116, address, 10))
    assert isinstance(cycle._fast_path, LineFastPath) == (type(line) is SimLine)
    seen: list[object] = []
    for k in range(25):
        line.clock.sleep_until_s(0.02 * k)
        between(line, k)
        reply = cycle.read()
        cycle.write_goals(np.array([2048 + 40 * k, 2048 - 7 * k, 2048, 2100], np.int32))
        seen += [
            *(reply.data.tolist(), reply.valid.tolist(), reply.error.tolist(), reply.clean),
            *(line.clock.now_s(), line.busy_s, line.collisions, cycle.since_sent_s),
            *(astuple(cycle.counters), line.bank.table.tobytes()),
        ]
    return seen


def nothing(line: SimLine, k: int) -> None:
    pass


def alarm(line: SimLine, k: int) -> None:
    line.bank["Hardware Error Status"][1] = 0x20 * (k % 5 == 2)


def another_packet(line: SimLine, k: int) -> None:
    if k % 4 == 1:
        line.write(PING)


def another_reply(line: SimLine, k: int) -> None:
    if k % 4 == 1:
        line.write(PING)
        line.clock.advance(3e-4)


def part_of_a_packet(line: SimLine, k: int) -> None:
    if k == 7:
        line.write(PING[:6])


def reboot(line: SimLine, k: int) -> None:
    if k == 9:
        line.write(encode_instruction(InstructionPacket(3, Instruction.REBOOT)))
        line.clock.advance(2e-3)


def silence(line: SimLine, k: int) -> None:
    if k in (6, 14):
        line.mute(np.array([2]), k == 6)
        line.refresh_ids()


def silence_meanwhile(line: SimLine, k: int) -> None:
    """While the request is on the wire."""

    def fall_silent() -> None:
        line.mute(np.array([1]), k == 6)
        line.refresh_ids()

    if k in (6, 14):
        line.firmware.events.schedule(line.clock.now_s() + 1e-4, fall_silent)


def other_ids_meanwhile(line: SimLine, k: int) -> None:
    def exchange() -> None:
        line.bank["ID"][:2] = line.bank["ID"][1::-1].copy()
        line.refresh_ids()

    if k == 9:
        line.firmware.events.schedule(line.clock.now_s() + 1e-4, exchange)


def a_header(line: SimLine, k: int) -> None:
    block = bytes((0xFF, 0xFF, 0xFD, 0x00)) if k % 3 == 1 else bytes(4)
    line.bank.table[0, 84:88] = np.frombuffer(block, np.uint8)


@pytest.mark.parametrize("fast", [True, False], ids=["fast", "plain"])
@pytest.mark.parametrize(
    "between",
    [
        *(nothing, alarm, another_packet, another_reply, part_of_a_packet),
        *(reboot, silence, silence_meanwhile, other_ids_meanwhile),
    ],
    ids=lambda each: each.__name__,
)
def test_cycles_are_those_of_the_calls_to_the_bit(between: Between, fast: bool) -> None:
    seen = [run(make(kind), between, fast=fast) for kind in (SimLine, Called)]
    assert seen[0] == seen[1]


@pytest.mark.parametrize("fast", [True, False], ids=["fast", "plain"])
@pytest.mark.parametrize(
    ("delay", "usb_latency_s"), [(0, 0.001), (250, 0.0), (10, 0.002), (0, 0.03)]
)
def test_delays_count_and_what_is_too_late_is_waited_for(
    delay: int, usb_latency_s: float, fast: bool
) -> None:
    """30 ms is beyond all patience: every read times out."""
    seen = [run(make(kind, delay, usb_latency_s), nothing, fast=fast) for kind in (SimLine, Called)]
    assert seen[0] == seen[1]


def test_what_is_stuffed_is_left_to_the_parser() -> None:
    seen = [run(make(kind), a_header, fast=False, address=80) for kind in (SimLine, Called)]
    assert seen[0] == seen[1]


@pytest.mark.costs("hypothesis tries whole lines")
@given(
    goals=st.lists(st.integers(-(2**31), 2**31 - 1), min_size=4, max_size=4),
    address=st.integers(0, 140),
    fast=st.booleans(),
)
@settings(max_examples=60, deadline=None)
def test_any_goals_and_any_block(goals: list[int], address: int, fast: bool) -> None:
    seen = []
    for kind in (SimLine, Called):
        line = make(kind)
        cycle = ControlCycle(line, IDS, fast=fast, registers=(116, address, 6))
        cycle.write_goals(np.array(goals, np.int32))
        line.clock.sleep_until_s(0.02)
        reply = cycle.read()
        seen.append((reply.data.tolist(), reply.valid.tolist(), line.clock.now_s(), line.busy_s))
    assert seen[0] == seen[1]


@pytest.mark.parametrize("pause_s", [0.0, 2e-4, 2e-3])
def test_a_packet_between_request_and_reply_is_what_it_was(pause_s: float) -> None:
    seen = []
    for kind in (SimLine, Called):
        line = make(kind)
        cycle = ControlCycle(line, IDS)
        cycle.begin_read()
        line.clock.advance(pause_s)
        line.write(PING)
        reply = cycle.finish_read()
        seen.append((reply.valid.tolist(), line.clock.now_s(), line.busy_s, line.collisions))
    assert seen[0] == seen[1]


def test_a_tap_hears_every_packet_from_when_it_is_there() -> None:
    heard: list[tuple[bool, bytes]] = []
    line = make(SimLine)
    cycle = ControlCycle(line, IDS)
    cycle.read()
    line.taps.append(lambda time_s, host, data: heard.append((host, data)))
    reply = cycle.read()
    assert reply.flawless
    assert [host for host, _ in heard] == [True, False]
    assert reply.data[2].tobytes() in heard[1][1]


def test_a_closed_port_is_told_as_always() -> None:
    line = make(SimLine)
    cycle = ControlCycle(line, IDS)
    cycle.read()
    line.disconnect()
    with pytest.raises(PortError, match="vanished"):
        cycle.read()
    line.reconnect()
    line.openPort()
    assert cycle.read().flawless
