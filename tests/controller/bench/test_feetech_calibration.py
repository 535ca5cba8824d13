"""Calibration and inventory of a bus of Feetech servos, by the commands."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest
from click.testing import Result
from typer.testing import CliRunner

from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot
from snakewalk.config.robot import JointConfig, RobotConfig
from snakewalk.controller.bench.calibration.chain_calibration import find_servos
from snakewalk.controller.bench.commands import calibrate as calibrate_command
from snakewalk.controller.cli.command_line import app
from snakewalk.drivers.bus.feetech_bus import FeetechBus
from snakewalk.drivers.chain.fingerprint_file import FingerprintFile
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.port.byte_port import BytePort
from snakewalk.sim.feetech.line import FeetechLine
from snakewalk.sim.feetech.servos import FeetechServos
from snakewalk.sim.plant import Mounting
from snakewalk.sim.serve.bench_line import bench_line
from snakewalk.sim.serve.chain_spec import parse_chain
from snakewalk.sim.servo.bench import BenchPlant

ANSWERS = "3\nr\n1\nl\n2\nd\n"
"""ID 4 moves joint 3 to the right, ID 9 joint 1 to the left, ID 30 joint 2 down."""


@dataclass
class Trio:
    """Three servos, and commands on their port."""

    robot: RobotConfig
    line: FeetechLine
    like: Path

    @property
    def out(self) -> Path:
        return self.like.with_name("mine.toml")

    def __call__(self, *words: str) -> Result:
        return CliRunner().invoke(app, [*words, "--port", "/dev/ttyUSB0"], input=ANSWERS)

    def calibrate(self, *more: str) -> Result:
        like, out = str(self.like), str(self.out)
        return self("bus", "calibrate", "--robot", like, "-o", out, "--json", *more)


@pytest.fixture
def trio(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Trio:
    model = getattr(request, "param", "STS3215")
    like = tmp_path / "like.toml"
    volts = f'model = "{model}"\nsupply_v = 6.0\nover_current_a = 0.8\n'
    like.write_text(f'name = "trio"\njoint_axes = "ypy"\n[servo]\n{volts}')
    joints = (
        JointConfig(id=9, zero_rad=0.2),
        JointConfig(id=30, sign=-1, zero_rad=-0.3),
        JointConfig(id=4, sign=-1),
    )
    robot = load_robot(str(like)).model_copy(update={"joints": joints})
    facts = robot.servo_records[0]
    line = FeetechLine(
        FeetechServos(robot.servo_ids, BenchPlant(3), facts, mounting=Mounting.of(robot))
    )
    line.latency_s = 0.0  # type: ignore[attr-defined]

    @contextmanager
    def opened(device: str, baud: int) -> Iterator[BytePort]:
        yield line

    for module in ("drivers.port.network_port", "controller.bench.commands.calibrate"):
        monkeypatch.setattr(f"snakewalk.{module}.open_port", opened)

    def straighten(_: object) -> None:
        assert not line.servos["Torque Enable"].any()
        line.servos.plant.position_rad[:] = 0.0

    monkeypatch.setattr(calibrate_command._Person, "straighten", straighten)
    return Trio(robot, line, like)


@pytest.mark.slow_cases(1, "a complete calibration each: 10 to 30 s of CPU")
@pytest.mark.nightly("a complete calibration: 8 s of CPU")
@pytest.mark.parametrize("trio", ["HLS3606", "SCS0009", "STS3215"], indirect=True)
def test_calibrate_finds_joints_signs_and_zeros(trio: Trio) -> None:
    result = trio.calibrate()
    assert result.exit_code == 0, result.output
    found = load_robot(str(trio.out))
    assert found.servo_ids == trio.robot.servo_ids
    assert found.signs == trio.robot.signs
    assert found.zeros_rad == pytest.approx(trio.robot.zeros_rad, abs=0.01)
    known = FingerprintFile(trio.out).read()
    assert known is not None
    assert sorted(known) == [4, 9, 30]
    assert not trio.line.servos["Torque Enable"].any()


@pytest.mark.slow
def test_zeros_in_the_servos_outlast_power_off(trio: Trio) -> None:
    result = trio.calibrate("--homing-offset", "--yes", "--no-sweep")
    assert result.exit_code == 0, result.output
    for row in range(3):
        trio.line.servos.reboot(row)
    offsets = trio.line.servos["Homing Offset"].tolist()
    assert json.loads(result.stdout)["homing_offsets"] == dict(
        zip(("9", "30", "4"), offsets, strict=True)
    )
    assert offsets == pytest.approx([130, -196, 0], abs=1)
    found = load_robot(str(trio.out))
    assert found.zeros_rad == (0.0, 0.0, 0.0)
    chain = ServoChain(FeetechBus(trio.line, found.models_by_id), found)
    assert chain.enable().position_rad == pytest.approx(0.0, abs=0.002)
    chain.disable()
    backup = json.loads(trio.out.with_name("mine-eeprom.json").read_text())
    assert [each["id"] for each in backup["servos"]] == [4, 9, 30]


@pytest.mark.slow
@pytest.mark.parametrize("trio", ["SCS0009"], indirect=True)
def test_servos_without_homing_offset_keep_their_zeros_in_the_file(trio: Trio) -> None:
    result = trio.calibrate("--homing-offset", "--yes", "--no-sweep")
    assert isinstance(result.exception, InputError)
    assert "SCS0009 has no Homing Offset" in str(result.exception)
    assert load_robot(str(trio.out)).zeros_rad == pytest.approx(trio.robot.zeros_rad, abs=0.01)


@pytest.mark.slow
def test_bus_identify_lists_the_servos_and_writes_a_robot_file(trio: Trio) -> None:
    words = ["bus", "inventory", "--baud", "1000000", "--json", "-o", str(trio.out)]
    result = trio(*words)
    assert result.exit_code == 0, result.output
    servos = json.loads(result.stdout)["servos"]
    assert {each["servo_id"]: each["model"] for each in servos} == dict.fromkeys(
        (4, 9, 30), "STS3215"
    )
    assert {each["state"]["torque_on"] for each in servos} == {False}
    robot = load_robot(str(trio.out))
    assert (robot.servo_ids, robot.servo.model) == ((4, 9, 30), "STS3215")


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize(
    ("servos", "feetech", "model"),
    [("1-3:STS3215", False, "STS3215"), ("1-3:XL330-M288", True, "XL330-M288")],
)
def test_servos_of_another_make_than_the_robots_are_named(
    servos: str, feetech: bool, model: str
) -> None:
    """The default robot on a Feetech bus: "the bus has 0 servos"."""
    line = bench_line(parse_chain(servos))
    with pytest.raises(InputError, match=rf"ID 1, 2, 3\) are {model}, of another make") as info:
        find_servos(line, 0.004, 3, feetech=feetech)
    assert f"model = '{model}'" in str(info.value)
