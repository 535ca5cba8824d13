"""A chain that nobody knows is found out through its bus and a pair of eyes, and then walks."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import mujoco
import numpy as np
import pytest
from typer.testing import CliRunner

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot, load_world
from snakewalk.config.robot import JointConfig, RobotConfig
from snakewalk.config.robot_file import robot_toml
from snakewalk.controller.app.cli.command_line import app
from snakewalk.controller.app.runs.execute import execute
from snakewalk.controller.app.runs.factory import prepare_walk
from snakewalk.controller.app.service.chain_calibration import (
    WIGGLE_RAD,
    ChainCalibration,
    SeenBend,
    calibrate,
    find_servos,
)
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.errors import ChainError
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
        return SeenBend(joint, 1 if bend > 0.0 else -1)

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
    assert note.startswith(f"joint {BROKEN + 1} (ID {truth.servo_ids[BROKEN]}): stops at -0.6")
    assert not bench.line.bank["Torque Enable"].any()
    assert np.abs(bench.line.bank["Goal Current"]).max() <= round(0.3 / 2.69e-3)

    file = tmp_path / "found.toml"
    file.write_text(robot_toml(robot))
    assert load_robot(str(file)) == robot
    # the same servos, mounted as they are, under a run with the file that was found
    monkeypatch.setattr(Mounting, "of", staticmethod(lambda _: Mounting(*mounted(truth))))
    prepared = prepare_walk("flat-square", robot=str(file), keys={"run.time_limit_s": 15.0})
    finished = execute(prepared, tmp_path / "run")
    assert finished.summary.waypoints_reached >= 1
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
    assert find_servos(bench.line, 0.004) == truth.models_by_id


def test_a_person_answers_at_the_terminal(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    like = tmp_path / "like.toml"
    like.write_text('name = "trio"\njoint_axes = "ypy"\n')
    # ID 4 is joint 3 and reversed, ID 9 is joint 1, ID 30 joint 2 and reversed
    trio = load_robot(str(like)).model_copy(
        update={
            "joints": (
                JointConfig(id=9, zero_rad=0.2),
                JointConfig(id=30, sign=-1, zero_rad=-0.3),
                JointConfig(id=4, sign=-1),
            )
        }
    )
    line = SimLine(
        ServoBank(trio.servo_ids, trio.servo_models), BenchPlant(3), mounting=Mounting.of(trio)
    )

    @contextmanager
    def opened(device: str, baud: int) -> Iterator[SimLine]:
        assert (device, baud) == ("/dev/ttyUSB0", 1_000_000)
        line.latency_s = 0.0  # type: ignore[attr-defined]
        yield line

    monkeypatch.setattr("snakewalk.drivers.port.network_port.open_port", opened)
    out = tmp_path / "mine.toml"
    words = ["calibrate", "--port", "/dev/ttyUSB0", "--robot", str(like), "-o", str(out)]
    # ID 4: nonsense, again, then joint 3 to the right; ID 9; ID 30: taken, then joint 2 down
    answers = "what\na\n3\nr\n1\nl\n1\n2\nd\n\n"
    result = CliRunner().invoke(app, words, input=answers)
    assert result.exit_code == 0, result.output
    assert "joint 1 is ID 9 already" in result.output
    found = load_robot(str(out))
    assert found.name == "mine"
    assert found.servo_ids == trio.servo_ids
    assert found.signs == trio.signs
    # nobody laid these shafts straight: they rest where the wiggles left them
    assert found.zeros_rad == pytest.approx(trio.zeros_rad, abs=0.03)
    assert found.limit_rad == trio.limit_rad
    assert isinstance(CliRunner().invoke(app, words).exception, InputError)  # it is there already
    fewer = CliRunner().invoke(app, [*words, "--force"], input="3\n")
    assert isinstance(fewer.exception, InputError)
    assert not line.bank["Torque Enable"].any()
