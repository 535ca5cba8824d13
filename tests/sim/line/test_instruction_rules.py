"""What each instruction does and answers where something is unusual; e-manual, Protocol 2.0."""

import pytest

from snakewalk.drivers.protocol.crc import crc16
from snakewalk.drivers.protocol.packet import (
    Instruction,
    InstructionPacket,
    ResultError,
    encode_instruction,
)
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.bench import BenchPlant
from tests.helpers.bus import ALL, a_line, ask, exchange, goals, group_params, read, write
from tests.sim.faults.test_faults import wait

POSITION = bytes((132, 0, 4, 0))
LED_ON = bytes((65, 0, 1))
ANSWERED_FROM = {
    "ping": (0, 1, Instruction.PING, b""),
    "broadcast ping": (0, ALL, Instruction.PING, b""),
    "read": (1, 1, Instruction.READ, POSITION),
    "sync read": (1, ALL, Instruction.SYNC_READ, POSITION + b"\1"),
    "fast sync read": (1, ALL, Instruction.FAST_SYNC_READ, POSITION + b"\1"),
    "bulk read": (1, ALL, Instruction.BULK_READ, b"\1" + POSITION),
    "fast bulk read": (1, ALL, Instruction.FAST_BULK_READ, b"\1" + POSITION),
    "write": (2, 1, Instruction.WRITE, LED_ON),
    "reg write": (2, 1, Instruction.REG_WRITE, LED_ON),
    "action": (2, 1, Instruction.ACTION, b""),
    "clear": (2, 1, Instruction.CLEAR, b"\x02ERCL"),
    "backup": (2, 1, Instruction.CONTROL_TABLE_BACKUP, b"\x01CTRL"),
    "reboot": (2, 1, Instruction.REBOOT, b""),
    "factory reset": (2, 1, Instruction.FACTORY_RESET, b"\x02"),
    "unknown": (2, 1, 0x77, b""),
    "broadcast read": (3, ALL, Instruction.READ, POSITION),
    "broadcast write": (3, ALL, Instruction.WRITE, LED_ON),
    "sync write": (3, ALL, Instruction.SYNC_WRITE, b"\x41\0\1\0\1\1"),
    "bulk write": (3, ALL, Instruction.BULK_WRITE, b"\1\x41\0\1\0\1"),
}
"""Least Status Return Level(68) at which an answer comes; 3: never."""


@pytest.mark.parametrize("level", [0, 1, 2])
@pytest.mark.parametrize("name", ANSWERED_FROM)
def test_status_return_level_of_every_instruction(name: str, level: int) -> None:
    least, servo, code, params = ANSWERED_FROM[name]
    line = a_line(1)
    write(line, 1, 68, level, 1)
    assert len(ask(line, servo, code, params)) == int(level >= least)


# read


@pytest.mark.parametrize(
    ("params", "error"),
    [
        (bytes((132, 0)), ResultError.DATA_LENGTH),
        (bytes((132, 0, 0, 0)), ResultError.ACCESS),
        (bytes((0xFF, 3, 2, 0)), ResultError.ACCESS),  # across the table's end
        (bytes((0xFF, 3, 1, 0)), ResultError.ACCESS),  # inside, but no register
        (bytes((0x95, 2, 1, 0)), 0),  # the last one, 661
    ],
)
def test_reads_out_of_the_table_are_refused(params: bytes, error: int) -> None:
    (status,) = ask(a_line(1), 1, Instruction.READ, params)
    assert status.error == error
    assert bool(status.params) == (not error)


@pytest.mark.parametrize(
    ("code", "waits"), [(Instruction.SYNC_READ, 2), (Instruction.FAST_SYNC_READ, 1)]
)
def test_return_delay_is_two_microseconds_a_unit(code: int, waits: int) -> None:
    times_s = []
    for delay in (0, 200):
        line = a_line(2, delay=delay)
        start_s = line.clock.now_s()
        params = group_params(132, 4, (1, 2))
        line.write(encode_instruction(InstructionPacket(ALL, code, params)))
        line.read_until(30 if code == Instruction.SYNC_READ else 24, 1.0)
        times_s.append(line.clock.now_s() - start_s)
    assert times_s[1] - times_s[0] == pytest.approx(waits * 400e-6)


# reg write and action


