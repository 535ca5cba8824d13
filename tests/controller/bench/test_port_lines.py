"""Commands that care for servos, on a chain whose segments are on two ports."""

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from snakewalk.config.loader import load_robot
from snakewalk.sim.line.clock import SimClock
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant
from tests.helpers.command import Ended, snakewalk
from tests.helpers.line_port import OpenedLine, line_port


class TwoPorts:
    """Servos 1 to 8 on one port, 9 to 16 on another; both in one simulated time."""

    def __init__(self, first: str, second: str, lines: tuple[OpenedLine, OpenedLine]) -> None:
        self.paths, self.lines = (first, second), lines
        self.port = f"1-8={first},9-16={second}"

    def __call__(self, *words: object, port: str | None = None) -> Ended:
        return snakewalk(*map(str, words), "--port", port or self.port)

    def place(self, servo_id: int) -> tuple[OpenedLine, int]:
        """Line and row of a servo."""
        return self.lines[servo_id > 8], (servo_id - 1) % 8


@pytest.fixture
def service() -> Iterator[TwoPorts]:
    clock = SimClock()
    first, second = (
        OpenedLine(ServoBank(range(low, low + 8)), BenchPlant(8), clock) for low in (1, 9)
    )
    first.latency_s = second.latency_s = 0.004  # the time of one goes on while the other is asked
    with line_port(first) as one, line_port(second) as other:
        yield TwoPorts(one, other, (first, second))


def test_scan_and_identify_ask_on_every_port(service: TwoPorts, tmp_path: Path) -> None:
    found = json.loads(service("bus", "scan", "--baud", 1_000_000, "--json").stdout)["servos"]
    assert [each["servo_id"] for each in found] == list(range(1, 17))
    assert [each["port"] for each in found] == [path for path in service.paths for _ in range(8)]
    assert all(path in service("bus", "scan", "--baud", 1_000_000).stdout for path in service.paths)
    file = tmp_path / "found.toml"
    done = service("bus", "inventory", "--baud", 1_000_000, "-o", file)
    assert done.returncode == 0, done.stderr
    robot = load_robot(str(file))
    assert tuple(each.port for each in robot.ports) == service.paths
    assert robot.ports[1].ids == tuple(range(9, 17))


def test_a_servo_on_another_port_than_told_is_named(service: TwoPorts) -> None:
    first, second = service.paths
    told = service("bus", "scan", "--baud", "1000000", port=f"1-7={first},8-16={second}").stderr
    assert f"{first}: servo 8 answers here; --port does not say so" in told


def test_a_backup_has_the_servos_of_all_ports(service: TwoPorts, tmp_path: Path) -> None:
    file = tmp_path / "servos.json"
    assert service("bus", "backup", "-o", file).returncode == 0
    assert [each["id"] for each in json.loads(file.read_text())["servos"]] == list(range(1, 17))
    line, row = service.place(12)
    line.bank["Homing Offset"][row] = 300
    done = service("bus", "restore", file, "--id", 12, "--yes")
    assert done.returncode == 0, done.stderr
    assert line.bank["Homing Offset"][row] == 0


def test_the_doctor_examines_every_port_and_wiggles_the_whole_chain(service: TwoPorts) -> None:
    for k in range(16):
        line, row = service.place(k + 1)
        line.bank["Return Delay Time"][row] = 0
    done = service("doctor", "--robot", "yaw16", "--wiggle", "--json")
    told = json.loads(done.stdout)
    assert told["worst"] == "ok", told
    checks = [each["check"] for each in told["findings"]]
    assert checks.count("servo IDs") == 2
    assert checks.count("wire budget") == 1
    assert checks[-2:] == ["supply under load", "cables"]
    line, row = service.place(12)
    line.mute(np.array([row]), True)
    told = json.loads(service("doctor", "--robot", "yaw16", "--json").stdout)
    failed = [each for each in told["findings"] if each["grade"] == "fail"]
    assert failed[0]["found"].startswith(f"{service.paths[1]}: no answer from servo 12")


@pytest.mark.parametrize(
    ("port", "said"),
    [
        ("1-8=/dev/a,9-16=/dev/a", "/dev/a is named twice"),
        ("1-8=/dev/a,8-16=/dev/b", "ID 8 is on more than one port"),
        ("1-8=/dev/a,9-16=sim", "sim works in runs only"),
    ],
)
def test_a_port_map_that_no_bench_has_is_refused(port: str, said: str) -> None:
    done = snakewalk("bus", "scan", "--port", port)
    assert done.returncode == 2
    assert said in done.stderr


def test_two_servos_with_one_id_make_no_backup(service: TwoPorts, tmp_path: Path) -> None:
    service.lines[1].rename(3, 5)
    done = service("bus", "backup", "-o", tmp_path / "servos.json")
    assert done.returncode == 2
    assert f"ID 5 answers on {service.paths[0]} and on {service.paths[1]}" in done.stderr
    assert not (tmp_path / "servos.json").exists()
