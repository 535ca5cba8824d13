"""A gait along waypoints: it turns towards its path, within the joints' limits, and arrives."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot
from snakewalk.controller.gaits.registry import make_gait
from snakewalk.controller.kinematics.links import body_in_world, pose_at
from snakewalk.controller.metrics.failure import failure
from snakewalk.controller.run.factory import prepare_job, prepare_run, prepare_walk
from snakewalk.controller.run.kinds.steered_run import SteeredRun
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.terrain.planner import TerrainPlanner
from snakewalk.controller.walk.course import Course
from snakewalk.controller.walk.steered_gait import CYCLES_PER_BODY, TURN_LIMIT, SteeredGait

ROBOT = load_robot("salamander")
STEP_S = 0.02
SWIMS = {"run.gait.name": "anguilliform"}
SWING = [len(ROBOT.joint_axes) + 2 * leg for leg in range(4)]
"""Left and right in turn."""


def steered(name: str = "trot", **values: object) -> SteeredGait:
    planner = TerrainPlanner(None, prepare_job("salamander-square").world.planner)
    course = Course(
        planner.in_steps,
        [(4.0, 0.0), (8.0, 0.0)],
        start_m=np.zeros(2),
        radius_m=0.3,
        length_m=ROBOT.length_m,
        travel_per_body=CYCLES_PER_BODY,
    )
    return SteeredGait(make_gait(name, values), ROBOT, course, 0.6)


def body_at(heading_rad: float):
    return body_in_world(ROBOT, pose_at(np.zeros(2), heading_rad), np.zeros(ROBOT.joint_count))


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize(("name", "values"), [("trot", {}), ("trot", {"mirror": True})])
def test_it_turns_towards_its_path_and_a_body_on_it_goes_straight(name, values) -> None:
    for heading_rad, sign in ((0.0, 0.0), (0.4, -1.0), (-0.4, 1.0)):
        motion = steered(name, **values)
        goals = [motion.step(STEP_S, body_at(heading_rad)) for _ in range(400)]  # two cycles
        assert np.sign(round(motion.turn, 6)) == sign
        swing = np.ptp(np.array(goals[-200:])[:, SWING], axis=0)
        left, right = swing[::2].mean(), swing[1::2].mean()
        assert np.sign(round(right - left, 6)) == sign  # the inner legs step shorter
        assert 1.0 <= max(left, right) < 1.1  # two strides of 0.5 rad, and to slow down in the air


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("name", ["trot", "lateral-walk", "subcarangiform"])
def test_joints_keep_within_their_limits_however_it_is_steered(name: str) -> None:
    motion, rng = steered(name), np.random.default_rng(3)
    goals = [motion.begin(body_at(0.0))]
    for k in range(800):
        if k % 40 == 0:
            heading_rad = float(rng.choice([-1.0, 0.0, 1.0]))
        goals.append(motion.step(STEP_S, body_at(heading_rad)))
        assert abs(motion.turn) <= TURN_LIMIT + 1e-9
    speed = np.diff(goals, axis=0) / STEP_S
    assert np.abs(speed).max() <= ROBOT.joint_speed_limit_rad_s
    assert np.abs(np.diff(speed, axis=0)).max() / STEP_S <= ROBOT.joint_acceleration_limit_rad_s2
    assert np.abs(goals).max(axis=0).max() <= max(ROBOT.limit_rad)


def test_its_speed_is_that_of_its_goals() -> None:
    motion = steered()
    for _ in range(120):
        before = motion.step(STEP_S, body_at(0.4))
    after = motion.step(1e-3, body_at(0.4))
    np.testing.assert_allclose(motion.velocity_rad_s(), (after - before) / 1e-3, atol=0.02)


@pytest.mark.slow
def test_a_salamander_trots_past_a_waypoint_to_another_and_rests(tmp_path: Path) -> None:
    job = prepare_job("salamander-square", keys={"run.waypoint_radius_m": 0.25})
    near = job.run.model_copy(update={"waypoints_m": ((0.4, 0.1), (0.7, 0.35))})
    job = replace(job, run=near)
    finished = run_robot(RunRequest(job, tmp_path))
    assert finished.outcome.complete
    assert finished.outcome.missed == 0
    record = finished.record
    assert failure(record) is None
    assert finished.summary.path_error_max_m < 0.25
    assert isinstance(prepare_run(record.header.run, record.header.robot, job.world), SteeredRun)
    # cost over the way, not over the distance from begin to end
    assert 2.0 < finished.summary.electrical_cost_of_transport < 10.0


@pytest.mark.slow
def test_a_run_out_of_time_is_told_by_its_way_not_by_a_pulse(tmp_path: Path) -> None:
    job = prepare_job("salamander-square", keys={"run.time_limit_s": 8.0})
    ended = failure(run_robot(RunRequest(job, tmp_path)).record)
    assert ended is not None
    assert ended.cause == "time"


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"run.world": "ramp-10", "run.robot": "yaw16"} | SWIMS, "on flat floors only"),
        ({"run.gait.name": "sidewinding"}, "those that are: .*trot, lateral-walk"),
        ({"run.gait.parameters.turn": 0.3}, "turn is what steers it along waypoints; leave it out"),
        ({"run.gait.parameters.turn_rad": 0.3} | SWIMS, "turn_rad is what steers it"),
        ({"run.gait.ashore.name": "sidewinding"}, "sidewinding: not steered"),
        ({"run.gait.look_heading_rad": 0.3}, "cannot have then, look_heading_rad"),
    ],
)
def test_what_cannot_be_steered_is_refused_before_anything_moves(keys, said) -> None:
    with pytest.raises(InputError, match=said):
        prepare_job("salamander-square", keys=keys)


def test_commands_of_walks_say_what_runs_it() -> None:
    with pytest.raises(InputError, match="snakewalk run salamander-slalom"):
        prepare_walk("salamander-slalom")
