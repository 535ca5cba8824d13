"""Commands that care for servos, on a chain with DYNAMIXEL and Feetech servos on two ports."""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import pytest

from snakewalk.config.loader import load_robot
from snakewalk.config.robot import RobotConfig
from snakewalk.config.servo_catalogue import servo_model
from snakewalk.config.template import plain_toml
from snakewalk.controller.bench.guided_setup import GuidedSetup
from snakewalk.drivers.protocol.registers import baud_code
from snakewalk.sim.feetech.servos import FeetechServos
from snakewalk.sim.line.clock import SimClock
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant
from tests.helpers.command import Ended, snakewalk
from tests.helpers.line_port import OpenedFeetechLine, OpenedLine, line_port


class TwoMakes:
    """XM430 1 to 3 on one port, STS3215 4 to 6 on another; both in one simulated time."""

    def __init__(self, paths: tuple[str, str], first: OpenedLine, other: OpenedFeetechLine) -> None:
        self.paths, self.first, self.other = paths, first, other
        self.port = f"1-3={paths[0]},4-6={paths[1]}"

    def __call__(self, *words: object) -> Ended:
        return snakewalk(*map(str, words), "--port", self.port)

    def robot(self, folder: Path) -> Path:
        """File of the robot."""
        feetech = {"model": "STS3215-C018", "position_p_gain": 64}
        joints = [{"axis": "y", "id": k, **(feetech if k > 3 else {})} for k in range(1, 7)]
        ports = [
            {"port": p, "ids": i} for p, i in zip(self.paths, ((1, 2, 3), (4, 5, 6)), strict=True)
        ]
        servo = {"model": "XM430-W350", "supply_v": 12.0}
        robot = RobotConfig.model_validate(
            {"name": "six", "servo": servo, "joints": joints, "ports": ports}
        )
        file = folder / "six.toml"
        file.write_text(plain_toml(robot), encoding="utf-8")
        return file


@pytest.fixture
def service() -> Iterator[TwoMakes]:
    clock, facts = SimClock(), servo_model("STS3215-C018")
    first = OpenedLine(ServoBank((1, 2, 3)), BenchPlant(3), clock)
    servos = FeetechServos((4, 5, 6), BenchPlant(3), facts)
    for row in range(3):
        servos["Baud Rate"][row] = baud_code(facts, 1_000_000)
        servos.registers.store(row, "Baud Rate")
        servos["Return Delay Time"][row] = 0
    first.bank["Return Delay Time"][:] = 0
    other = OpenedFeetechLine(servos, clock)
    first.latency_s = other.latency_s = 0.004
    with line_port(first) as one, line_port(other) as two:
        yield TwoMakes((one, two), first, other)


@pytest.mark.costs("the doctor examines two chains")
def test_scan_finds_the_servos_of_both_makes(service: TwoMakes) -> None:
    found = json.loads(service("bus", "scan", "--baud", 1_000_000, "--json").stdout)["servos"]
    assert [(each["servo_id"], each["port"]) for each in found] == [
        (servo_id, service.paths[servo_id > 3]) for servo_id in range(1, 7)
    ]
    assert [each["model"][:3] for each in found] == 3 * ["XM4"] + 3 * ["STS"]


@pytest.mark.nightly("a complete examination of two ports: 5 s of CPU")
def test_the_doctor_examines_each_port_by_its_own_make(service: TwoMakes, tmp_path: Path) -> None:
    robot = service.robot(tmp_path)
    told = json.loads(service("doctor", "--robot", robot, "--wiggle", "--json").stdout)
    wrong = [each for each in told["findings"] if each["grade"] != "ok"]
    assert wrong == []
    checks = [each["check"] for each in told["findings"]]
    assert checks.count("servo IDs") == 2
    assert checks.count("firmware") == 1
    assert "supply under load" in checks
    for line, row, servo_id in ((service.first, 1, 2), (service.other, 1, 5)):
        line.mute(np.array([row]), True)
        line.refresh_ids()
        told = json.loads(service("doctor", "--robot", robot, "--json").stdout)
        line.mute(np.array([row]), False)
        line.refresh_ids()
        failed = [each["found"] for each in told["findings"] if each["grade"] == "fail"]
        assert failed[0].startswith(
            f"{service.paths[servo_id > 3]}: no answer from servo {servo_id}"
        )


