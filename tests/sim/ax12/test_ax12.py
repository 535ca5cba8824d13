"""AX-12A, Protocol 1.0: worked packets of the e-manual, rules, motion, the SDK unmodified."""

import math

import dynamixel_sdk as sdk
import pytest

from snakewalk.config.errors import InputError
from snakewalk.drivers.protocol.protocol1 import Error1
from snakewalk.sim.ax12.ax12 import Ax12Servos
from snakewalk.sim.ax12.line import Ax12Line
from snakewalk.sim.servo.bench import BenchPlant

OK = (sdk.COMM_SUCCESS, 0)


def a_line(*ids: int, **bench: object) -> Ax12Line:
    servos = Ax12Servos(ids or (1, 2), BenchPlant(len(ids or (1, 2)), **bench))
    return Ax12Line(servos)


def exchange(line: Ax12Line, text: str) -> str:
    line.write(bytes.fromhex(text))
    return line.read_until(999, line.clock.now_s() + 0.02).hex(" ").upper()


def wait(line: Ax12Line, seconds: float) -> None:
    line.clock.advance(seconds)
    line.settle()


@pytest.mark.parametrize(
    ("sent", "answered"),
    [
        ("FF FF 01 02 01 FB", "FF FF 01 02 00 FC"),  # ping
        ("FF FF 01 04 02 2B 01 CC", "FF FF 01 03 00 20 DB"),  # read temperature: 32
        ("FF FF FE 04 03 03 01 F6", ""),  # write the ID of all
        ("FF FF 01 05 04 1E F4 01 E2", "FF FF 01 02 00 FC"),  # reg write 500
    ],
)
def test_worked_packets(sent: str, answered: str) -> None:
    """E-manual, Protocol 1.0, examples of ping, read, write and reg write."""
    line = a_line(1)
    line.servos.protection.temperature_c[:] = 32.0
    assert exchange(line, sent) == answered


def test_sync_write_as_in_the_manual() -> None:
    """IDs 0 and 1: goals 16 and 544, speeds 336 and 864."""
    line = a_line(0, 1)
    body = "FE 0E 83 1E 04 00 10 00 50 01 01 20 02 60 03"
    total = ~sum(bytes.fromhex(body)) & 0xFF
    assert exchange(line, f"FF FF {body} {total:02X}") == ""
    assert line.servos["Goal Position"].tolist() == [16, 544]
    assert line.servos["Moving Speed"].tolist() == [336, 864]


def test_the_sdk_moves_a_servo_at_its_moving_speed() -> None:
    line = a_line(3, 7)
    ph = sdk.PacketHandler(1.0)
    assert ph.ping(line, 7) == (12, *OK)
    assert ph.write2ByteTxRx(line, 7, 32, 100) == OK
    assert ph.write2ByteTxRx(line, 7, 30, 800) == OK
    start, _, _ = ph.read2ByteTxRx(line, 7, 36)
    begin_s = line.clock.now_s()
    wait(line, 0.5)
    there, _, _ = ph.read2ByteTxRx(line, 7, 36)
    seconds = line.clock.now_s() - begin_s
    expected = 100 * 0.111 / 60 * 360 / 300 * 1023 * seconds
    assert there - start == pytest.approx(expected, rel=0.1)
    wait(line, 3.0)
    assert ph.read2ByteTxRx(line, 7, 36)[0] == pytest.approx(800, abs=3)
    assert ph.read1ByteTxRx(line, 7, 46)[0] == 0
    assert line.servos["Torque Enable"].tolist() == [0, 1]


def test_wheel_mode_turns_both_ways() -> None:
    line = a_line(1, dry_n_m=0.0)
    ph = sdk.PacketHandler(1.0)
    for value, sign in ((512, 1.0), (1024 + 512, -1.0)):
        assert ph.write2ByteTxRx(line, 1, 8, 0) == OK
        assert ph.write1ByteTxRx(line, 1, 24, 1) == OK
        assert ph.write2ByteTxRx(line, 1, 32, value) == OK
        wait(line, 1.0)
        speed = float(line.servos.plant.velocity_rad_s[0])
        assert speed == pytest.approx(sign * 0.5 * 59 * math.tau / 60, rel=0.05)
        shown, _, _ = ph.read2ByteTxRx(line, 1, 38)
        assert bool(shown & 0x400) == (sign < 0)


