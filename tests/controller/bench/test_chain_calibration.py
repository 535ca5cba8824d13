"""A chain that nobody knows is found out through its bus and a pair of eyes, and then walks."""

import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest
from click.testing import Result
from typer.testing import CliRunner

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot, load_world
from snakewalk.config.robot import JointConfig, RobotConfig
from snakewalk.config.template import plain_toml
from snakewalk.controller.bench.calibration.chain_calibration import (
    ChainCalibration,
    calibrate,
    find_servos,
)
from snakewalk.controller.bench.calibration.progress import SeenBend
from snakewalk.controller.bench.calibration.slow_motions import WIGGLE_RAD
from snakewalk.controller.bench.commands import calibrate as calibrate_command
from snakewalk.controller.bench.homing_offset import (
    HomingOffset,
    homing_written,
    plan_homing,
)
from snakewalk.controller.cli.command_line import app
from snakewalk.controller.run.factory import prepare_walk
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.chain.fingerprint_file import FingerprintFile
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.errors import BusError, ChainError
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.physics.plant import MujocoPlant
from snakewalk.sim.plant import Mounting, ServoDrive
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant

LIKE = load_robot("yaw16")
JOINTS = LIKE.joint_count
BROKEN, STOP_RAD = 5, 0.62
TICK_RAD = 2.0 * np.pi / 4096
SEED = 20
ANSWERS = "what\na\n3\nr\n1\nl\n1\n2\nd\n\n"
"""ID 4: nonsense, again, then joint 3 to the right; ID 9; ID 30: taken, then joint 2 down."""


class Filmed(MujocoPlant):
    """A body in front of a camera that keeps the joints' angles as anybody could see them."""

    def advance(self, until_s: float, drive: ServoDrive) -> None:
        super().advance(until_s, drive)
        if not hasattr(self, "film"):
            self.film: list[Floats] = []
        self.film.append(self.position_rad.copy())


@dataclass
class Onlooker:
    """Sees a body; lays it straight with a steady, but human, hand."""

    plant: Filmed
    hand_rad: Floats
    asked: list[int] = field(default_factory=list)

    def which(
        self, servo_id: int, wiggle: Callable[[], None], known: Mapping[int, int]
    ) -> SeenBend:
        self.asked.append(servo_id)
        self.plant.film = []
        wiggle()
        film = np.array(self.plant.film) - self.plant.film[0]
        most = np.abs(film).max(axis=0)
        joint = int(most.argmax())
        others = np.delete(most, joint)
        assert most[joint] < 1.5 * WIGGLE_RAD  # a small range
        assert others.max() < 0.2 * WIGGLE_RAD  # and one joint at a time
        assert joint not in known
        bend = film[np.abs(film[:, joint]).argmax(), joint]
        return SeenBend(joint=joint, direction=1 if bend > 0.0 else -1)

    def straighten(self) -> None:
        assert not self.plant_has_torque()
        self.plant.mechanics.data.qpos[7:] = self.hand_rad
        self.plant.mechanics.data.qvel[:] = 0.0
        mujoco.mj_forward(self.plant.mechanics.model, self.plant.mechanics.data)
        self.plant.mechanics.start_at_rest()

    plant_has_torque: Callable[[], bool] = lambda: False


def planted(rng: np.random.Generator) -> RobotConfig:
    """The robot with scrambled IDs, reversed signs and crooked horns."""
    ids = rng.choice(np.arange(253), JOINTS, replace=False)
    joints = tuple(
        JointConfig(
            id=int(ids[k]),
            sign=1 if rng.random() < 0.5 else -1,
            zero_rad=float(rng.uniform(-0.8, 0.8)),
        )
        for k in range(JOINTS)
    )
    return LIKE.model_copy(update={"joints": joints})


@dataclass
class Bench:
    """An unknown robot, hung up so that no joint carries weight: in still water."""

    truth: RobotConfig
    plant: Filmed
    line: SimLine
    onlooker: Onlooker
    rng: np.random.Generator

    @staticmethod
    def of(truth: RobotConfig, rng: np.random.Generator) -> "Bench":
        plant = Filmed(truth, load_world("pool"))
        plant.reset((0.0, 0.0), 0.0, rng.uniform(-0.2, 0.2, JOINTS))
        plant.mechanics.model.jnt_range[1 + BROKEN] = -STOP_RAD, 1.6  # something is jammed
        bank = ServoBank(truth.servo_ids, truth.servo_models)
        line = SimLine(bank, plant, mounting=Mounting.of(truth))
        onlooker = Onlooker(plant, rng.normal(0.0, 0.005, JOINTS))
        onlooker.plant_has_torque = lambda: bool(bank["Torque Enable"].any())
        return Bench(truth, plant, line, onlooker, rng)

    def calibrate(self, **options: object) -> ChainCalibration:
        return calibrate(self.line, LIKE, self.onlooker, name="found", **options)  # type: ignore[arg-type]


