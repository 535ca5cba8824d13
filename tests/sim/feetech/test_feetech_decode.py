"""Packets of Feetech servos in words."""

import json
from pathlib import Path

from typer.testing import CliRunner

from snakewalk.config.servo_catalogue import servo_model
from snakewalk.controller.cli.command_line import app
from snakewalk.drivers.protocol.feetech import FeetechInstruction as Code
from snakewalk.drivers.protocol.protocol1 import frame
from snakewalk.sim.feetech.decode import FeetechDecoder
from snakewalk.sim.sniff.decode import DecodedPacket


def decoded(model: str, *packets: bytes, period_s: float = 1e-3) -> list[DecodedPacket]:
    decoder, lines = FeetechDecoder(servo_model(model)), []
    for number, packet in enumerate(packets):
        lines += decoder.feed(number * period_s, packet)
    return lines


def test_a_sync_read_has_a_reply_of_each_servo_with_signed_words() -> None:
    ask = frame(254, Code.SYNC_READ, bytes((56, 4, 1, 2, 3)))
    replies = [
        frame(1, 0x00, bytes.fromhex("1805 6480")),
        frame(2, 0x04, bytes.fromhex("0008 6400")),
    ]
    question, first, second = decoded("STS3215", ask, *replies)
    names = "Present Position, Present Velocity"
    assert (question.name, question.values) == ("sync read", dict.fromkeys("123", names))
    assert (first.kind, first.servo_id, first.name) == ("answer", 1, "ok")
    assert first.values == {"Present Position": 0x518, "Present Velocity": -100}
    assert second.name == "overheating"
    assert second.values == {"Present Position": 2048, "Present Velocity": 100}


def test_words_of_scs_servos_are_big_endian() -> None:
    write = frame(254, Code.SYNC_WRITE, bytes((42, 2, 5, 0x02, 0x00, 6, 0x01, 0xFF)))
    ask, reply = frame(5, Code.READ, bytes((56, 2))), frame(5, 0, bytes((0x01, 0xF4)))
    goals, question, answer = decoded("SCS0009", write, ask, reply)
    assert goals.values == {"5: Goal Position": 512, "6: Goal Position": 511}
    assert question.values == {"Present Position": "?"}
    assert answer.values == {"Present Position": 500}


def test_instructions_have_feetechs_names() -> None:
    packets = [frame(1, code) for code in (Code.PING, Code.RECOVER, Code.BACK_UP, Code.RESET)]
    names = [line.name for line in decoded("STS3215", *packets, period_s=0.2)]
    assert names == ["ping", "recover", "back up", "reset"]


def test_bus_sniff_decodes_a_recording(tmp_path: Path) -> None:
    packets = [frame(254, Code.SYNC_READ, bytes((56, 2, 1))), frame(1, 0, bytes((0x18, 0x05)))]
    file = tmp_path / "exchange.hex"
    file.write_text("\n".join(packet.hex(" ") for packet in packets))
    call = ["bus", "sniff", str(file), "--model", "STS3215", "--json"]
    lines = [json.loads(each) for each in CliRunner().invoke(app, call).stdout.splitlines()]
    assert [line["name"] for line in lines] == ["sync read", "ok"]
    assert lines[1]["values"] == {"Present Position": 0x518}
