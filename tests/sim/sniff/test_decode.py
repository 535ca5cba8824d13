"""Bytes in words, from recordings and from the wire."""

import json
from pathlib import Path

import pytest

from snakewalk.config.errors import InputError
from snakewalk.drivers.protocol.packet import Instruction, InstructionPacket, encode_instruction
from snakewalk.sim.serve.chain_spec import parse_chain
from snakewalk.sim.sniff.decode import DecodedPacket, Decoder
from snakewalk.sim.sniff.trace import TraceWriter, read_trace
from tests.helpers.bus import a_line, exchange, group_params


def decoded(*exchanges: tuple[int, int, bytes], model: str = "XM430-W350") -> list[DecodedPacket]:
    line = a_line(2, model=model)
    decoder, lines = Decoder(), []
    line.taps.append(lambda t, _, data: lines.extend(decoder.feed(t, data)))
    for servo_id, code, params in exchanges:
        exchange(line, encode_instruction(InstructionPacket(servo_id, code, params)))
    return lines


def test_a_read_is_told_with_its_register() -> None:
    question, answer = decoded((1, Instruction.READ, bytes((132, 0, 4, 0))))
    assert (question.kind, question.name, question.servo_id) == ("question", "read", 1)
    assert list(question.values) == ["Present Position"]
    assert (answer.kind, answer.name, answer.values) == ("answer", "ok", {"Present Position": 2048})
    assert answer.time_s > question.time_s
    assert "<-   1" in answer.text()


def test_pings_tell_the_models_and_with_them_the_registers() -> None:
    ping, *pongs = decoded((0xFE, Instruction.PING, b""), model="XL330-M288")[:3]
    assert ping.name == "ping"
    assert [pong.values["model"] for pong in pongs] == ["XL330-M288"] * 2
    lines = decoded(
        (1, Instruction.PING, b""), (1, Instruction.READ, bytes((62, 0, 1, 0))), model="XL330-M288"
    )
    assert lines[-1].values == {"PWM Slope": 140}


@pytest.mark.parametrize("code", [Instruction.SYNC_READ, Instruction.FAST_SYNC_READ])
def test_group_reads_are_told_servo_by_servo(code: int) -> None:
    lines = decoded((0xFE, code, group_params(132, 4, [1, 2])))
    values: dict[str, object] = {}
    for line in lines[1:]:
        for key, value in line.values.items():
            values[key if ":" in key else f"{line.servo_id}: {key}"] = value
    assert values == {"1: Present Position": 2048, "2: Present Position": 2048}


def test_a_packet_of_sixteen_servos_is_read_at_a_glance() -> None:
    ids = [*range(1, 16), 20]

    def sync_write(goals: list[int]) -> bytes:
        data = (
            bytes((i,)) + goal.to_bytes(4, "little") for i, goal in zip(ids, goals, strict=True)
        )
        return bytes((116, 0, 4, 0)) + b"".join(data)

    alike, *_ = decoded((0xFE, Instruction.SYNC_WRITE, sync_write([9] * 16)))
    assert alike.text().endswith("  Goal Position 9 of 1-15,20")
    different, *_ = decoded((0xFE, Instruction.SYNC_WRITE, sync_write([2000 + i for i in ids])))
    assert different.text().endswith("2014 2015 2020 of 1-15,20")
    asked, *_ = decoded((0xFE, Instruction.FAST_SYNC_READ, group_params(126, 10, iter(ids))))
    assert asked.text().endswith("  Present Current, Present Velocity, Present Position of 1-15,20")
    assert max(len(one.text()) for one in (alike, different, asked)) < 150


def test_writes_errors_and_noise() -> None:
    goal = bytes((116, 0)) + (9_000).to_bytes(4, "little")
    question, answer = decoded((2, Instruction.WRITE, goal))
    assert question.values == {"Goal Position": 9_000}
    assert answer.name == "data limit"
    (noise,) = Decoder().feed(0.0, bytes.fromhex("FF FF FD 00 01 03 00 01 19 4F 00 00 00 00"))
    assert (noise.kind, noise.name) == ("noise", "wrong CRC")


def test_a_recording_reads_back(tmp_path: Path) -> None:
    line = a_line(1)
    path = tmp_path / "exchange.jsonl"
    with path.open("w") as out:
        line.taps.append(TraceWriter(out))
        exchange(line, bytes.fromhex("FF FF FD 00 01 03 00 01 19 4E"))
    pieces = list(read_trace(path))
    assert len(pieces) == 2
    assert pieces[0][1].hex() == "fffffd00010300" + "01194e"
    names = [line.name for t, data in pieces for line in Decoder().feed(t, data)]
    assert names == ["ping", "ok"]
    hexed = tmp_path / "exchange.txt"
    hexed.write_text("# a ping\n" + pieces[0][1].hex(" "))
    assert [data for _, data in read_trace(hexed)] == [pieces[0][1]]
    raw = tmp_path / "exchange.bin"
    raw.write_bytes(b"".join(data for _, data in pieces))
    assert [data for _, data in read_trace(raw)] == [raw.read_bytes()]


def test_a_wrong_recording_names_its_line(tmp_path: Path) -> None:
    path = tmp_path / "exchange.txt"
    path.write_text("ff ff\nnot hex\n")
    with pytest.raises(InputError, match="line 2: neither hex"):
        list(read_trace(path))


def test_lines_go_to_json() -> None:
    for line in decoded((1, Instruction.READ, bytes((132, 0, 4, 0)))):
        assert json.loads(json.dumps(line.to_dict()))["servo_id"] == 1


@pytest.mark.parametrize(
    ("text", "ids", "model"),
    [
        ("1-4", (1, 2, 3, 4), "XM430-W350"),
        ("7,1-2:xl330_m288", (7, 1, 2), "XL330-M288"),
    ],
)
def test_chains_are_named_briefly(text: str, ids: tuple[int, ...], model: str) -> None:
    spec = parse_chain(text)
    assert (spec.ids, spec.model) == (ids, model)


@pytest.mark.parametrize(
    ("text", "said"),
    [("", "is no ID"), ("a", "is no ID"), ("5-1", "backwards"), ("1-253", "ID 253")],
)
def test_a_wrong_chain_is_one_clear_line(text: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        parse_chain(text)


def test_packets_of_several_registers_are_told_servo_by_servo() -> None:
    data = bytes((1, 65, 0, 1, 0, 1, 2, 116, 0, 4, 0)) + (3000).to_bytes(4, "little")
    question, *_ = decoded((0xFE, Instruction.BULK_WRITE, data))
    assert question.values == {"1: LED": 1, "2: Goal Position": 3000}
    asked = bytes((1, 144, 0, 2, 0, 2, 132, 0, 4, 0))
    for code in (Instruction.BULK_READ, Instruction.FAST_BULK_READ):
        question, *answers = decoded((0xFE, code, asked))
        assert question.values == {"1": "Present Input Voltage", "2": "Present Position"}
        told = [answer.values for answer in answers]
        if code == Instruction.BULK_READ:
            assert told == [{"Present Input Voltage": 120}, {"Present Position": 2048}]
        else:
            assert told == [{"1: Present Input Voltage": 120, "2: Present Position": 2048}]
