"""A policy as a motion: within the limits, the same in training and in a run, over bus and port."""

from pathlib import Path

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot
from snakewalk.controller.kinematics.links import body_in_world, chain_angles_rad, pose_at
from snakewalk.controller.motion.policy import PolicyWave, load_policy, save_policy
from snakewalk.controller.motion.policy_motion import PolicyMotion
from snakewalk.controller.run.factory import prepare_policy
from snakewalk.controller.run.request import RunRequest, RunResult
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.drivers.types import BodyPose
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant
from tests.helpers.drawn_policy import drawn_policy
from tests.helpers.line_port import OpenedLine, line_port

ROBOT = load_robot("yaw16")
REST = body_in_world(ROBOT, pose_at(np.zeros(2), 0.0), np.zeros(16))
DT_S = 0.02


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("policy") / "drawn.toml"
    save_policy(drawn_policy(), path)
    return str(path)


@pytest.fixture(scope="module")
def finished(file: str, tmp_path_factory: pytest.TempPathFactory) -> RunResult:
    return run_robot(RunRequest(prepare_policy(file, seconds=3.0), tmp_path_factory.mktemp("run")))


def test_joints_stay_within_the_limits_whatever_is_observed() -> None:
    motion, rng = PolicyMotion(drawn_policy(), ROBOT), np.random.default_rng(1)
    goals = [motion.goal_rad()]
    for _ in range(400):
        joints = rng.uniform(-1.5, 1.5, 16)
        pose = pose_at(np.zeros(2), float(rng.uniform(-9.0, 9.0)))
        goals.append(motion.step(DT_S, body_in_world(ROBOT, pose, joints)))
    speed = np.diff(goals, axis=0) / DT_S
    assert np.abs(goals).max() < min(ROBOT.limit_rad)
    assert 0.5 < np.abs(speed).max() <= motion.pace().speed_rad_s.max() * (1.0 + 1e-9)
    most = motion.pace().acceleration_rad_s2.max()
    assert np.abs(np.diff(speed, axis=0)).max() / DT_S <= most * (1.0 + 1e-9)


def test_a_run_sends_what_the_policy_says_to_what_was_measured(
    finished: RunResult, file: str
) -> None:
    record = finished.record
    goals, measured, pose = record.cycle.asked_rad, record.cycle.measured_rad, record.pose
    begun = int(np.flatnonzero(np.abs(goals).max(axis=1))[0])
    motion = PolicyMotion(load_policy(file), ROBOT, duration_s=3.0)
    for k in range(begun, len(goals)):
        head = BodyPose(0.0, pose.head_m[k], pose.rotation[k])
        goal_rad = motion.step(DT_S, body_in_world(ROBOT, head, measured[k]))
        np.testing.assert_allclose(goal_rad, goals[k], atol=1e-6)  # a log's pose is rounded
    assert motion.done
    assert finished.outcome.tripped is None
    assert record.events[-1].text == "torque off; the motion came to its end"
    np.testing.assert_allclose(motion.velocity_rad_s(), 0.0)


def test_a_policy_runs_on_a_port(file: str, tmp_path: Path) -> None:
    with line_port(OpenedLine(ServoBank(range(1, 17)), BenchPlant(16))) as port:
        served = run_robot(RunRequest(prepare_policy(file, seconds=1.0), tmp_path, port))
    assert served.record.header.backend == port
    assert served.outcome.tripped is None
    assert np.abs(served.record.cycle.measured_rad).max() > 0.1


def test_a_shorter_time_is_the_same_motion_at_a_slower_rate() -> None:
    wave = drawn_policy().model_copy(update={"network": (), "observation": ()})
    whole, halves = PolicyMotion(wave, ROBOT), PolicyMotion(wave, ROBOT)
    for _ in range(100):
        whole.step(DT_S, REST)
        halves.step(0.5 * DT_S, REST)
        halves.step(0.5 * DT_S, REST)
    np.testing.assert_allclose(halves.goal_rad(), whole.goal_rad(), atol=0.02)
    np.testing.assert_array_equal(whole.step(0.0, REST), whole.goal_rad())


def test_steering_bends_against_the_heading() -> None:
    still = PolicyWave(amplitude_rad=(0.0,) * 4, steering=(1.0, 1.0, 1.0))
    motion = PolicyMotion(
        drawn_policy().model_copy(update={"network": (), "observation": (), "wave": still}), ROBOT
    )
    left = body_in_world(ROBOT, pose_at(np.zeros(2), 0.4), np.zeros(16))
    for _ in range(100):
        goal_rad = motion.step(DT_S, left)
    assert goal_rad.sum() == pytest.approx(-0.4, abs=1e-3)  # to the right


def test_joints_are_read_from_the_body_with_yaw_and_pitch() -> None:
    robot, rng = load_robot("alternating16"), np.random.default_rng(2)
    joints = rng.uniform(-1.2, 1.2, robot.joint_count)
    view = body_in_world(robot, pose_at(np.ones(2), 2.0), joints)
    np.testing.assert_allclose(chain_angles_rad(robot, view), joints, atol=1e-12)


def test_what_it_needs_is_told(tmp_path: Path) -> None:
    pitch = tmp_path / "pitch.toml"
    pitch.write_text('name = "pitch"\njoint_axes = "pppp"\n')
    with pytest.raises(InputError, match="policy drawn needs yaw joints"):
        PolicyMotion(drawn_policy(), load_robot(str(pitch)))
