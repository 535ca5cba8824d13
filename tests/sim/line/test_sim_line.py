"""The wire: time, half duplex, silence, and the vectorised way against the general one."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from snakewalk.drivers.errors import PortError
from snakewalk.drivers.protocol.packet import Instruction, InstructionPacket, encode_instruction
from snakewalk.drivers.protocol.parser import PacketParser
from snakewalk.sim.line.clock import SimClock
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant
from tests.helpers.bus import ALL, a_line, ask, exchange, group_params, rad, send, write

FAST, PLAIN = Instruction.FAST_SYNC_READ, Instruction.SYNC_READ


def sync_read(code: int, joints: int, address: int = 126, length: int = 10) -> bytes:
    params = group_params(address, length, range(1, joints + 1))
    return encode_instruction(InstructionPacket(ALL, code, params))


def sync_goals(ticks: list[int]) -> bytes:
    params = bytes((116, 0, 4, 0))
    for servo, tick in enumerate(ticks, 1):
        params += bytes((servo,)) + tick.to_bytes(4, "little", signed=True)
    return encode_instruction(InstructionPacket(ALL, Instruction.SYNC_WRITE, params))


def test_clock_only_moves_on() -> None:
    clock = SimClock(5.0)
    clock.sleep_until_s(4.0)
    assert clock.now_s() == 5.0
    clock.advance(0.25)
    assert clock.now_s() == 5.25
    with pytest.raises(ValueError, match="back"):
        clock.advance(-1.0)


@pytest.mark.parametrize(
    ("code", "baud", "cycle_ms"),
    [
        (PLAIN, 1_000_000, 4.60),
        (FAST, 1_000_000, 3.56),
        (PLAIN, 4_000_000, 1.15),
        (FAST, 4_000_000, 0.89),
    ],
)
def test_cycle_of_16_servos_takes_its_time_on_the_wire(
    code: int, baud: int, cycle_ms: float
) -> None:
    line = SimLine(ServoBank(range(1, 17), baud=baud), BenchPlant(16))
    for servo in range(1, 17):
        write(line, servo, 9, 0, 1)
    length = 16 * 21 if code == PLAIN else 8 + 16 * 14
    start_s, busy_s = line.clock.now_s(), line.busy_s
    line.write(sync_goals([2048] * 16) + sync_read(code, 16))
    assert len(line.read_until(length, start_s + 1.0)) == length
    assert line.clock.now_s() - start_s == pytest.approx(cycle_ms * 1e-3, abs=1e-9)
    assert line.busy_s - busy_s == pytest.approx(cycle_ms * 1e-3, abs=1e-9)


def test_return_delay_adds_up_in_a_plain_sync_read() -> None:
    times_s = []
    for delay in (0, 250):
        line = a_line(4, delay=delay)
        start_s = line.clock.now_s()
        line.write(sync_read(PLAIN, 4))
        line.read_until(4 * 21, start_s + 1.0)
        times_s.append(line.clock.now_s() - start_s)
    assert times_s[1] - times_s[0] == pytest.approx(4 * 500e-6)


def test_reads_move_the_clock_only_as_far_as_needed() -> None:
    line = a_line(1)
    start_s = line.clock.now_s()
    line.write(encode_instruction(InstructionPacket(1, Instruction.PING)))
    assert line.clock.now_s() == start_s
    assert line.read_until(4, start_s + 1.0) == b"\xff\xff\xfd\x00"
    assert line.clock.now_s() - start_s == pytest.approx(14 * 10e-6)  # 10 bytes out, 4 back
    assert len(line.read_until(99, start_s + 0.03)) == 10
    assert line.clock.now_s() - start_s == pytest.approx(0.03)


def test_clearing_the_port_leaves_what_is_still_under_way() -> None:
    line = a_line(1)
    line.write(encode_instruction(InstructionPacket(1, Instruction.PING)))
    line.clock.advance(100e-6 + 50e-6)  # five of fourteen bytes have arrived
    line.clearPort()
    assert len(line.read_until(99, line.clock.now_s() + 0.01)) == 9


def test_draining_waits_until_the_line_is_quiet() -> None:
    line = a_line(2)
    line.write(sync_read(PLAIN, 2))
    start_s = line.clock.now_s()
    assert line.drain_until_quiet(1e-3) == 42
    wire_s = (16 + 42) * 10e-6
    assert line.clock.now_s() - start_s == pytest.approx(wire_s + 1e-3, abs=1e-8)
    assert line.drain_until_quiet(1e-3) == 0


def test_talking_into_an_answer_destroys_both() -> None:
    line = a_line(1)
    line.write(encode_instruction(InstructionPacket(1, Instruction.PING)))
    line.clock.advance(150e-6)
    line.write(encode_instruction(InstructionPacket(1, Instruction.WRITE, bytes((65, 0, 1)))))
    assert len(line.read_until(99, line.clock.now_s() + 0.01)) == 5
    assert line.bank["LED"][0] == 0
    assert line.collisions == 1


def test_a_packet_right_behind_a_question_collides_with_the_answer() -> None:
    line = a_line(1)
    ping = encode_instruction(InstructionPacket(1, Instruction.PING))
    assert exchange(line, ping + ping) == b""
    assert line.collisions == 1
    assert len(send(line, ping)) == 1


@pytest.mark.parametrize("code", [PLAIN, FAST])
def test_behind_a_missing_servo_all_are_silent(code: int) -> None:
    line = a_line(3)
    params = group_params(132, 4, [1, 9, 2])
    raw = exchange(line, encode_instruction(InstructionPacket(ALL, code, params)))
    if code == PLAIN:
        assert [status.servo_id for status in PacketParser().feed(raw)] == [1]
    else:
        assert len(raw) == 8 + 8  # a header that announces three, and one part
        assert int.from_bytes(raw[5:7], "little") == 1 + 3 * 8


def test_a_damaged_instruction_is_not_heard() -> None:
    line = a_line(2)
    raw = bytearray(sync_goals([1000, 1000]))
    raw[14] ^= 1
    assert exchange(line, bytes(raw)) == b""
    assert line.bank["Goal Position"].tolist() == [2048, 2048]


@given(
    ticks=st.lists(st.integers(-70_000, 70_000), min_size=3, max_size=3),
    code=st.sampled_from([PLAIN, FAST]),
    block=st.sampled_from([(126, 10), (132, 4), (116, 30), (0, 147), (144, 3)]),
    errors=st.lists(st.sampled_from([0, 0x20]), min_size=3, max_size=3),
    goals=st.lists(st.integers(-20, 4_200), min_size=3, max_size=3),
)
@settings(max_examples=60)
def test_group_path_says_what_the_general_one_says(
    ticks: list[int], code: int, block: tuple[int, int], errors: list[int], goals: list[int]
) -> None:
    """-1 ticks and less hold FF FF; 0xFD behind them must be stuffed in plain reads only."""
    answers = []
    for general in (False, True):
        bank = ServoBank([1, 2, 3])
        bank["Operating Mode"][:] = [4, 4, 3]
        line = SimLine(bank, BenchPlant(3, start_rad=[rad(t) for t in ticks], dry_n_m=1.0))
        bank["Hardware Error Status"][:] = errors
        if general:
            line._group.execute = lambda *_, **__: None  # type: ignore[method-assign]
        line.write(sync_goals(goals) + sync_read(code, 3, *block))
        raw = line.read_until(10_000, 0.05)
        line.firmware.refresh()
        answers.append((raw, bank.table.tobytes(), line.firmware.drive.goal_rad.tolist()))
    assert answers[0] == answers[1]
    (last,) = PacketParser().feed(answers[0][0])[-1:]
    assert last.servo_id == (ALL if code == FAST else 3)


def test_a_header_in_the_data_is_stuffed_in_plain_answers_and_not_in_fast_ones() -> None:
    line = a_line(2)
    line.bank["Operating Mode"][:] = 4
    line.firmware.apply_registers()
    block = bytes((0xFF, 0xFF, 0xFD, 0x00))
    line.bank.table[0, 116:120] = np.frombuffer(block, np.uint8)
    plain = exchange(line, sync_read(PLAIN, 2, 116, 4))
    assert len(plain) == 15 + 16
    assert [s.params for s in PacketParser().feed(plain)] == [block, b"\x00\x08\x00\x00"]
    fast = exchange(line, sync_read(FAST, 2, 116, 4))
    assert len(fast) == 8 + 16
    assert block in fast[8:]


def test_a_packet_cut_short_does_not_swallow_the_next() -> None:
    line = a_line(1)
    ping = encode_instruction(InstructionPacket(1, Instruction.PING))
    assert exchange(line, ping[:8]) == b""
    assert len(send(line, ping)) == 1


def test_tampering_loses_doubles_and_changes_answers() -> None:
    line = a_line(3)
    fates = iter([[], None, b"x"])

    def tamper(answer: bytes) -> list[bytes]:
        fate = next(fates)
        return fate if fate == [] else [answer, answer] if fate is None else [fate]

    line.tamper = tamper
    answers = exchange(line, sync_read(PLAIN, 3, 132, 4))
    line.tamper = None
    second = ask(line, 2, Instruction.READ, bytes((132, 0, 4, 0)))[0]
    packets = PacketParser().feed(answers)
    assert packets == [second, second]
    assert answers.endswith(b"x")


def test_two_runs_are_the_same_bit_for_bit() -> None:
    def run() -> list[tuple[float, bytes]]:
        line = a_line(4)
        for servo in range(1, 5):
            write(line, servo, 64, 1, 1)
        seen = []
        for k in range(40):
            goals = [2048 + round(300 * np.sin(0.3 * k + j)) for j in range(4)]
            line.write(sync_goals(goals) + sync_read(FAST, 4))
            seen.append((line.clock.now_s(), line.read_until(64, line.clock.now_s() + 0.01)))
            line.clock.sleep_until_s(0.1 + 0.02 * k)
        return seen

    assert run() == run()


def test_draining_a_line_that_never_falls_quiet_ends() -> None:
    line = a_line()
    for k in range(1, 2000):
        line._rx_queue.add(line.clock.now_s() + 0.003 * k, b"\x55")
    assert 0 < line.drain_until_quiet(0.004) < 100
    assert line.clock.now_s() < 0.2


def test_the_next_event_is_the_first_of_an_arrival_and_an_end_of_a_packet() -> None:
    line = a_line(1)
    assert line.next_event_s() is None
    start_s = line.clock.now_s()
    ping = encode_instruction(InstructionPacket(1, Instruction.PING))
    line.write(ping)
    assert line.next_event_s() == pytest.approx(start_s + len(ping) * 10e-6)
    line.clock.advance(len(ping) * 10e-6)
    line.settle()
    first_s = line.next_event_s()
    assert first_s is not None
    assert first_s == pytest.approx(line.clock.now_s() + 10e-6)
    line.read_until(99, line.clock.now_s() + 0.01)
    assert line.next_event_s() is None


def test_a_closed_or_vanished_port_cannot_be_read() -> None:
    line = a_line(1)
    line.closePort()
    with pytest.raises(PortError, match="the port is closed"):
        line.read_until(1, line.clock.now_s() + 1.0)
    assert line.openPort()
    line.disconnect()
    with pytest.raises(PortError, match="the port has vanished"):
        line.read_until(1, line.clock.now_s() + 1.0)