def test_a_second_reg_write_takes_the_place_of_the_first() -> None:
    line = a_line(1)
    for value in (1_000, 1_500):
        params = bytes((116, 0)) + value.to_bytes(4, "little")
        assert ask(line, 1, Instruction.REG_WRITE, params)[0].error == 0
    assert read(line, 1, 69, 1) == 1
    assert read(line, 1, 116, 4) == 2_048
    assert ask(line, 1, Instruction.ACTION)[0].error == 0
    assert (read(line, 1, 69, 1), read(line, 1, 116, 4)) == (0, 1_500)
    assert ask(line, 1, Instruction.ACTION)[0].error == ResultError.INSTRUCTION


@pytest.mark.parametrize(
    ("params", "error"),
    [
        (b"", ResultError.DATA_LENGTH),
        (bytes((116, 0)), ResultError.DATA_LENGTH),
        (bytes((116, 0, 1, 2)), ResultError.DATA_LENGTH),
        (bytes((132, 0, 1, 2, 3, 4)), ResultError.ACCESS),
        (bytes((116, 0, 0, 0x20, 0, 0)), ResultError.DATA_LIMIT),
        (bytes((7, 0, 253)), ResultError.DATA_RANGE),
    ],
)
def test_a_wrong_reg_write_is_refused_and_not_kept(params: bytes, error: int) -> None:
    line = a_line(1)
    assert ask(line, 1, Instruction.REG_WRITE, params)[0].error == error
    assert read(line, 1, 69, 1) == 0
    assert ask(line, 1, Instruction.ACTION)[0].error == ResultError.INSTRUCTION


def test_action_takes_no_parameters_and_keeps_what_is_registered() -> None:
    line = a_line(1)
    ask(line, 1, Instruction.REG_WRITE, LED_ON)
    assert ask(line, 1, Instruction.ACTION, b"\0")[0].error == ResultError.DATA_LENGTH
    assert (read(line, 1, 69, 1), read(line, 1, 65, 1)) == (1, 0)


def test_action_judges_again() -> None:
    line = a_line(1)
    ask(line, 1, Instruction.REG_WRITE, bytes((9, 0, 50)))
    write(line, 1, 64, 1, 1)
    assert ask(line, 1, Instruction.ACTION)[0].error == ResultError.ACCESS
    assert read(line, 1, 9, 1) == 0


def test_action_with_a_goal_wakes_a_servo_that_goals_wake() -> None:
    line = a_line(1)
    write(line, 1, 10, 8, 1)
    ask(line, 1, Instruction.REG_WRITE, bytes((116, 0)) + (2_100).to_bytes(4, "little"))
    assert read(line, 1, 64, 1) == 0
    assert ask(line, 1, Instruction.ACTION)[0].error == 0
    assert (read(line, 1, 64, 1), read(line, 1, 116, 4)) == (1, 2_100)


def test_reboot_forgets_what_is_registered() -> None:
    line = a_line(1)
    ask(line, 1, Instruction.REG_WRITE, LED_ON)
    ask(line, 1, Instruction.REBOOT)
    assert ask(line, 1, Instruction.ACTION)[0].error == ResultError.INSTRUCTION


# secondary ID


def test_a_secondary_id_reads_nothing_and_writes_no_eeprom() -> None:
    line = a_line(2)
    for servo in (1, 2):
        write(line, servo, 12, 100, 1)
    assert ask(line, 100, Instruction.READ, POSITION) == []
    assert ask(line, 100, Instruction.PING) == []
    for code in (Instruction.WRITE, Instruction.REG_WRITE):
        assert ask(line, 100, code, bytes((31, 0, 50))) == []
    ask(line, ALL, Instruction.ACTION)
    assert line.bank["Temperature Limit"].tolist() == [80, 80]
    ask(line, 100, Instruction.REG_WRITE, LED_ON)
    ask(line, 100, Instruction.ACTION)
    assert line.bank["LED"].tolist() == [1, 1]
    ask(line, 100, Instruction.FACTORY_RESET, b"\x02")
    assert line.bank["Secondary(Shadow) ID"].tolist() == [100, 100]


def test_a_secondary_id_from_253_on_is_none() -> None:
    line = a_line(1)
    for each in (252, 253):
        write(line, 1, 12, each, 1)
        assert line.directory.secondary(each) == ([0] if each == 252 else [])


# factory reset


@pytest.mark.parametrize(("option", "left"), [(0xFF, (1, 1)), (0x01, (7, 1)), (0x02, (7, 3))])
def test_factory_reset_three_ways(option: int, left: tuple[int, int]) -> None:
    line = a_line(1)
    write(line, 1, 7, 7, 1)
    for address, value, size in ((31, 50, 1), (48, 3_000, 4), (84, 300, 2), (65, 1, 1)):
        assert write(line, 7, address, value, size) == 0
    (status,) = ask(line, 7, Instruction.FACTORY_RESET, bytes((option,)))
    assert (status.servo_id, status.error) == (7, 0)
    servo, baud = left
    if baud == 1:
        assert ask(line, servo, Instruction.PING) == []
        line.setBaudRate(57_600)
    shown = [read(line, servo, a, n) for a, n in ((7, 1), (8, 1), (31, 1), (48, 4), (84, 2))]
    assert shown == [servo, baud, 80, 4_095, 800]
    assert (read(line, servo, 65, 1), read(line, servo, 9, 1, signed=False)) == (0, 250)


