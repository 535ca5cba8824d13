"""The worked packets of the e-manual, Protocol 2.0, byte for byte.

The manual's servos are XM430-W210 (model number 1030, firmware 38).
"""

import pytest

from snakewalk.drivers.protocol.packet import encode_fast
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant
from tests.helpers.bus import exchange, rad

OK_1 = "FF FF FD 00 01 04 00 55 00 A1 0C"
PONG_1 = "FF FF FD 00 01 07 00 55 00 06 04 26 65 5D"
POSITION_1 = "FF FF FD 00 01 08 00 55 00 A6 00 00 00 8C C0"
REG_WRITE = "FF FF FD 00 01 09 00 04 68 00 C8 00 00 00 AE 8E"


@pytest.fixture
def line() -> SimLine:
    bank = ServoBank([1, 2], "XM430-W210")
    bank["Firmware Version"][:] = 38
    line = SimLine(bank, BenchPlant(2, start_rad=[rad(166), rad(2079)]))
    line.bank["Operating Mode"][:] = 3
    return line


def hexed(data: bytes) -> str:
    return data.hex(" ").upper()


@pytest.mark.parametrize(
    ("sent", "answered"),
    [
        pytest.param("FF FF FD 00 01 03 00 01 19 4E", PONG_1, id="ping"),
        pytest.param(
            "FF FF FD 00 FE 03 00 01 31 42",
            PONG_1 + " FF FF FD 00 02 07 00 55 00 06 04 26 6F 6D",
            id="broadcast ping",
        ),
        pytest.param("FF FF FD 00 01 07 00 02 84 00 04 00 1D 15", POSITION_1, id="read"),
        pytest.param("FF FF FD 00 01 09 00 03 74 00 00 02 00 00 CA 89", OK_1, id="write"),
        pytest.param(REG_WRITE, OK_1, id="reg write"),
        pytest.param("FF FF FD 00 01 04 00 06 01 A1 E6", OK_1, id="factory reset"),
        pytest.param("FF FF FD 00 01 03 00 08 2F 4E", OK_1, id="reboot"),
        pytest.param("FF FF FD 00 01 08 00 10 01 44 58 4C 22 B1 DC", OK_1, id="clear"),
        pytest.param("FF FF FD 00 01 08 00 20 01 43 54 52 4C 16 F5", OK_1, id="backup"),
        pytest.param(
            "FF FF FD 00 FE 09 00 82 84 00 04 00 01 02 CE FA",
            POSITION_1 + " FF FF FD 00 02 08 00 55 00 1F 08 00 00 BA BE",
            id="sync read",
        ),
        pytest.param(
            "FF FF FD 00 FE 11 00 83 74 00 04 00 01 96 00 00 00 02 AA 00 00 00 82 87",
            "",
            id="sync write",
        ),
        pytest.param(
            "FF FF FD 00 FE 10 00 93 01 20 00 02 00 A0 00 02 1F 00 01 00 50 B7 68",
            "",
            id="bulk write",
        ),
    ],
)
def test_worked_packet(line: SimLine, sent: str, answered: str) -> None:
    assert hexed(exchange(line, bytes.fromhex(sent))) == answered


def test_sync_write_reaches_both_goals(line: SimLine) -> None:
    exchange(
        line,
        bytes.fromhex("FF FF FD 00 FE 11 00 83 74 00 04 00 01 96 00 00 00 02 AA 00 00 00 82 87"),
    )
    assert line.bank["Goal Position"].tolist() == [150, 170]


def test_action_carries_out_the_registered_write(line: SimLine) -> None:
    exchange(line, bytes.fromhex(REG_WRITE))
    assert line.bank["Goal Velocity"][0] == 330
    assert line.bank["Registered Instruction"][0] == 1
    assert hexed(exchange(line, bytes.fromhex("FF FF FD 00 01 03 00 05 02 CE"))) == OK_1
    assert line.bank["Goal Velocity"][0] == 200
    assert line.bank["Registered Instruction"][0] == 0


def test_bulk_read(line: SimLine) -> None:
    line.firmware.protection.supply(11.9)
    line.firmware.protection.temperature_c[:] = 36.0
    sent = bytes.fromhex("FF FF FD 00 FE 0D 00 92 01 90 00 02 00 02 92 00 01 00 1A 05")
    assert hexed(exchange(line, sent)) == (
        "FF FF FD 00 01 06 00 55 00 77 00 C3 69 FF FF FD 00 02 05 00 55 00 24 8B A9"
    )


def test_fast_answer_runs_the_crc_over_earlier_crcs() -> None:
    """ROBOTIS's worked fast sync read: 2000 and 9 from servos 1 and 2."""
    parts = [(0, 1, (2000).to_bytes(4, "little")), (0, 2, (9).to_bytes(4, "little"))]
    assert hexed(encode_fast(parts)) == (
        "FF FF FD 00 FE 11 00 55 00 01 D0 07 00 00 0C 83 00 02 09 00 00 00 11 40"
    )
