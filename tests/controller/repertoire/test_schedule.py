"""``gait repertoire play``: wanted speed and turn become actions, on the simulated bus."""

from pathlib import Path

import numpy as np
import pytest

from snakewalk.config.errors import ConfigError, InputError
from snakewalk.config.schedule import ScheduleConfig
from snakewalk.controller.kinematics.links import body_in_world
from snakewalk.controller.repertoire.prepare_schedule import prepare_schedule
from snakewalk.controller.repertoire.repertoire import Repertoire
from snakewalk.controller.repertoire.schedule_run import ScheduleMotion, read_schedule
from snakewalk.controller.run.factory import prepare_run
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.drivers.types import BodyPose
from tests.helpers.command import snakewalk


@pytest.fixture(scope="module")
def file(repertoire: Repertoire, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("schedule") / "r.npz"
    repertoire.save(path)
    return path


WANTED = ScheduleConfig(
    speed_m_s=((0.0, 0.6), (2.4, 0.6), (2.5, 0.0), (5.0, 0.0), (5.1, -0.4)),
    turn_rad_s=((0.0, 0.9), (1.2, 0.9), (1.3, 0.0)),
    duration_s=10.5,
)


@pytest.mark.slow_cases(1, "2 cases of 1.3 s of CPU")
@pytest.mark.slow
@pytest.mark.parametrize("size", [1.0, 1.4])
def test_the_body_does_what_the_actions_did_when_recorded_also_at_another_size(
    file: Path, tmp_path: Path, size: float
) -> None:
    keys = {"robot.link_length_m": 0.07 * size}
    speed = tuple((time_s, size * speed_m_s) for time_s, speed_m_s in WANTED.speed_m_s)
    prepared = prepare_schedule(file, WANTED.model_copy(update={"speed_m_s": speed}), keys=keys)
    assert prepared.scale == pytest.approx(size)
    finished = run_robot(RunRequest(prepared, tmp_path))
    assert isinstance(finished.source, ScheduleMotion)
    names = [segment.name for segment in prepared.repertoire.segments]
    played = finished.source.played
    done = [names[one.action] for one in played]
    assert done[:2] == ["left-sharp", "forward-fast"]
    at = done.index("brake")
    assert set(done[at + 1 :]) <= {"rest", "reverse"}
    back = played[-1]
    assert done[-1] == "reverse"
    assert back.recorded[0] == pytest.approx(-0.377 * size, rel=0.03)
    assert back.measured[0] == pytest.approx(back.recorded[0], rel=0.1)
    assert finished.outcome.tripped is None
    record = finished.record
    assert prepare_run(record.header.run, prepared.robot, prepared.world) == prepared


def test_a_motion_on_paper_follows_its_schedule_and_ends_at_rest(file: Path) -> None:
    prepared = prepare_schedule(file, WANTED)
    motion = prepared.make_source(lambda kind, text: None)
    still = body_in_world(prepared.robot, BodyPose(0.0, np.zeros(3), np.eye(3)), np.zeros(16))
    goals = [motion.goal_rad()]
    for _ in range(1400):
        goals.append(motion.step(0.01, still))
    assert motion.done
    np.testing.assert_array_equal(goals[-1], goals[-2])
    speed = np.diff(goals, axis=0) / 0.01
    assert np.abs(speed).max() <= 1.03 * prepared.robot.joint_speed_limit_rad_s


def test_a_schedule_is_toml_or_csv(tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text("speed_m_s = [[0, 0.5], [4, 0.0]]\nduration_s = 9.0\n")
    assert read_schedule(tmp_path / "a.toml").speed_m_s == ((0.0, 0.5), (4.0, 0.0))
    (tmp_path / "a.csv").write_text("time_s,speed_m_s,turn_rad_s\n0,0.5,0.1\n4,0.0,-0.1\n")
    found = read_schedule(tmp_path / "a.csv")
    assert found.turn_rad_s == ((0.0, 0.1), (4.0, -0.1))
    assert found.duration_s == 4.0


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("time_s,speed\n0,1\n", "expected the columns time_s,speed_m_s,turn_rad_s"),
        ("time_s,speed_m_s,turn_rad_s\n0,fast,0\n", ":2: fast where a number should be"),
        ("time_s,speed_m_s,turn_rad_s\n0,nan,0\n", ":2: nan where a number should be"),
        ("time_s,speed_m_s,turn_rad_s\n0,1\n", ":2: nothing where a number should be"),
        ("time_s,speed_m_s,turn_rad_s\n", "no rows"),
        ("time_s,speed_m_s,turn_rad_s\n2,1,0\n1,1,0\n", "times that increase"),
        ("", "expected the columns"),
    ],
)
def test_a_wrong_table_is_told(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "a.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=said):
        read_schedule(path)


def test_what_cannot_be_played_is_said(file: Path) -> None:
    for given, said in (
        ({"robot": "alternating16"}, "joints"),
        ({"world": "jacksboro-gentle"}, "flat one"),
        ({"keys": {"run.repertoire.patience": 2}}, "is given by FILE"),
    ):
        with pytest.raises(InputError, match=said):
            prepare_schedule(file, WANTED, **given)
    with pytest.raises(ConfigError, match="patience"):
        prepare_schedule(file, WANTED, patience=0)


@pytest.mark.parametrize("port", [(), ("--port", "/dev/ttyUSB0")])
def test_a_direction_that_was_not_recorded_is_rejected_before_torque(
    file: Path, tmp_path: Path, port: tuple[str, ...]
) -> None:
    out = ("--out", str(tmp_path / "run"), "--no-film")
    done = snakewalk(
        *("gait", "repertoire", "play", str(file), "--speed=-0.4", "--turn", "0.3", *port, *out)
    )
    assert done.returncode == 2
    assert "do not have -0.4 m/s and 0.3 rad/s in the mean (from 0.0 s)" in done.stderr
    assert "with 0.3 rad/s: 0.42 to 0.59 m/s; with -0.4 m/s: 0.00 rad/s" in done.stderr
    assert not (tmp_path / "run").exists()


def test_a_direction_that_is_missing_for_a_moment_is_a_transition(
    file: Path, caplog: pytest.LogCaptureFixture
) -> None:
    speed = ((0.0, 0.6), (4.0, 0.6), (4.4, -0.4))
    turn = ((0.0, 0.9), (4.0, 0.9), (4.4, 0.0))
    prepare_schedule(file, ScheduleConfig(speed_m_s=speed, turn_rad_s=turn))
    assert not caplog.messages
    with pytest.raises(InputError, match=r"-0\.4 m/s and 0\.9 rad/s in the mean \(from 4\.4 s"):
        prepare_schedule(file, ScheduleConfig(speed_m_s=speed, turn_rad_s=0.9))


def test_a_ramp_to_speeds_that_no_action_has_is_reported(
    file: Path, caplog: pytest.LogCaptureFixture
) -> None:
    prepare_schedule(file, ScheduleConfig(speed_m_s=((0.0, 0.5), (20.0, 1.5))))
    assert "rad/s in the mean (from " in caplog.text
    assert "they have with 0 rad/s: 0.38 to 0.60 or 0.00 or -0.38 m/s" in caplog.text
    with pytest.raises(InputError, match=r"do not have 1\.5 m/s and 0 rad/s in the mean"):
        prepare_schedule(file, ScheduleConfig(speed_m_s=1.5))


@pytest.mark.slow
def test_a_body_that_goes_backward_comes_to_rest_without_going_forward(
    file: Path, tmp_path: Path
) -> None:
    wanted = ScheduleConfig(
        speed_m_s=((0.0, -0.4), (3.0, -0.4), (3.1, 0.0)), turn_rad_s=0.0, duration_s=7.0
    )
    finished = run_robot(RunRequest(prepare_schedule(file, wanted), tmp_path))
    names = {k: s.name for k, s in enumerate(prepare_schedule(file, wanted).repertoire.segments)}
    assert isinstance(finished.source, ScheduleMotion)
    assert {names[one.action] for one in finished.source.played} == {"reverse", "rest"}
    along_m = finished.record.pose.head_m[:, 0]
    assert along_m[-1] < along_m[0] - 0.8
    assert along_m[-1] - along_m.min() < 0.1


def test_actions_on_a_ground_other_than_the_recorded_one_are_reported(
    file: Path, caplog: pytest.LogCaptureFixture
) -> None:
    prepare_schedule(file, ScheduleConfig(speed_m_s=0.6), world="isotropic")
    assert "recorded on world flat; on isotropic speeds, turns and even directions may" in (
        caplog.text
    )
