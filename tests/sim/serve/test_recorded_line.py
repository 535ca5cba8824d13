"""A recorded exchange is a device: who asks the same gets the replies that were recorded."""

import json
from pathlib import Path

import pytest

from snakewalk.config.errors import InputError
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.errors import NoAnswerError
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
        (json.dumps({"t": 0, "from": "servo", "hex": "ff"}) + "\n", "no host sends anything"),
        ("", "no host sends anything"),
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