@pytest.mark.parametrize("params", [b"", b"\x03", b"\x01\x01"])
def test_another_factory_reset_is_refused(params: bytes) -> None:
    line = a_line(1)
    write(line, 1, 31, 50, 1)
    assert ask(line, 1, Instruction.FACTORY_RESET, params)[0].error == ResultError.DATA_RANGE
    assert read(line, 1, 31, 1) == 50


# clear


def test_turns_are_cleared_at_rest_only_and_by_the_right_word() -> None:
    plant = BenchPlant(1, dry_n_m=0.0)
    line = a_line(1)
    line = SimLine(line.bank, plant)
    for address, value, size in ((11, 4, 1), (64, 1, 1), (116, 40_000, 4)):
        assert write(line, 1, address, value, size) == 0
    wait(line, 1.0)
    turns = b"\x01DXL\x22"
    assert ask(line, 1, Instruction.CLEAR, turns)[0].error == ResultError.RESULT_FAIL
    assert read(line, 1, 132, 4) > 4_096
    write(line, 1, 64, 0, 1)
    plant.velocity_rad_s[:] = 0.0
    before = read(line, 1, 132, 4)
    for wrong in (b"\x01DXL\x23", b"\x03ERCL", b""):
        assert ask(line, 1, Instruction.CLEAR, wrong)[0].error == ResultError.DATA_RANGE
    assert ask(line, 1, Instruction.CLEAR, turns)[0].error == 0
    assert read(line, 1, 132, 4) == pytest.approx(before % 4_096, abs=2)


# locks and limits, whatever packet brings the value


def packet(code: int, address: int, value: int, size: int) -> bytes:
    """One instruction that writes a register of servo 1."""
    data = value.to_bytes(size, "little", signed=value < 0)
    at, length = address.to_bytes(2, "little"), size.to_bytes(2, "little")
    params = {
        Instruction.WRITE: at + data,
        Instruction.REG_WRITE: at + data,
        Instruction.SYNC_WRITE: at + length + b"\1" + data,
        Instruction.BULK_WRITE: b"\1" + at + length + data,
    }[Instruction(code)]
    alone = code in (Instruction.WRITE, Instruction.REG_WRITE)
    return encode_instruction(InstructionPacket(1 if alone else ALL, code, params))


WRITES = (Instruction.WRITE, Instruction.REG_WRITE, Instruction.SYNC_WRITE, Instruction.BULK_WRITE)


@pytest.mark.parametrize("code", WRITES)
@pytest.mark.parametrize("address", [7, 8, 11, 31, 60, 63])
def test_the_eeprom_is_locked_to_every_kind_of_write(code: int, address: int) -> None:
    line = a_line(1)
    write(line, 1, 64, 1, 1)
    before = line.bank.table[0, :64].tobytes()
    exchange(line, packet(code, address, 1, 1))
    exchange(line, encode_instruction(InstructionPacket(1, Instruction.ACTION)))
    assert line.bank.table[0, :64].tobytes() == before


@pytest.mark.parametrize("code", WRITES)
@pytest.mark.parametrize(
    ("limits", "address", "size", "good", "bad"),
    [
        (((36, 500, 2),), 100, 2, -500, 501),
        (((38, 300, 2),), 102, 2, -300, 301),
        (((44, 100, 4),), 104, 4, -100, 101),
        (((48, 3_000, 4), (52, 1_000, 4)), 116, 4, 1_000, 999),
        (((48, 3_000, 4), (52, 1_000, 4)), 116, 4, 3_000, 3_001),
        (((11, 4, 1),), 116, 4, -1_048_575, -1_048_576),
        (((11, 5, 1),), 116, 4, 1_048_575, 1_048_576),
    ],
)
def test_a_goal_beyond_its_limit_is_never_taken(
    code: int,
    limits: tuple[tuple[int, int, int], ...],
    address: int,
    size: int,
    good: int,
    bad: int,
) -> None:
    line = a_line(1)
    for limit in limits:
        assert write(line, 1, *limit) == 0
    for value in (good, bad):
        exchange(line, packet(code, address, value, size))
        exchange(line, encode_instruction(InstructionPacket(1, Instruction.ACTION)))
    assert read(line, 1, address, size) == good