@pytest.mark.nightly("a complete calibration: 7 s of CPU")
def test_a_chain_is_found_out_completely_and_then_walks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rng = np.random.default_rng(SEED)
    bench = Bench.of(planted(rng), rng)
    truth = bench.truth
    with pytest.raises(ChainError):  # as if nothing were unusual: it cannot even begin
        ServoChain(DynamixelBus(bench.line), LIKE).enable()
    found = bench.calibrate()
    robot = found.robot
    assert robot.servo_ids == truth.servo_ids
    assert robot.signs == truth.signs
    # straight is where the hand laid it
    crooked = np.array(truth.signs) * bench.onlooker.hand_rad
    assert robot.zeros_rad == pytest.approx(truth.zeros_rad + crooked, abs=1.5 * TICK_RAD)
    limits = np.array(robot.limit_rad)
    assert limits[BROKEN] == pytest.approx(STOP_RAD - 0.1, abs=0.03)
    assert (np.delete(limits, BROKEN) == 1.5).all()
    (note,) = found.notes
    assert note.startswith(
        f"joint yaw_{BROKEN + 1:02d} (ID {truth.servo_ids[BROKEN]}): stops at -0.6"
    )
    assert not bench.line.bank["Torque Enable"].any()
    assert np.abs(bench.line.bank["Goal Current"]).max() <= round(0.3 / 2.69e-3)

    file = tmp_path / "found.toml"
    file.write_text(plain_toml(robot))
    assert load_robot(str(file)) == robot
    # the same servos, mounted as they are, under a run with the file that was found
    monkeypatch.setattr(Mounting, "of", staticmethod(lambda _: Mounting(*mounted(truth))))
    near = {"waypoints_m": ((1.0, 0.2),), "time_limit_s": 15.0}
    finished = run_robot(
        RunRequest(prepare_walk("flat-square", robot=str(file), **near), tmp_path / "run")
    )
    assert finished.outcome.complete
    assert finished.summary.path_error_mean_m is not None
    assert finished.summary.path_error_mean_m < 0.1


