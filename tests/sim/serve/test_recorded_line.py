"""A recorded exchange is a device: who asks the same gets the replies that were recorded."""

import json
from pathlib import Path

import pytest

from snakewalk.config.errors import InputError
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.errors import NoAnswerError
from snakewalk.drivers.protocol.packet import (
    BROADCAST_ID,
    Instruction,
    InstructionPacket,
    StatusPacket,
    encode_instruction,
    encode_status,
)
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.serve.recorded_line import RecordedLine
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant
from snakewalk.sim.sniff.trace import TraceWriter
from tests.helpers.command import snakewalk


def ask(bus: DynamixelBus) -> list[object]:
    """What a client does: a ping, reads, a write, a group read in a cycle."""
    told: list[object] = [bus.ping(3).model_number, bus.read(7, "Present Position")]
    bus.write(3, "LED", 1)
    told.append(bus.read(3, "LED"))
    cycle = bus.cycle([3, 7])
    told += [cycle.read().data.tolist() for _ in range(3)]
    bus.write(3, "LED", 0)
    return [*told, bus.read(3, "LED")]


@pytest.fixture
def recorded(tmp_path: Path) -> tuple[Path, list[object], float]:
    line = SimLine(ServoBank([3, 7]), BenchPlant(2, load_n_m=lambda rad: -0.3 + 0.0 * rad))
    path = tmp_path / "exchange.jsonl"
    with path.open("w", encoding="utf-8") as out:
        line.taps.append(TraceWriter(out))
        told = ask(DynamixelBus(line))
    return path, told, line.clock.now_s()


def test_who_asks_the_same_is_told_the_same_at_the_same_times(
    recorded: tuple[Path, list[object], float],
) -> None:
    path, told, took_s = recorded
    line = RecordedLine.of(path)
    assert line.ids == [3, 7]
    assert ask(DynamixelBus(line)) == told
    assert line.clock.now_s() == pytest.approx(took_s, abs=1e-6)
    assert ask(DynamixelBus(line)) == told  # from the beginning again
    assert line.unknown == 0


