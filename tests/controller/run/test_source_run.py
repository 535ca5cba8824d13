"""A user's own motion source: checked before torque, run over the physics, held by its log."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.gaits.gait import Needs
from snakewalk.controller.gaits.registry import make_gait
from snakewalk.controller.kinematics.links import BodyView, body_in_world
from snakewalk.controller.motion.gait_motion import GaitMotion
from snakewalk.controller.motion.source import MotionSource, Pace
from snakewalk.controller.report.artifacts import make_artifacts
from snakewalk.controller.run.factory import prepare_run, prepare_source, prepare_walk
from snakewalk.controller.run.request import RunRequest, RunResult
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.runlog.reader import read_log
from snakewalk.controller.studies.replay import differences, replay
from snakewalk.drivers.types import BodyPose
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant
from tests.helpers.line_port import OpenedLine, line_port


class Bend:
    """Bends the middle joint and straightens it again."""

    needs = Needs(yaw=True)

    def __init__(self, robot: RobotConfig, angle_rad: float = 0.6, rate_rad_s: float = 3.0) -> None:
        self.bend_rad: Floats = np.eye(robot.joint_count)[7] * angle_rad
        self.rate_rad_s, self.time_s = rate_rad_s, 0.0

    @property
    def done(self) -> bool:
        return self.rate_rad_s * self.time_s >= 2.0 * np.pi

    def goal_rad(self) -> Floats:
        share = 0.5 * (1.0 - np.cos(self.rate_rad_s * self.time_s))
        return np.asarray(self.bend_rad * share)

    def velocity_rad_s(self) -> Floats:
        share = 0.5 * self.rate_rad_s * np.sin(self.rate_rad_s * self.time_s)
        return np.asarray(self.bend_rad * share)

    def pace(self) -> Pace:
        return Pace.still(len(self.bend_rad))  # whoever trusts this is deceived

    def step(self, dt_s: float, view: BodyView) -> Floats:
        self.time_s = min(self.time_s + dt_s, 2.0 * np.pi / self.rate_rad_s)
        return self.goal_rad()


class Listed(Bend):
    """Returns lists, which no compiled loop accepts."""

    def goal_rad(self) -> Floats:
        return super().goal_rad().tolist()


class Whole(Bend):
    def velocity_rad_s(self) -> Floats:
        return np.zeros(len(self.bend_rad), dtype=int)


class Lifting(Bend):
    needs = Needs(pitch=True)


class Hasty(Bend):
    def pace(self) -> Pace:
        return Pace(np.full(16, 9.0), np.zeros(16))


class Undefined(Bend):
    def step(self, dt_s: float, view: BodyView) -> Floats:
        return super().step(dt_s, view) * (np.nan if self.time_s > 0.5 else 1.0)


class Short(Bend):
    def goal_rad(self) -> Floats:
        return super().goal_rad()[:5]


class Jump(Bend):
    def step(self, dt_s: float, view: BodyView) -> Floats:
        return super().step(dt_s, view) + 0.01 * (self.time_s > 0.5)


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> RunResult:
    return run_robot(RunRequest(prepare_source(Bend, name="bend"), tmp_path_factory.mktemp("run")))


def test_the_goals_in_the_log_are_those_of_the_source(finished: RunResult) -> None:
    record, robot = finished.record, finished.record.header.robot
    head = BodyPose(0.0, np.zeros(3), np.eye(3))
    alone, expected = Bend(robot), []
    while not alone.done:
        view = body_in_world(robot, head, alone.goal_rad())
        expected.append(alone.step(1.0 / record.header.run.cycle_hz, view))
    goals = record.cycle.asked_rad
    np.testing.assert_array_equal(goals[-len(expected) :], expected)
    np.testing.assert_allclose(goals[: -len(expected)], 0.0)
    assert np.abs(record.cycle.measured_rad[:, 7]).max() == pytest.approx(0.6, abs=0.05)


def test_the_run_ends_when_the_source_is_done(finished: RunResult) -> None:
    assert finished.outcome.tripped is None
    assert finished.record.events[-1].text == "torque off; the motion came to its end"
    assert finished.summary.motion == "source"
    assert finished.outcome.duration_s < 5.0


def test_a_run_lasts_no_longer_than_asked(tmp_path: Path) -> None:
    cut = run_robot(RunRequest(prepare_source(Bend, seconds=0.5), tmp_path))
    assert cut.record.events[-1].text == "torque off; the motion was cut off"
    assert cut.outcome.duration_s == pytest.approx(0.8, abs=0.05)  # and 0.3 s before the motion


@pytest.mark.parametrize(
    ("make", "fault"),
    [
        (
            lambda robot: Bend(robot, angle_rad=1.8, rate_rad_s=1.0),
            r"8 \(ID 8\) bends to 1.80 rad",
        ),
        (
            lambda robot: Bend(robot, angle_rad=1.0, rate_rad_s=6.0),
            r"8 \(ID 8\) moves at 3.0. rad/s;",
        ),
        (Jump, r"joint \w+ \(ID \d+\) accelerates at 2\d\.\d\d rad/s2; its limit is 25.00"),
        (Hasty, r"joint yaw_01 \(ID 1\) announces 9.00 rad/s; its limit is 2.00"),
        (Undefined, r"at 0.5\d s its goals are .*nan"),
        (Short, r"yaw16 needs 16 finite angles"),
    ],
)
def test_what_breaks_a_limit_is_refused_before_torque(
    make: Callable[[RobotConfig], MotionSource], fault: str, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=fault):
        run_robot(RunRequest(prepare_source(make), tmp_path / "run"))
    assert not (tmp_path / "run").exists()


def test_every_limit_that_breaks_is_named() -> None:
    prepared = prepare_source(lambda robot: Bend(robot, angle_rad=1.8, rate_rad_s=9.0))
    with pytest.raises(InputError) as caught:
        prepared.check_plan()
    assert len(caught.value.faults) == 3


def test_a_robot_without_the_joints_is_refused() -> None:
    with pytest.raises(InputError, match="the motion source needs pitch joints"):
        prepare_source(Lifting)
    servo = prepare_source(Lifting, robot="alternating16").robot.servo
    assert servo.pitch_current_limit_a >= 1.5  # the pitch joints carry links


def test_one_source_for_every_call_is_refused() -> None:
    sources: list[MotionSource] = []

    def always_one(robot: RobotConfig) -> MotionSource:
        sources.append(Bend(robot))
        return sources[0]

    with pytest.raises(InputError, match="return a new motion source at each call"):
        prepare_source(always_one).check_plan()


def test_a_motion_of_the_library_passes_as_a_source() -> None:
    gait = make_gait("lateral-undulation")
    prepare_source(lambda robot: GaitMotion(gait, robot), seconds=4.0).check_plan()


def test_report_and_replay_need_the_log_alone(finished: RunResult, tmp_path: Path) -> None:
    again = finished.log.parent / "again.mcap"
    report = make_artifacts(finished.record, tmp_path, film=None).report
    assert report is not None
    assert report.stat().st_size > 10_000
    replayed = read_log(replay(finished.record, again))
    assert differences(finished.record, replayed, 0.0, 0.0).identical


def test_a_run_is_not_made_again_from_its_log(finished: RunResult) -> None:
    header = finished.record.header
    with pytest.raises(
        InputError, match=r"its motion was the user's own.*snakewalk log replay LOG"
    ):
        prepare_run(header.run, header.robot, header.world)


@pytest.mark.parametrize("motion", ["gait", "playback", "repertoire", "source"])
def test_no_walk_is_prepared_of_another_motion(motion: str) -> None:
    gait = {"name": "rolling"} if motion == "gait" else None
    with pytest.raises(InputError, match="run flat-square: "):
        prepare_walk("flat-square", motion=motion, gait=gait)


def test_a_run_on_a_port_is_replayed(tmp_path: Path) -> None:
    with line_port(OpenedLine(ServoBank(range(1, 17)), BenchPlant(16))) as port:
        served = run_robot(RunRequest(prepare_source(Bend, seconds=0.4), tmp_path, port))
    assert served.record.header.backend == port
    assert served.record.header.initial_pose is None
    replay(served.record, tmp_path / "again.mcap")


def test_actions_run_on_a_port_are_replayed(finished: RunResult, tmp_path: Path) -> None:
    fields = {"motion": "repertoire", "waypoints_m": ((1.0, 0.0),)}
    run = finished.record.header.run.model_copy(update=fields)
    header = replace(finished.record.header, run=run, initial_pose=None)
    replay(replace(finished.record, header=header), tmp_path / "again.mcap")


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (Listed, r"^the motion source: goal_rad\(\) returns a list; return an array of float64"),
        (Whole, r"velocity_rad_s\(\) returns an array of int64; return an array of float64"),
    ],
)
def test_a_source_that_returns_no_array_of_floats_is_rejected(
    make: Callable[[RobotConfig], MotionSource], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        prepare_source(make, robot="yaw16").check_plan()