@pytest.mark.nightly("a whole walk after a whole calibration")
def test_a_chain_that_was_found_out_walks_the_square(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rng = np.random.default_rng(SEED)
    bench = Bench.of(planted(rng), rng)
    file = tmp_path / "found.toml"
    file.write_text(plain_toml(bench.calibrate().robot))
    monkeypatch.setattr(Mounting, "of", staticmethod(lambda _: Mounting(*mounted(bench.truth))))
    finished = run_robot(RunRequest(prepare_walk("flat-square", robot=str(file)), tmp_path / "run"))
    assert (finished.outcome.reached, finished.outcome.missed) == (4, 0)
    assert finished.outcome.tripped is None
    assert finished.summary.path_error_mean_m is not None
    assert finished.summary.path_error_mean_m < 0.1


def mounted(robot: RobotConfig) -> tuple[Floats, Floats]:
    return np.array(robot.signs, np.float64), np.array(robot.zeros_rad)


def test_a_joint_that_is_held_is_told_and_torque_is_off() -> None:
    rng = np.random.default_rng(1)
    bench = Bench.of(planted(rng), rng)
    row = int(np.argmin(bench.truth.servo_ids))
    bench.plant.mechanics.model.dof_armature[6 + row] = 1e3  # a hand holds it
    held = bench.truth.servo_ids[row]
    with pytest.raises(InputError, match=f"ID {held}: moved by 0.0.* is it held"):
        bench.calibrate()
    assert not bench.line.bank["Torque Enable"].any()


def test_servos_that_are_too_few_or_share_an_id_are_told_before_anything_moves() -> None:
    rng = np.random.default_rng(2)
    bench = Bench.of(planted(rng), rng)
    before = bench.plant.position_rad.copy()
    bench.line.rename(4, 252)
    bench.line.rename(5, 252)
    bench.line.bank["Return Delay Time"][4] = 100  # else the two replies lie upon each other
    bench.line.refresh_ids()
    with pytest.raises(InputError, match="ID 252 come doubled or damaged"):
        bench.calibrate()
    bench.line.mute(np.array([4, 5]), True)
    bench.line.refresh_ids()
    with pytest.raises(InputError, match="16 joints, the bus 14 servos"):
        bench.calibrate()
    assert not bench.onlooker.asked
    assert bench.plant.position_rad == pytest.approx(before, abs=0.02)


def test_models_are_read_from_the_servos() -> None:
    mixed = tuple(
        JointConfig(id=20 + k, model="XL330-M288" if k == 3 else None) for k in range(JOINTS)
    )
    truth = LIKE.model_copy(update={"joints": mixed})
    bench = Bench.of(truth, np.random.default_rng(3))
    assert find_servos(bench.line, 0.004) == dict(
        zip(truth.servo_ids, truth.servo_models, strict=True)
    )


@dataclass
class Trio:
    """Three servos, a robot's file like them, and the command line at their port."""

    robot: RobotConfig
    line: SimLine
    folder: Path

    @property
    def out(self) -> Path:
        return self.folder / "mine.toml"

    @property
    def words(self) -> list[str]:
        like = str(self.folder / "like.toml")
        return ["bus", "calibrate", "--port", "/dev/ttyUSB0", "--robot", like, "-o", str(self.out)]

    def __call__(self, *more: str, answers: str = ANSWERS) -> Result:
        return CliRunner().invoke(app, [*self.words, *more], input=answers)


@pytest.fixture
def trio(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Trio:
    like = tmp_path / "like.toml"
    like.write_text('name = "trio"\njoint_axes = "ypy"\n')
    # ID 4 is joint 3 and reversed, ID 9 is joint 1, ID 30 joint 2 and reversed
    robot = load_robot(str(like)).model_copy(
        update={
            "joints": (
                JointConfig(id=9, zero_rad=0.2),
                JointConfig(id=30, sign=-1, zero_rad=-0.3),
                JointConfig(id=4, sign=-1),
            )
        }
    )
    bank = ServoBank(robot.servo_ids, robot.servo_models)
    line = SimLine(bank, BenchPlant(3), mounting=Mounting.of(robot))

    @contextmanager
    def opened(device: str, baud: int) -> Iterator[SimLine]:
        assert (device, baud) == ("/dev/ttyUSB0", 1_000_000)
        line.latency_s = 0.0  # type: ignore[attr-defined]
        yield line

    for module in ("drivers.port.network_port", "controller.bench.commands.calibrate"):
        monkeypatch.setattr(f"snakewalk.{module}.open_port", opened)
    return Trio(robot, line, tmp_path)


@pytest.mark.slow
def test_a_person_answers_at_the_terminal(trio: Trio) -> None:
    result = trio()
    assert result.exit_code == 0, result.output
    assert "1 is joint yaw_01 (ID 9), assigned by an earlier answer" in result.output
    found = load_robot(str(trio.out))
    assert found.name == "mine"
    assert found.servo_ids == trio.robot.servo_ids
    assert found.signs == trio.robot.signs
    # nobody laid these shafts straight: they rest where the wiggles left them
    assert found.zeros_rad == pytest.approx(trio.robot.zeros_rad, abs=0.03)
    assert found.limit_rad == trio.robot.limit_rad
    known = FingerprintFile(trio.out).read()
    assert known is not None
    assert sorted(known) == sorted(trio.robot.servo_ids)
    assert isinstance(trio().exception, InputError)  # it is there already
    assert isinstance(trio("--force", answers="3\n").exception, InputError)  # fewer answers
    assert not trio.line.bank["Torque Enable"].any()


def joints_rad(trio: Trio) -> Floats:
    """As a chain reads them that is given the file."""
    found = load_robot(str(trio.out))
    chain = ServoChain(DynamixelBus(trio.line, found.models_by_id), found)
    try:
        return chain.enable().position_rad
    finally:
        chain.disable()


@pytest.mark.slow
def test_zeros_go_into_the_servos_and_the_file_has_none(trio: Trio) -> None:
    trio.line.bank["Homing Offset"][0] = -70  # of somebody before
    trio.line.bank["Drive Mode"][1] = 1  # reverse: its sign turns, the offset's does not
    kept = trio.line.bank.table[:, 7:64].copy()
    answers = ANSWERS.replace("d", "u")
    result = trio("--homing-offset", "--yes", "--json", answers=answers)
    assert result.exit_code == 0, result.output
    told = json.loads(result.stdout)
    assert told["homing_written"]
    offsets = {str(i): h for i, h in zip((9, 30, 4), trio.line.bank["Homing Offset"], strict=True)}
    assert told["homing_offsets"] == offsets
    # joint 2's servo is the wrong way round twice: its zero is on the other side of its centre
    expected = np.array([-0.2, -0.3, 0.0]) / TICK_RAD
    assert list(offsets.values()) == pytest.approx(expected, abs=0.03 / TICK_RAD)
    found = load_robot(str(trio.out))
    assert found.zeros_rad == (0.0, 0.0, 0.0)
    assert found.signs == (1, 1, -1)
    assert "in Homing Offset" in trio.out.read_text()
    assert joints_rad(trio) == pytest.approx(np.zeros(3), abs=2 * TICK_RAD)
    # all that the EEPROM held is in the backup
    backup = trio.folder / "mine-eeprom.json"
    assert told["backup"] == str(backup)
    assert CliRunner().invoke(app, ["bus", "restore", str(backup), "--yes"]).exit_code != 0
    again = ["bus", "restore", str(backup), "--yes", "--port", "/dev/ttyUSB0"]
    assert CliRunner().invoke(app, again).exit_code == 0
    assert (trio.line.bank.table[:, 7:64] == kept).all()


def test_nothing_moves_where_nobody_can_say_yes(trio: Trio) -> None:
    assert "add --yes" in str(trio("--homing-offset").exception)
    assert "goes with --homing-offset" in str(trio("--yes").exception)
    assert trio.line.clock.now_s() == 0.0
    assert not list(trio.folder.glob("mine*"))


def test_who_says_no_has_the_zeros_in_the_file(trio: Trio, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(calibrate_command, "_confirm_registers", lambda offsets, backup: False)
    monkeypatch.setattr(calibrate_command.sys, "stdin", SimpleNamespace(isatty=lambda: True))
    lines = iter(ANSWERS.splitlines())
    monkeypatch.setattr("builtins.input", lambda: next(lines))
    calibrate_command.calibrate(
        trio.out, str(trio.folder / "like.toml"), "/dev/ttyUSB0", homing_offset=True
    )
    assert not trio.line.bank["Homing Offset"].any()
    assert joints_rad(trio) == pytest.approx(np.zeros(3), abs=2 * TICK_RAD)


def test_offsets_that_a_servo_would_ignore_or_that_leave_its_turn_are_refused(trio: Trio) -> None:
    near, far, wide = (
        joint.model_copy(update=keys)
        for joint, keys in zip(
            trio.robot.joints,
            ({}, {"zero_rad": 1.7}, {"zero_rad": -1.4, "limit_rad": 1.7}),
            strict=True,
        )
    )
    robot = trio.robot.model_copy(update={"joints": (near, far, wide)})
    trio.line.bank["Homing Offset"][2] = 80
    with pytest.raises(InputError) as refused:
        plan_homing(DynamixelBus(trio.line, robot.models_by_id), robot)
    ignored, beyond = refused.value.faults
    assert ignored.startswith(
        "joint pitch_02 (ID 30): needs Homing Offset -1108: beyond 1024 the servo"
    )
    assert beyond.startswith(
        "joint yaw_03 (ID 4): needs Homing Offset 993: with its limit of 1.7 rad"
    )


def test_offsets_are_put_back_where_one_servo_does_not_do_as_the_manual_says(trio: Trio) -> None:
    bus = DynamixelBus(trio.line, trio.robot.models_by_id)
    offsets = plan_homing(bus, trio.robot)
    assert [each.after for each in offsets] == [-130, 196, 0]
    turned = [offsets[0], HomingOffset(30, before=100, after=196), offsets[2]]
    said = r"Position by \+196.*all Homing Offsets are as they were"
    with pytest.raises(BusError, match=said), homing_written(bus, turned):
        pytest.fail("written")
    assert trio.line.bank["Homing Offset"].tolist() == [0, 100, 0]
    trio.line.bank["Homing Offset"][1] = 0

    def full_disk() -> None:
        with homing_written(bus, offsets):
            assert trio.line.bank["Homing Offset"].tolist() == [-130, 196, 0]
            raise OSError("full")

    with pytest.raises(OSError, match="full"):
        full_disk()
    assert not trio.line.bank["Homing Offset"].any()
    trio.line.mute(np.array([1]), True)
    with pytest.raises(BusError, match=r"left in servo 30 \(196, was 0\): restore the backup"):
        homing_written(bus, offsets).__enter__()