# duplicate IDs


def twins() -> SimLine:
    line = a_line(3)
    line.bank["ID"][2] = 2
    line.bank["Moving Threshold"][2] = 99
    line.refresh_ids()
    return line


def test_twins_both_obey_and_garble_every_kind_of_read() -> None:
    line = twins()
    assert [s.servo_id for s in ask(line, 2, Instruction.WRITE, LED_ON)] == [2]
    assert line.bank["LED"].tolist() == [0, 1, 1]
    exchange(line, goals({2: 2_222}))
    assert line.bank["Goal Position"].tolist() == [2_048, 2_222, 2_222]
    block = bytes((24, 0, 4, 0))
    assert ask(line, 2, Instruction.READ, block) == []
    assert [s.servo_id for s in ask(line, ALL, Instruction.SYNC_READ, block + b"\1\2")] == [1]
    assert ask(line, ALL, Instruction.FAST_SYNC_READ, block + b"\1\2") == []
    assert [s.servo_id for s in ask(line, ALL, Instruction.PING)] == [1, 2]
    line.bank["Firmware Version"][2] = 47
    assert [s.servo_id for s in ask(line, ALL, Instruction.PING)] == [1]


# stuffing


def test_stuffing_is_strict_both_ways() -> None:
    """A header in the data of a question must be stuffed; and it is in the data of an answer."""
    line = a_line(1)
    data = bytes((0xFF, 0xFF, 0xFD))
    good = encode_instruction(InstructionPacket(1, Instruction.WRITE, bytes((224, 0)) + data))
    assert data + b"\xfd" in good
    assert len(exchange(line, good)) == 11
    answer = exchange(
        line, encode_instruction(InstructionPacket(1, Instruction.READ, bytes((224, 0, 3, 0))))
    )
    assert data + b"\xfd" in answer[5:]
    assert read(line, 1, 224, 2, signed=False) == 0xFFFF
    write(line, 1, 224, 0, 1)
    bare = bytearray(good.replace(data + b"\xfd", data))
    bare[5] -= 1
    bare[-2:] = crc16(bytes(bare[:-2])).to_bytes(2, "little")
    assert exchange(line, bytes(bare)) == b""
    assert read(line, 1, 224, 1) == 0


def span(address: int, length: int) -> bytes:
    return address.to_bytes(2, "little") + length.to_bytes(2, "little")


@pytest.mark.parametrize(
    ("model", "address"),
    [("XM430-W350", 14), ("XM430-W350", 150), ("XM430-W350", 700), ("XL330-M288", 578)],
)
def test_an_address_without_a_register_is_an_access_error(model: str, address: int) -> None:
    line = a_line(2, model=model)
    (status,) = ask(line, 1, Instruction.READ, span(address, 2))
    assert (status.error, status.params) == (ResultError.ACCESS, b"")
    group = ask(line, ALL, Instruction.SYNC_READ, group_params(address, 2, [1, 2]))
    assert [(s.error, s.params) for s in group] == [(ResultError.ACCESS, b"")] * 2
    write = address.to_bytes(2, "little") + b"\x01"
    (status,) = ask(line, 1, Instruction.WRITE, write)
    assert status.error == ResultError.ACCESS


def test_a_block_that_begins_at_a_register_reads_gaps_as_zero() -> None:
    line = a_line(1)
    (status,) = ask(line, 1, Instruction.READ, span(0, 147))
    assert (status.error, len(status.params)) == (0, 147)
    assert status.params[13:20:6] == b"\x02\x00"  # Protocol Type(13); 19 is a gap


@pytest.mark.parametrize(
    ("code", "params"),
    [
        (Instruction.SYNC_READ, group_params(132, 4, [1, 2])),
        (Instruction.FAST_SYNC_READ, group_params(132, 4, [1, 2])),
        (Instruction.BULK_READ, bytes((1, 132, 0, 4, 0))),
        (Instruction.FAST_BULK_READ, bytes((1, 132, 0, 4, 0))),
        (Instruction.SYNC_WRITE, group_params(65, 1, [1]) + b"\x01"),
        (Instruction.BULK_WRITE, bytes((1, 65, 0, 1, 0, 1))),
    ],
)
def test_group_instructions_have_the_broadcast_id(code: int, params: bytes) -> None:
    line = a_line(2)
    (status,) = ask(line, 1, code, params)
    assert (status.servo_id, status.error, status.params) == (1, ResultError.INSTRUCTION, b"")
    assert read(line, 1, 65, 1) == 0