@pytest.mark.slow_cases(1, "2 cases of 1.4 s of CPU")
@pytest.mark.slow
@pytest.mark.parametrize(("servo_id", "limit"), [(2, "PWM Limit(36)"), (5, "PWM Limit(16)")])
def test_the_doctor_names_the_registers_of_the_port(
    service: TwoMakes, tmp_path: Path, servo_id: int, limit: str
) -> None:
    line = service.other if servo_id > 3 else service.first
    line.bank["PWM Limit"][1] = 500
    told = json.loads(service("doctor", "--robot", service.robot(tmp_path), "--json").stdout)
    weak = [each["found"] for each in told["findings"] if each["check"] == "PWM limit"]
    full = 1000 if servo_id > 3 else 885
    assert len(weak) == 1
    assert f"a {limit} below {full}: weak and slow" in weak[0]


@pytest.mark.slow
def test_a_backup_has_both_makes_and_restores_them(service: TwoMakes, tmp_path: Path) -> None:
    file = tmp_path / "servos.json"
    assert service("bus", "backup", "-o", file).returncode == 0
    assert [each["id"] for each in json.loads(file.read_text())["servos"]] == [1, 2, 3, 4, 5, 6]
    for line, servo_id in ((service.first, 2), (service.other, 5)):
        line.bank["Homing Offset"][1] = 30
        done = service("bus", "restore", file, "--id", servo_id, "--yes")
        assert done.returncode == 0, done.stderr
        assert line.bank["Homing Offset"][1] == 0


def test_a_setting_is_written_on_the_port_of_its_servo(service: TwoMakes) -> None:
    for line, servo_id in ((service.first, 2), (service.other, 5)):
        done = service("bus", "set", "--id", servo_id, "--return-delay", 20, "--yes")
        assert done.returncode == 0, done.stderr
        assert line.bank["Return Delay Time"].tolist() == [0, 10, 0]


@pytest.mark.slow
def test_identify_writes_a_robot_of_two_makes(service: TwoMakes, tmp_path: Path) -> None:
    file = tmp_path / "found.toml"
    done = service("bus", "inventory", "--baud", 1_000_000, "-o", file)
    assert done.returncode == 0, done.stderr
    robot = load_robot(str(file))
    assert robot.is_mixed
    assert robot.position_p_gains == (800, 800, 800, 32, 32, 32)
    assert tuple(each.port for each in robot.ports) == service.paths


def test_calibrate_names_the_way_out(service: TwoMakes, tmp_path: Path) -> None:
    robot = service.robot(tmp_path)
    done = snakewalk(
        *("bus", "calibrate", "--robot", str(robot), "--port", service.paths[0]),
        *("-o", str(tmp_path / "mine.toml")),
    )
    assert done.returncode == 2
    assert "servos of different series on its ports" in done.stderr


def test_such_a_robot_is_not_served_on_one_port(service: TwoMakes, tmp_path: Path) -> None:
    robot = service.robot(tmp_path)
    done = snakewalk("bus", "serve", "--robot", str(robot))
    assert done.returncode == 2
    assert "serve the servos of each port alone" in done.stderr


@pytest.mark.slow
def test_the_guided_setup_leads_two_makes_to_a_rehearsal(service: TwoMakes, tmp_path: Path) -> None:
    """The limit of the voltage tells the 12 V servo from the one of 7.4 V, whose number it has."""
    folder = tmp_path / "snake"
    answers = ["yp", "", "", "s", "", "", "", "q"]
    ended: list[Ended] = []

    def run(words: Sequence[str]) -> int:
        ended.append(snakewalk(*words))
        return ended[-1].returncode

    with pytest.raises(SystemExit) as stop:
        GuidedSetup(folder, service.port, lambda _: answers.pop(0), run).carry_on()
    assert stop.value.code == 0, ended[-1]
    assert answers == []
    robot = load_robot(str(folder / "robot.toml"))
    assert robot.joint_axes == "ypypyp"
    assert [each.ids for each in robot.ports] == [(1, 2, 3), (4, 5, 6)]
    assert {model[:3] for model in robot.servo_models[3:]} == {"STS"}
    assert "STS3215" in ended[1].stdout  # the doctor examined both ports
    assert (folder / "rehearsal" / "report.html").exists()
    for line in (service.first, service.other):
        assert line.bank["Torque Enable"].tolist() == [0] * 3