def test_what_was_not_recorded_has_no_reply(recorded: tuple[Path, list[object], float]) -> None:
    line = RecordedLine.of(recorded[0])
    bus = DynamixelBus(line)
    with pytest.raises(NoAnswerError):
        bus.read(7, "Present Temperature")
    assert line.unknown > 0
    bus.write(3, "LED", 1)
    with pytest.raises(NoAnswerError):
        bus.write(7, "LED", 1)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("ff ff fd 00\n", "line 1: no packet as bus serve --record writes it"),
        (json.dumps({"t": 0, "from": "me", "hex": "ff"}) + "\n", "from is 'me'; host or servo"),
        (json.dumps({"t": 0, "from": "servo", "hex": "ff"}) + "\n", "contains no packet of a host"),
        ("", "contains no packet of a host"),
    ],
)
def test_what_is_no_exchange_is_refused(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "x.jsonl"
    path.write_text(text)
    with pytest.raises(InputError, match=said):
        RecordedLine.of(path)


def test_the_command_serves_it(recorded: tuple[Path, list[object], float]) -> None:
    path = str(recorded[0])
    done = snakewalk("bus", "serve", "--play", path, "--for", "0.05", "--json")
    assert json.loads(done.stdout.splitlines()[0])["ids"] == [3, 7]
    assert snakewalk("bus", "serve", "--play", path, "--servos", "1").returncode == 2
    assert snakewalk("bus", "serve", "--play", path, "--console").returncode == 2


def test_a_write_of_another_value_has_the_reply_of_the_recorded_one(
    recorded: tuple[Path, list[object], float],
) -> None:
    """Goals depend on the host's clock; a write has the same place, and no other."""
    bus = DynamixelBus(RecordedLine.of(recorded[0]))
    bus.ping(3)
    bus.read(7, "Present Position")
    bus.write(3, "LED", 0)  # 1 was recorded
    with pytest.raises(NoAnswerError):
        bus.write(3, "Torque Enable", 1)


def sent(servo_id: int, instruction: Instruction, *params: int) -> bytes:
    return encode_instruction(InstructionPacket(servo_id, instruction, bytes(params)))


def replied(servo_id: int, *params: int) -> bytes:
    return encode_status(StatusPacket(servo_id, 0, bytes(params)))


def played(path: Path, *rows: tuple[float, str, bytes], baud: int = 1_000_000) -> RecordedLine:
    """A line of packets that end at the given times."""
    lines = [json.dumps({"t": t, "from": who, "hex": data.hex()}) for t, who, data in rows]
    path.write_text("\n".join(lines) + "\n")
    return RecordedLine.of(path, baud)


def answer(line: RecordedLine, data: bytes) -> bytes:
    line.write(data)
    return line.read_until(1000, line.clock.now_s() + 1.0)


PING_3, PING_7 = sent(3, Instruction.PING), sent(7, Instruction.PING)
FIRST, SECOND = replied(3, 1, 2, 3), replied(3, 4, 5, 6)


@pytest.mark.parametrize("baud", [1_000_000, 57_600])
def test_replies_begin_after_the_recorded_silences(tmp_path: Path, baud: int) -> None:
    byte_s = 10.0 / baud
    first_s = 1.0 + 0.0004 + len(FIRST) * byte_s
    second_s = first_s + 0.0007 + len(SECOND) * byte_s
    line = played(
        tmp_path / "x.jsonl",
        (0.5, "servo", SECOND),  # before any packet of a host
        (1.0, "host", PING_3),
        (first_s, "servo", FIRST),
        (second_s, "servo", SECOND),
        (3.0, "host", PING_7),
        (3.0, "servo", FIRST),  # rounded times may overlap
        baud=baud,
    )
    assert line.getBaudRate() == baud
    clock = line.clock
    line.write(PING_3)
    asked_s = clock.now_s() + len(PING_3) * byte_s
    assert line.read_until(len(FIRST), asked_s + 1.0) == FIRST
    assert clock.now_s() - asked_s == pytest.approx(first_s - 1.0, abs=1e-9)
    assert line.read_until(len(SECOND), asked_s + 1.0) == SECOND
    assert clock.now_s() - asked_s == pytest.approx(second_s - 1.0, abs=1e-9)
    line.write(PING_7)
    asked_s = clock.now_s() + len(PING_7) * byte_s
    assert line.read_until(len(FIRST), asked_s + 1.0) == FIRST
    assert clock.now_s() - asked_s == pytest.approx(len(FIRST) * byte_s, abs=1e-9)


def test_equal_packets_have_their_replies_in_turn(tmp_path: Path) -> None:
    everybody = replied(BROADCAST_ID, 0)
    line = played(
        tmp_path / "x.jsonl",
        (1.0, "host", PING_3),
        (1.1, "servo", FIRST),
        (2.0, "host", PING_7),
        (2.1, "servo", everybody),
        (3.0, "host", PING_3),
        (3.1, "servo", SECOND),
    )
    assert line.ids == [3]
    assert [answer(line, PING_3) for _ in range(3)] == [FIRST, SECOND, FIRST]
    assert [answer(line, data) for data in (PING_7, PING_3)] == [everybody, SECOND]
    assert answer(line, sent(5, Instruction.PING)) == b""
    assert [answer(line, data) for data in (PING_3, PING_7)] == [FIRST, everybody]
    assert line.unknown == 1


def test_each_packet_of_one_write_is_found(tmp_path: Path) -> None:
    goal = sent(BROADCAST_ID, Instruction.SYNC_WRITE, 116, 0, 4, 0, 3, 1, 2, 3, 4)
    rows = ((1.0, "host", goal), (2.0, "host", PING_3), (2.1, "servo", FIRST))
    line = played(tmp_path / "x.jsonl", *rows)
    assert answer(line, goal + PING_3) == FIRST
    assert line.unknown == 0
    broken = PING_3[:4], PING_3[:9], goal[:11]
    for data in (b"\x00", b"\xff\xff\xfd", *broken):
        assert answer(line, data) == b""
    assert line.unknown == 5
    assert answer(line, broken[0] + PING_3) == FIRST
    assert line.unknown == 6


def test_only_a_write_of_the_same_kind_to_the_same_place_may_differ(tmp_path: Path) -> None:
    line = played(
        tmp_path / "x.jsonl",
        (1.0, "host", sent(3, Instruction.READ, 132, 0, 4, 0)),
        (1.1, "servo", FIRST),
        (2.0, "host", sent(3, Instruction.REG_WRITE, 65, 0, 1)),
        (2.1, "servo", SECOND),
    )
    assert answer(line, sent(3, Instruction.REG_WRITE, 65, 0, 0)) == SECOND
    assert answer(line, sent(3, Instruction.READ, 132, 0, 4, 0)) == FIRST
    for other in (
        sent(3, Instruction.READ, 132, 0, 2, 0),
        sent(3, Instruction.WRITE, 65, 0, 1),
        sent(3, Instruction.REG_WRITE, 66, 0, 1),
        sent(3, Instruction.REG_WRITE, 65, 1, 1),
        sent(7, Instruction.REG_WRITE, 65, 0, 1),
    ):
        assert answer(line, other) == b""
    assert line.unknown == 5
