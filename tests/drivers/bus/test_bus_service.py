"""Service work through the SDK, and the defects of the SDK that the bus fences off."""

import pytest

from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.errors import BusError, NoAnswerError, PortError, ServoError
from snakewalk.drivers.protocol.packet import (
    Instruction,
    InstructionPacket,
    StatusPacket,
    encode_status,
)
from snakewalk.drivers.protocol.parser import PacketParser
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant
from tests.helpers.scripted_port import ScriptedPort


@pytest.fixture
def line() -> SimLine:
    return SimLine(ServoBank([1, 2, 5]), BenchPlant(3))


@pytest.fixture
def bus(line: SimLine) -> DynamixelBus:
    return DynamixelBus(line)


def one_servo(reply: StatusPacket | bytes, asked: list[InstructionPacket]) -> ScriptedPort:
    raw = reply if isinstance(reply, bytes) else encode_status(reply)

    def script(data: bytes) -> list[tuple[float, bytes]]:
        asked.extend(PacketParser().feed(data))  # type: ignore[arg-type]
        written = asked[-1].instruction == Instruction.WRITE
        return [(1e-3, encode_status(StatusPacket(1, 0)) if written else raw)]

    return ScriptedPort(script)


def test_scan_and_find_agree(bus: DynamixelBus) -> None:
    scanned = bus.scan()
    assert list(scanned) == [1, 2, 5]
    assert {f.model_number for f in scanned.values()} == {1020}
    assert list(bus.find(range(8))) == [1, 2, 5]


def test_registers_by_name_read_back_as_written(bus: DynamixelBus, line: SimLine) -> None:
    bus.write(2, "Position P Gain", 640)
    assert bus.read(2, "Position P Gain") == 640
    bus.write(2, "Goal Current", -300)
    assert bus.read(2, "Goal Current") == -300
    assert line.bank["Position P Gain"].tolist() == [800, 640, 800]


@pytest.mark.parametrize("value", [-131073, -1, 65535])
def test_values_that_look_like_a_header_arrive(
    bus: DynamixelBus, line: SimLine, value: int
) -> None:
    bus.write(1, "Homing Offset", value)
    assert line.bank["Homing Offset"][0] == value
    assert bus.read(1, "Homing Offset") == value


def test_a_header_in_the_data_is_stuffed_when_sent() -> None:
    asked: list[InstructionPacket] = []
    bus = DynamixelBus(one_servo(StatusPacket(1, 0), asked))
    value = int.from_bytes(b"\xff\xff\xfd\x00", "little")
    bus.write(1, "Goal Position", value)
    (packet,) = asked
    assert packet.params == b"\x74\x00\xff\xff\xfd\x00"
    assert b"\xff\xff\xfd\xfd\x00" in bus.port.written[0]  # type: ignore[attr-defined]


def test_damage_is_not_told_as_silence() -> None:
    reply = bytearray(encode_status(StatusPacket(1, 0, b"\x20\x03")))
    reply[9] ^= 1
    with pytest.raises(NoAnswerError, match=r"Position P Gain: damaged bytes at .*: noise on the"):
        DynamixelBus(one_servo(bytes(reply), [])).read(1, "Position P Gain")


def test_refusals_name_servo_register_and_reason(bus: DynamixelBus) -> None:
    bus.write(1, "Torque Enable", 1)
    with pytest.raises(ServoError, match="servo 1: write Operating Mode: refused: access") as info:
        bus.write(1, "Operating Mode", 5)
    assert info.value.error == 7


def test_many_registers_of_a_servo_are_one_request() -> None:
    asked: list[InstructionPacket] = []
    line = SimLine(ServoBank([1]), BenchPlant(1))
    bus = DynamixelBus(line)
    names = [name for name in bus.table if 6 <= bus.table[name].address < 120]
    alone = {name: bus.read(1, name) for name in names}
    write = line.write
    line.write = lambda data: (asked.extend(PacketParser().feed(data)), write(data))[1]  # type: ignore
    assert bus.read_each(1, names) == alone
    assert bus.read_each(1, [*names[::-1], *names]) == alone
    assert len(asked) == 2
    assert bus.read_each(1, ["Present Position", "Model Number"])
    assert len(asked) == 4  # too far from each other


