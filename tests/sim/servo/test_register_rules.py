"""Access, ranges, limits and locks: e-manual XM430-W350, control table, and Protocol 2.0, Error."""

import pytest

from snakewalk.drivers.errors import ControlTableError
from snakewalk.drivers.protocol.packet import Instruction, ResultError
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.bank import ServoBank
from tests.helpers.bus import ALL, a_line, ask, read, write


def test_a_new_servo_has_the_manuals_initial_values() -> None:
    line = SimLine(ServoBank([7]), a_line(1).firmware.plant)
    manual = {(0, 2): 1020, (8, 1): 3, (9, 1): 250, (11, 1): 3, (24, 4): 10, (31, 1): 80}
    manual |= {(32, 2): 160, (34, 2): 95, (36, 2): 885, (38, 2): 1193, (44, 4): 200}
    manual |= {(48, 4): 4095, (52, 4): 0, (63, 1): 52, (64, 1): 0, (68, 1): 2, (84, 2): 800}
    manual |= {(76, 2): 1920, (78, 2): 100, (98, 1): 0, (100, 2): 885, (108, 4): 0}
    for (address, size), value in manual.items():
        assert read(line, 7, address, size, signed=False) == value, address


@pytest.mark.parametrize(
    ("address", "value", "size", "error"),
    [
        (132, 0, 4, ResultError.ACCESS),  # Present Position is read-only
        (14, 0, 1, ResultError.ACCESS),  # nothing there
        (116, 9, 2, ResultError.DATA_LENGTH),  # a register of 4 bytes
        (116, 4096, 4, ResultError.DATA_LIMIT),  # above Max Position Limit
        (116, -1, 4, ResultError.DATA_LIMIT),
        (116, 4095, 4, ResultError.NONE),
        (104, 201, 4, ResultError.DATA_LIMIT),  # above Velocity Limit
        (100, 886, 2, ResultError.DATA_RANGE),
        (7, 253, 1, ResultError.DATA_RANGE),
        (7, 252, 1, ResultError.NONE),
        (9, 255, 1, ResultError.DATA_RANGE),
        (11, 2, 1, ResultError.DATA_RANGE),  # no such operating mode
        (11, 5, 1, ResultError.NONE),
        (84, 16384, 2, ResultError.DATA_RANGE),
        (98, 128, 1, ResultError.DATA_RANGE),
    ],
)
def test_write_is_judged(address: int, value: int, size: int, error: int) -> None:
    line = a_line(1)
    before = line.bank.table.copy()
    assert write(line, 1, address, value, size) == error
    changed = (line.bank.table != before)[0, address : address + size].any()
    assert not (error and changed)
    if not error:
        stored = line.bank.table[0, address : address + size].tobytes()
        assert int.from_bytes(stored, "little") == value


def test_a_block_is_written_whole_or_not_at_all() -> None:
    line = a_line(1)
    block = (7).to_bytes(4, "little") + (5).to_bytes(4, "little") + (9000).to_bytes(4, "little")
    (status,) = ask(line, 1, Instruction.WRITE, bytes((108, 0)) + block)
    assert status.error == ResultError.DATA_LIMIT
    assert line.bank["Profile Acceleration"][0] == 0


def test_eeprom_is_locked_while_torque_is_on() -> None:
    line = a_line(1)
    assert write(line, 1, 64, 1, 1) == 0
    assert write(line, 1, 9, 10, 1) == ResultError.ACCESS
    assert write(line, 1, 84, 400, 2) == 0  # RAM stays open
    assert write(line, 1, 64, 0, 1) == 0
    assert write(line, 1, 9, 10, 1) == 0


@pytest.mark.parametrize(("level", "answers"), [(0, (1, 0, 0)), (1, (1, 1, 0)), (2, (1, 1, 1))])
def test_status_return_level(level: int, answers: tuple[int, int, int]) -> None:
    line = a_line(1)
    write(line, 1, 68, level, 1)
    got = (
        len(ask(line, 1, Instruction.PING)),
        len(ask(line, 1, Instruction.READ, bytes((132, 0, 4, 0)))),
        len(ask(line, 1, Instruction.WRITE, bytes((65, 0, 1)))),
    )
    assert got == answers
    assert line.bank["LED"][0] == 1


def test_broadcast_write_reaches_all_and_nobody_answers() -> None:
    line = a_line(3)
    assert ask(line, ALL, Instruction.WRITE, bytes((65, 0, 1))) == []
    assert line.bank["LED"].tolist() == [1, 1, 1]


def test_action_without_reg_write_and_unknown_instruction() -> None:
    line = a_line(1)
    for code in (Instruction.ACTION, 0x77):
        (status,) = ask(line, 1, code)
        assert status.error == ResultError.INSTRUCTION


def test_another_id_and_another_baud_rate_are_another_servo() -> None:
    line = a_line(2)
    write(line, 1, 7, 40, 1)
    assert ask(line, 1, Instruction.PING) == []
    assert len(ask(line, 40, Instruction.PING)) == 1
    write(line, 40, 8, 1, 1)
    assert ask(line, 40, Instruction.PING) == []
    line.setBaudRate(57_600)
    assert [status.servo_id for status in ask(line, ALL, Instruction.PING)] == [40]


def test_bulk_write_and_extended_range() -> None:
    line = a_line(2)
    write(line, 2, 11, 4, 1)
    goals = bytes((1, 116, 0, 4, 0)) + (1000).to_bytes(4, "little")
    goals += bytes((2, 116, 0, 4, 0)) + (-5000).to_bytes(4, "little", signed=True)
    assert ask(line, ALL, Instruction.BULK_WRITE, goals) == []
    assert line.bank["Goal Position"].tolist() == [1000, -5000]


def test_factory_reset_keeps_what_was_asked() -> None:
    line = a_line(2)
    write(line, 2, 84, 123, 2)
    ask(line, 2, Instruction.FACTORY_RESET, b"\x02")
    assert (line.bank["ID"][1], line.bank["Baud Rate"][1]) == (2, 3)
    assert line.bank["Position P Gain"][1] == 800
    assert line.bank["Return Delay Time"][1] == 250


@pytest.mark.parametrize(
    ("ids", "model", "baud", "said"),
    [
        ([1, 1], "XM430-W350", 57_600, "share an ID"),
        ([1, 253], "XM430-W350", 57_600, "ID 253: a servo has 0 to 252"),
        ([1], "XL-320", 57_600, "XL-320: no such servo model"),
        ([1], "XM430-W350", 123, "123 baud"),
        ([1], "XL330-M288", 4_500_000, "4500000 baud: XL330-M288 has"),
    ],
)
def test_a_bank_refuses_what_no_chain_has(ids: list[int], model: str, baud: int, said: str) -> None:
    with pytest.raises(ControlTableError, match=said):
        ServoBank(ids, model, baud)