def test_after_wheel_mode_a_joint_goes_the_short_way() -> None:
    """The sensor knows no turns."""
    line = a_line(1, dry_n_m=0.0)
    ph = sdk.PacketHandler(1.0)
    for address, value in ((8, 0), (32, 800)):
        assert ph.write2ByteTxRx(line, 1, address, value) == OK
    assert ph.write1ByteTxRx(line, 1, 24, 1) == OK
    wait(line, 3.0)
    turned_rad = float(line.servos.plant.position_rad[0])
    assert turned_rad > 2 * math.tau
    assert ph.write1ByteTxRx(line, 1, 24, 0) == OK
    for address, value in ((8, 1023), (32, 0), (30, 512)):
        assert ph.write2ByteTxRx(line, 1, address, value) == OK
    wait(line, 2.0)
    assert ph.read2ByteTxRx(line, 1, 36)[0] == pytest.approx(512, abs=3)
    turns = float(line.servos.plant.position_rad[0]) / math.tau
    assert turns == pytest.approx(round(turns), abs=0.01)
    assert round(turns) >= 2


@pytest.mark.parametrize(
    ("address", "value", "size", "error"),
    [
        (30, 1024, 2, Error1.RANGE),
        (30, 900, 2, Error1.ANGLE_LIMIT),
        (36, 5, 2, Error1.INSTRUCTION),
        (3, 254, 1, Error1.RANGE),
        (25, 1, 1, 0),
    ],
)
def test_writes_are_judged(address: int, value: int, size: int, error: int) -> None:
    line = a_line(1)
    ph = sdk.PacketHandler(1.0)
    assert ph.write2ByteTxRx(line, 1, 8, 800) == OK
    write = ph.write2ByteTxRx if size == 2 else ph.write1ByteTxRx
    assert write(line, 1, address, value) == (0, error)


def test_lock_checksum_and_baud() -> None:
    line = a_line(1)
    ph = sdk.PacketHandler(1.0)
    assert ph.write1ByteTxRx(line, 1, 47, 1) == OK
    assert ph.write1ByteTxRx(line, 1, 11, 60) == (0, Error1.INSTRUCTION)
    assert ph.write1ByteTxRx(line, 1, 47, 0) == (0, Error1.RANGE)  # until the power goes
    assert exchange(line, "FF FF 01 02 01 FA") == "FF FF 01 02 10 EC"
    line.setBaudRate(115_200)
    assert exchange(line, "FF FF 01 02 01 FB") == ""
    line.servos["Baud Rate"][:] = 16
    assert exchange(line, "FF FF 01 02 01 FB") == "FF FF 01 02 00 FC"


def test_action_and_unknown_instructions() -> None:
    line = a_line(1)
    assert exchange(line, "FF FF 01 02 05 F7") == "FF FF 01 02 40 BC"  # nothing registered
    exchange(line, "FF FF 01 05 04 1E F4 01 E2")
    assert line.servos["Registered"][0] == 1
    exchange(line, "FF FF FE 02 05 FA")
    assert line.servos["Goal Position"][0] == 500
    assert exchange(line, "FF FF 01 02 92 6A") == "FF FF 01 02 40 BC"  # no bulk read in an AX
    assert exchange(line, "FF FF 01 05 04 1E 00 05 D2") == "FF FF 01 02 08 F4"  # 1280: no goal
    assert line.servos["Registered"][0] == 0


def test_a_held_shaft_trips_the_overload() -> None:
    line = a_line(1, inertia_kg_m2=1e6)
    ph = sdk.PacketHandler(1.0)
    ph.write2ByteTxRx(line, 1, 30, 900)
    wait(line, 1.5)
    assert ph.ping(line, 1)[2] == Error1.OVERLOAD
    assert line.servos["Torque Enable"][0] == 0


@pytest.mark.parametrize(("level", "answers"), [(0, (1, 0, 0)), (1, (1, 1, 0)), (2, (1, 1, 1))])
def test_status_return_level(level: int, answers: tuple[int, int, int]) -> None:
    line = a_line(1)
    line.servos["Status Return Level"][:] = level
    asked = ("FF FF 01 02 01 FB", "FF FF 01 04 02 2B 01 CC", "FF FF 01 04 03 19 01 DD")
    assert tuple(int(bool(exchange(line, text))) for text in asked) == answers
    assert line.servos["LED"][0] == 1


def test_factory_reset_gives_the_manuals_initial_values() -> None:
    line = a_line(7)
    ph = sdk.PacketHandler(1.0)
    for address, value in ((11, 50), (18, 1), (16, 2)):
        assert ph.write1ByteTxRx(line, 7, address, value) == OK
    assert ph.factoryReset(line, 7) == OK
    manual = {3: 1, 4: 1, 5: 250, 11: 70, 12: 60, 13: 140, 16: 2, 17: 36, 18: 36, 24: 0, 28: 32}
    for address, value in manual.items():
        assert ph.read1ByteTxRx(line, 1, address) == (value, *OK)


def test_wrong_ids_are_refused() -> None:
    with pytest.raises(InputError, match="ID 254"):
        a_line(254)
    with pytest.raises(InputError, match="share"):
        a_line(1, 1)
