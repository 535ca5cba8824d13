"""Simulated Feetech servos against the packets of Feetech's protocol page, and their registers."""

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.drivers.bus.feetech_bus import FeetechBus
from snakewalk.drivers.protocol.feetech import FeetechInstruction as Code
from snakewalk.drivers.protocol.protocol1 import frame
from snakewalk.sim.feetech.line import FeetechLine
from snakewalk.sim.serve.bench_line import bench_line
from snakewalk.sim.serve.chain_spec import parse_chain

MODELS = ("STS3215", "SCS0009", "HLS3606")


def a_line(servos: str = "1-2:STS3215") -> FeetechLine:
    line = bench_line(parse_chain(servos))
    assert isinstance(line, FeetechLine)
    return line


def exchange(line: FeetechLine, text: str) -> str:
    """All bytes that come within 20 ms, as hex digits."""
    line.write(bytes.fromhex(text))
    return line.read_until(999, line.clock.now_s() + 0.02).hex(" ").upper()


def wait(line: FeetechLine, seconds: float) -> None:
    line.clock.advance(seconds)
    line.settle()


def at(line: FeetechLine, position: int) -> None:
    """Put the shaft of the first servo where a STS3215 reports a position."""
    line.servos.plant.position_rad[0] = (position - 2048) * 2.0 * np.pi / 4096


def test_ping_and_read_as_printed() -> None:
    line = a_line()
    assert exchange(line, "FF FF 01 02 01 FB") == "FF FF 01 02 00 FC"
    at(line, 0x0518)
    assert exchange(line, "FF FF 01 04 02 38 02 BE") == "FF FF 01 04 00 18 05 DD"


def test_write_registered_write_and_sync_write_as_printed() -> None:
    line = a_line("1-4:STS3215")
    assert exchange(line, "FF FF 01 09 03 2A 00 08 00 00 E8 03 D5") == "FF FF 01 02 00 FC"
    assert line.servos["Goal Velocity"].tolist() == [1000, 3400, 3400, 3400]
    assert exchange(line, "FF FF 02 09 04 2A 00 08 00 00 E8 03 D3") == "FF FF 02 02 00 FB"
    assert line.servos["Registered Instruction"].tolist() == [0, 1, 0, 0]
    assert exchange(line, "FF FF FE 02 05 FA") == ""
    assert line.servos["Goal Velocity"].tolist() == [1000, 1000, 3400, 3400]
    sync = "FF FF FE 20 83 2A 06 " + "".join(f"0{k} 00 08 00 00 E8 03 " for k in (1, 2, 3, 4))
    assert exchange(line, sync + "58") == ""
    assert line.servos["Goal Velocity"].tolist() == [1000] * 4


def test_sync_read_as_printed() -> None:
    line = a_line()
    at(line, 0x0800)
    line.servos.protection.supply(12.1)
    wait(line, 0.01)
    line.servos.protection.heat(np.array([0]), 30.0)
    first, second = (
        "FF FF 01 0A 00 00 08 00 00 00 00 79 1E 55",
        "FF FF 02 0A 00 00 08 00 00 00 00 79 19 59",
    )
    line.servos["Shutdown"][:] = 0
    line.servos["Max Voltage Limit"][:] = 130
    wait(line, 0.01)
    assert exchange(line, "FF FF FE 06 82 38 08 01 02 36") == f"{first} {second}"


def test_a_packet_with_a_wrong_checksum_gets_no_reply() -> None:
    assert exchange(a_line(), "FF FF 01 02 01 FA") == ""


def test_servos_behind_a_silent_one_are_silent_in_a_sync_read() -> None:
    line = a_line("1-3:STS3215")
    line.mute(np.array([1]), True)
    replies = exchange(line, frame(0xFE, Code.SYNC_READ, bytes((62, 1, 1, 2, 3))).hex())
    assert replies == "FF FF 01 03 00 4A B1"


