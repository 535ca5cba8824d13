"""Protocol 1.0 in words."""

import json
from pathlib import Path

from snakewalk.drivers.protocol.protocol1 import BROADCAST_ID, Error1, Instruction1, frame
from snakewalk.sim.ax12.ax12 import Ax12Servos
from snakewalk.sim.ax12.decode import Decoder1
from snakewalk.sim.ax12.line import Ax12Line
from snakewalk.sim.servo.bench import BenchPlant
from snakewalk.sim.sniff.decode import DecodedPacket
from snakewalk.sim.sniff.trace import TraceWriter
from tests.helpers.command import snakewalk


def decoded(*questions: bytes, alarm: int = 0, to: object = None) -> list[DecodedPacket]:
    line = Ax12Line(Ax12Servos((1, 2), BenchPlant(2)))
    if alarm:
        line.servos.protection.detect([0], alarm)
    decoder, lines = Decoder1(), []
    line.taps.append(lambda t, _, data: lines.extend(decoder.feed(t, data)))
    if to is not None:
        line.taps.append(TraceWriter(to))
    for each in questions:
        line.write(each)
        line.read_until(999, line.clock.now_s() + 0.02)
    return lines


def test_a_read_and_its_answer_are_told_with_their_register() -> None:
    question, answer = decoded(frame(1, Instruction1.READ, bytes((36, 4))))
    assert (question.kind, question.servo_id, question.name) == ("question", 1, "read")
    assert list(question.values) == ["Present Position", "Present Speed"]
    assert (answer.kind, answer.name) == ("answer", "ok")
    assert answer.values == {"Present Position": 512, "Present Speed": 0}
    assert "<-   1" in answer.text()


def test_pings_of_one_and_of_all() -> None:
    lines = decoded(frame(1, Instruction1.PING), frame(BROADCAST_ID, Instruction1.PING))
    kinds = [(line.kind, line.servo_id, line.name) for line in lines]
    assert kinds == [
        *(("question", 1, "ping"), ("answer", 1, "ok")),
        *(("question", 254, "ping"), ("answer", 1, "ok"), ("answer", 2, "ok")),
    ]


def test_writes_alarms_and_errors() -> None:
    lines = decoded(
        frame(1, Instruction1.WRITE, bytes((25, 1))),
        frame(1, Instruction1.WRITE, bytes((36, 1, 0))),
        frame(BROADCAST_ID, Instruction1.SYNC_WRITE, bytes((30, 2, 1, 0, 2, 2, 16, 0))),
        alarm=Error1.OVERLOAD,
    )
    assert [line.name for line in lines] == [
        *("write", "overload", "write", "overload, instruction", "sync write")
    ]
    assert lines[0].values == {"LED": 1}
    assert lines[-1].values == {"1: Goal Position": 512, "2: Goal Position": 16}


def test_noise_and_half_packets_do_not_hide_what_follows() -> None:
    decoder, ping = Decoder1(), frame(1, Instruction1.PING)
    assert [line.name for line in decoder.feed(0.0, ping[:-1] + b"\0")] == ["wrong checksum"]
    assert list(decoder.feed(0.1, ping[:4])) == []
    assert [line.name for line in decoder.feed(0.2, ping)] == ["ping"]
    assert [line.kind for line in decoder.feed(0.5, ping)] == ["question"]  # too late an answer


def test_sniff_reads_a_recording(tmp_path: Path) -> None:
    path = tmp_path / "exchange.jsonl"
    with path.open("w", encoding="utf-8") as out:
        decoded(frame(2, Instruction1.READ, bytes((43, 1))), to=out)
    words = ("bus", "sniff", str(path), "--model", "ax-12a", "--json")
    done = snakewalk(*words)
    assert done.returncode == 0, done.stderr
    lines = [json.loads(line) for line in done.stdout.splitlines()]
    assert [line["values"] for line in lines] == [
        {"Present Temperature": "?"},
        {"Present Temperature": 25},
    ]