def test_many_registers_are_told_by_the_first_and_the_last(bus: DynamixelBus) -> None:
    names = ("Goal PWM", "Bus Watchdog", "Profile Velocity")
    with pytest.raises(NoAnswerError, match="servo 9: read Bus Watchdog to Profile Velocity: no"):
        bus.read_each(9, names)


def test_of_many_registers_only_optional_ones_may_be_lacking(
    bus: DynamixelBus, line: SimLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(line.bank, "readable", lambda rows, at, size: at == 64 and size == 1)
    names = ("LED", "Torque Enable")
    assert bus.read_each(1, names, ("LED",)) == {"Torque Enable": 0}
    with pytest.raises(ServoError, match="servo 1: read LED: refused: access"):
        bus.read_each(1, names)


def test_silence_is_an_error_with_the_baud_rate(bus: DynamixelBus) -> None:
    with pytest.raises(NoAnswerError, match=r"servo 9: .*1000000 baud"):
        bus.read(9, "Present Position")


def test_an_error_without_data_is_no_success() -> None:
    bus = DynamixelBus(one_servo(StatusPacket(1, 0x02), []))
    with pytest.raises(ServoError, match="refused: instruction"):
        bus.read(1, "Present Position")


def test_a_stuffed_answer_is_read_to_its_end() -> None:
    bus = DynamixelBus(one_servo(StatusPacket(1, 0, b"\xff\xff\xfd\xff"), []))
    assert bus.read(1, "Present Position") == -131073


def test_an_answer_of_the_wrong_length_is_no_value() -> None:
    bus = DynamixelBus(one_servo(StatusPacket(1, 0, b"\x01\x02"), []))
    with pytest.raises(BusError, match="2 bytes came, not 4"):
        bus.read(1, "Present Position")


def test_an_alert_does_not_hide_the_value() -> None:
    bus = DynamixelBus(one_servo(StatusPacket(1, 0x80, b"\x20"), []))
    assert bus.read(1, "Hardware Error Status") == 0x20


def test_one_lost_answer_is_asked_for_again(line: SimLine) -> None:
    lost = iter([True])
    line.tamper = lambda data: () if next(lost, False) else (data,)
    assert DynamixelBus(line).read(1, "Model Number") == 1020


def test_a_port_that_fails_is_not_left_busy() -> None:
    def broken(data: bytes) -> list[tuple[float, bytes]]:
        raise PortError("pulled out")

    bus = DynamixelBus(ScriptedPort(broken))
    for _ in range(2):
        with pytest.raises(PortError, match="pulled out"):
            bus.ping(1)
        assert not bus.port.is_using


def test_verified_writes_spare_the_eeprom() -> None:
    asked: list[InstructionPacket] = []
    bus = DynamixelBus(one_servo(StatusPacket(1, 0, b"\x05"), asked))
    bus.write_verified(1, "Operating Mode", 5)
    assert {packet.instruction for packet in asked} == {Instruction.READ}
    with pytest.raises(BusError, match="wrote 3, reads back 5"):
        bus.write_verified(1, "Operating Mode", 3)


def test_reboot_switches_torque_off(bus: DynamixelBus, line: SimLine) -> None:
    bus.write(2, "Torque Enable", 1)
    bus.reboot(2)
    assert line.bank["Torque Enable"].tolist() == [0, 0, 0]


@pytest.mark.parametrize("lag_s", [0.03, 0.045, 0.08, 0.12, 0.2])
def test_a_late_answer_is_not_that_to_another_register(lag_s: float) -> None:
    """All replies late by the same time: what is read is right, or nothing."""

    def script(raw: bytes) -> list[tuple[float, bytes]]:
        (packet,) = PacketParser().feed(raw)
        assert isinstance(packet, InstructionPacket)
        if packet.instruction == Instruction.WRITE:
            return [(lag_s, encode_status(StatusPacket(1, 0)))]
        address, length = packet.params[0], packet.params[2]
        return [(lag_s, encode_status(StatusPacket(1, 0, bytes([address]) * length)))]

    bus = DynamixelBus(ScriptedPort(script))
    right = 0
    for name in ("Torque Enable", "LED", "Bus Watchdog", "Drive Mode") * 3:
        try:
            value = bus.read(1, name)
        except NoAnswerError:
            continue
        assert value == bus.table[name].address
        right += 1
    assert right == (12 if lag_s < 0.035 else 0)