@pytest.mark.parametrize("model", MODELS)
def test_values_and_bytes_agree_in_each_format(model: str) -> None:
    line = a_line(f"1-3:{model}")
    bus, facts = FeetechBus(line, model), line.servos.facts
    assert bus.read(1, "Model Number") == facts.model_number
    assert exchange(line, frame(1, Code.READ, b"\x02\x01").hex())[15:17] == (
        "01" if facts.byte_order == "big" else "00"
    )
    for name, row in facts.registers.items():
        if row.range is None or name in ("ID", "Baud Rate", "Lock", "Torque Enable"):
            continue
        value = row.range[0] if row.range[0] else min(row.range[1], 3)
        bus.write(2, name, value)
        assert bus.read(2, name) == value, name
        assert line.servos[name][1] == value, name
        block = bus.block([1, 2], name, name).read()
        kind = bus.table[name].kind
        assert int(np.ascontiguousarray(block.data).view(kind)[1, 0]) == value, name


def test_words_of_scs_servos_are_big_endian() -> None:
    line = a_line("1:SCS0009")
    assert exchange(line, frame(1, Code.WRITE, bytes((42, 0x02, 0x58))).hex()) != ""
    assert line.servos["Goal Position"].tolist() == [600]


def test_negative_words_have_a_sign_bit() -> None:
    line = a_line()
    line.servos["Max Position Limit"][:] = 0  # many turns
    exchange(line, frame(1, Code.WRITE, bytes((42, 0x10, 0x80))).hex())
    exchange(line, frame(1, Code.WRITE, bytes((31, 0x10, 0x08))).hex())
    assert line.servos["Goal Position"][0] == -16
    assert line.servos["Homing Offset"][0] == -16  # bit 11


@pytest.mark.parametrize("model", MODELS)
def test_what_is_written_under_lock_is_forgotten_at_power_off(model: str) -> None:
    line = a_line(f"1-2:{model}")
    bus, row = FeetechBus(line, model), np.array([0])
    bus.write(1, "Position P Gain", 9)
    bus.write_kept(1, "Position D Gain", 7)
    assert bus.read(1, "Lock") == 1
    line.servos.cut_power(row)
    assert bus.find([1, 2]).keys() == {2}
    line.servos.restore_power(row)
    factory = line.servos.facts.registers["Position P Gain"].initial
    assert (bus.read(1, "Position P Gain"), bus.read(1, "Position D Gain")) == (factory, 7)
    bus.write_kept(1, "ID", 9)
    assert bus.find([1, 9]).keys() == {9}
    bus.reboot(9)
    assert bus.find([1, 9]).keys() == {9}


def test_status_return_level_0_replies_to_ping_and_read_only() -> None:
    line = a_line()
    line.servos["Status Return Level"][0] = 0
    assert exchange(line, frame(1, Code.WRITE, bytes((40, 1))).hex()) == ""
    assert line.servos["Torque Enable"][0] == 1
    assert exchange(line, frame(1, Code.PING).hex()) != ""


def test_recovery_restores_all_but_the_id() -> None:
    line = a_line("4:STS3215")
    bus = FeetechBus(line, "STS3215")
    bus.write_kept(4, "Position P Gain", 9)
    exchange(line, frame(4, Code.BACK_UP).hex())
    bus.write_kept(4, "Position P Gain", 99)
    exchange(line, frame(4, Code.RECOVER).hex())
    assert (bus.read(4, "Position P Gain"), bus.read(4, "ID")) == (9, 4)


