"""Who is on the wire, and the robot's file that is suggested of it."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from typer.testing import CliRunner

from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot
from snakewalk.controller.cli.command_line import app
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.serve.bench_line import bench_line
from snakewalk.sim.serve.chain_spec import parse_chain
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant

MODELS = {21: "XM430-W350", 7: "XM430-W350", 3: "XM430-W210"}


@pytest.fixture
def line(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> SimLine:
    models = getattr(request, "param", MODELS)
    if isinstance(models, str):
        made = bench_line(parse_chain(models))
    else:
        made = SimLine(ServoBank(list(models), list(models.values())), BenchPlant(len(models)))
    made.latency_s = 0.0  # type: ignore[attr-defined]

    @contextmanager
    def opened(device: str, baud: int) -> Iterator[SimLine]:
        yield made

    monkeypatch.setattr("snakewalk.drivers.port.network_port.open_port", opened)
    return made


def call(*words: object):
    rates = ["--baud", "1000000", "--baud", "57600"]
    return CliRunner().invoke(app, ["bus", "inventory", "--port", "any", *rates, *map(str, words)])


def test_each_servo_is_told_with_its_state_and_nothing_changes(line: SimLine) -> None:
    bank = line.bank
    bank["Hardware Error Status"][1] = 0x20
    bank["Torque Enable"][0] = 1
    kept = bank.table[:, :64].copy()
    servos = json.loads(call("--json").stdout)["servos"]
    assert (bank.table[:, :64] == kept).all()
    assert {servo["servo_id"]: servo["model"] for servo in servos} == MODELS
    state = {servo["servo_id"]: servo["state"] for servo in servos}
    assert state[7]["hardware_error"] == 0x20
    assert [state[each]["torque_on"] for each in (3, 7, 21)] == [False, False, True]
    assert "alarm: overload" in call().stdout


def test_the_robots_file_has_them_by_id_and_says_what_it_assumes(
    line: SimLine, tmp_path: Path
) -> None:
    out = tmp_path / "mine.toml"
    assert call("-o", out).exit_code == 0
    robot = load_robot(str(out))
    assert dict(zip(robot.servo_ids, robot.servo_models, strict=True)) == MODELS
    assert robot.servo_ids == (3, 7, 21)
    assert robot.joint_axes == "yyy"
    assert robot.servo.supply_v == pytest.approx(12.0, abs=0.2)
    assert "axes" in out.read_text()
    assert isinstance(call("-o", out).exception, InputError)  # it exists


def test_an_empty_wire_is_told(monkeypatch: pytest.MonkeyPatch, line: SimLine) -> None:
    monkeypatch.setattr(line, "setBaudRate", lambda rate: False)
    error = call().exception
    assert isinstance(error, InputError)
    assert "no servo replies" in str(error)


@pytest.mark.parametrize("line", [{1: "XL430-W250", 2: "XL430-W250"}], indirect=True)
def test_a_voltage_has_the_digits_that_the_servo_measures(line: SimLine, tmp_path: Path) -> None:
    """It was 11.100000000000001."""
    file = tmp_path / "mine.toml"
    assert call("-o", file).exit_code == 0
    assert "supply_v = 11.1\n" in file.read_text()


@pytest.mark.usefixtures("line")
@pytest.mark.parametrize(
    ("line", "model"),
    [(f"1-2:{model}", model) for model in ("STS3215", "STS3215-C018")],
    indirect=["line"],
)
def test_a_servo_of_12_v_is_told_from_one_of_7_v_with_its_number(
    model: str, tmp_path: Path
) -> None:
    """It was listed as STS3215, and the setup stopped at its supply of 12 V."""
    out = tmp_path / "mine.toml"
    assert call("-o", out).exit_code == 0
    assert load_robot(str(out)).servo_models == (model, model)
    assert "Max Voltage Limit tells STS3215 from STS3215-C018" in out.read_text()