@pytest.mark.parametrize("how", ["torque enable", "instruction", "value"])
def test_calibration_makes_the_present_position_the_middle(how: str) -> None:
    line = a_line()
    bus = FeetechBus(line, "STS3215")
    at(line, 300)
    assert bus.read(1, "Present Position") == 300
    packet = {
        "torque enable": frame(1, Code.WRITE, bytes((40, 128))),
        "instruction": frame(1, Code.CALIBRATE),
        "value": frame(1, Code.CALIBRATE, (1024).to_bytes(2, "little")),
    }[how]
    assert exchange(line, packet.hex()) == "FF FF 01 02 00 FC"
    assert bus.read(1, "Present Position") == (1024 if how == "value" else 2048)
    assert bus.read(1, "Homing Offset") == (300 - 1024 if how == "value" else 300 - 2048)
    bus.reboot(1)
    assert bus.read(1, "Present Position") == (1024 if how == "value" else 2048)


def test_modes_of_an_sts_servo() -> None:
    line = a_line("1-4:STS3215")
    bus = FeetechBus(line, "STS3215")
    for servo_id, mode in enumerate((0, 1, 2, 3), 1):
        bus.write(servo_id, "Operating Mode", mode)
        bus.write(servo_id, "Torque Enable", 1)
    bus.write(1, "Goal Position", 2500)
    bus.write(2, "Goal Velocity", -1000)
    bus.write(3, "Open-loop PWM", 500)
    bus.write(4, "Goal Position", 400)
    wait(line, 0.1)
    early = line.servos.plant.position_rad.copy()
    wait(line, 1.0)
    turned = (line.servos.plant.position_rad - early) * 4096 / (2 * np.pi)
    assert bus.read(1, "Present Position") == pytest.approx(2500, abs=6)
    assert turned[1] == pytest.approx(-1000, rel=0.03)
    assert turned[2] > 500
    assert bus.read(3, "Present Load") == 500
    assert abs(bus.read(4, "Present Position")) < 8  # the way that is left
    bus.write(4, "Goal Position", -150)
    wait(line, 1.0)
    steps = line.servos.plant.position_rad[3] * 4096 / (2 * np.pi)
    assert steps == pytest.approx(400 - 150, abs=8)


def test_hls_servo_limits_its_current_in_position_mode() -> None:
    line = a_line("1-2:HLS3606")
    bus = FeetechBus(line, "HLS3606")
    line.servos.plant.set_load([0, 1], -0.2)  # N m: 0.44 A
    for servo_id, limit in ((1, 200), (2, 30)):
        bus.write(servo_id, "Goal Current", limit)
        bus.write(servo_id, "Torque Enable", 1)
    wait(line, 0.3)
    assert abs(bus.read(1, "Present Position") - 2048) < 100
    assert bus.read(2, "Present Current") == 30
    assert bus.read(2, "Present Position") < 1900


def test_overload_lowers_the_output_until_torque_is_switched_on_again() -> None:
    line = a_line()
    bus = FeetechBus(line, "STS3215")
    line.servos.block_shafts(np.array([0]))
    bus.write(1, "Torque Enable", 1)
    bus.write(1, "Goal Position", 3000)
    wait(line, 1.5)
    assert bus.read(1, "Hardware Error Status") == 0
    wait(line, 1.0)
    assert bus.read(1, "Hardware Error Status") == 0x20
    assert bus.ping(1).alert
    assert bus.read(1, "Present Load") == 200  # Protective Torque: 20 %
    line.servos.free_shafts(np.array([0]))
    bus.write(1, "Torque Enable", 0)
    wait(line, 0.05)
    bus.write(1, "Torque Enable", 1)
    wait(line, 1.5)
    assert bus.read(1, "Hardware Error Status") == 0
    assert bus.read(1, "Present Position") == pytest.approx(3000, abs=8)


@pytest.mark.parametrize(
    ("servos", "said"),
    [
        ("1:STS3215,2:XL330-M288", "STS3215 speaks Feetech's protocol and XL330-M288 Protocol 2.0"),
        ("1:STS3215,2:AX-12A", "AX-12A Protocol 1.0: not on one bus"),
        ("1:STS3215,2:HLS3606", "one model of Feetech's protocol on a simulated bus"),
    ],
)
def test_one_bus_has_servos_of_one_model(servos: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        bench_line(parse_chain(servos))
