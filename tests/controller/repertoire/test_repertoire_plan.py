"""Search, and what becomes of a plan on the simulated bus."""

import itertools
import json
from pathlib import Path

import numpy as np
import pytest

from benchmarks.search_cost import physics_route, search_cost
from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot
from snakewalk.controller.kinematics.frame import Frame
from snakewalk.controller.kinematics.links import body_in_world
from snakewalk.controller.repertoire.motion import RepertoireMotion
from snakewalk.controller.repertoire.repertoire import Repertoire
from snakewalk.controller.repertoire.repertoire_physics import FRAME_S
from snakewalk.controller.repertoire.repertoire_planning import (
    load_plan,
    plan_route,
    save_plan,
)
from snakewalk.controller.repertoire.repertoire_run import RouteMotion
from snakewalk.controller.repertoire.replay import replay
from snakewalk.controller.repertoire.search import MotionPrimitives, plane_pose, search
from snakewalk.controller.run.factory import prepare_run
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.drivers.types import BodyPose


@pytest.fixture(scope="module")
def file(repertoire: Repertoire, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("repertoire") / "r.npz"
    repertoire.save(path)
    return path


def test_the_search_predicts_what_replay_does(repertoire: Repertoire) -> None:
    primitives = MotionPrimitives(repertoire)
    route = search(primitives, [0.0, 0.0, 0.3], [(2.0, 1.0), (3.0, -0.5)], 0.25)
    assert route.reached == 2
    at = Frame.flat(0.0, 0.0, 0.3)
    for action, pose in zip(route.actions, route.pose[1:], strict=True):
        at = replay(repertoire.segments[action], at).end
        found = plane_pose(at)
        np.testing.assert_allclose(found[:2], pose[:2], atol=1e-4)
        assert np.cos(found[2] - pose[2]) == pytest.approx(1.0, abs=1e-6)
    assert route.duration_s == pytest.approx(sum(primitives.duration_s[list(route.actions)]))


def test_a_wide_beam_finds_the_quickest_of_all_sequences(repertoire: Repertoire) -> None:
    primitives = MotionPrimitives(repertoire)
    goal, radius = np.array([1.6, 0.9]), 0.25
    route = search(primitives, [0.0, 0.0, 0.0], [tuple(goal)], radius, beam=10_000)
    best = np.inf
    for length in (1, 2, 3):
        for actions in itertools.product(primitives.tried, repeat=length):
            pose, hit = np.zeros(3), False
            for action in actions:
                c, s = np.cos(pose[2]), np.sin(pose[2])
                way = primitives.travel[action, :, :2] @ np.array([[c, s], [-s, c]]) + pose[:2]
                hit = bool((np.hypot(*(way - goal).T) <= radius).any())
                pose = primitives.after(pose, action)
            if hit:
                best = min(best, float(primitives.duration_s[list(actions)].sum()))
    assert route.reached == 1
    assert len(route.actions) <= 3
    assert route.duration_s == pytest.approx(best)


def test_out_of_reach_the_best_so_far_is_returned(repertoire: Repertoire) -> None:
    route = search(MotionPrimitives(repertoire), np.zeros(3), [(90.0, 0.0)], 0.2, depth=3)
    assert route.reached == 0
    assert len(route.actions) == 3
    assert (
        search(MotionPrimitives(repertoire), np.zeros(3), [(1.0, 0.0)], 0.2, reached=1).actions
        == ()
    )


def test_joints_go_from_action_to_action_within_the_limits(repertoire: Repertoire) -> None:
    robot = load_robot("yaw16")
    order = itertools.cycle([2, 4, 1, 3, 0])
    motion = RepertoireMotion(repertoire, robot, 1, lambda view: next(order))
    still = body_in_world(robot, BodyPose(0.0, np.zeros(3), np.eye(3)), np.zeros(16))
    dt = 0.005
    goals = [motion.goal_rad()]
    for k in range(3000):
        if k == 2600:
            motion.stop()
        goals.append(motion.step(dt, still))
    speed = np.diff(goals, axis=0) / dt
    assert np.abs(speed).max() <= 1.03 * robot.joint_speed_limit_rad_s
    assert np.abs(np.diff(speed, axis=0) / dt).max() <= 1.05 * robot.joint_acceleration_limit_rad_s2
    assert motion.done
    assert not speed[-10:].any()


@pytest.mark.slow
def test_a_plan_reaches_its_waypoints_on_the_bus_though_each_action_misses_a_little(
    file: Path, tmp_path: Path
) -> None:
    job = plan_route("flat-slalom", file)
    assert job.route.reached == 5
    assert job.route.candidates > 4000
    save_plan(job, tmp_path / "plan.json")
    loaded = load_plan(tmp_path / "plan.json")
    assert loaded.route.actions == job.route.actions
    finished = run_robot(RunRequest(loaded, tmp_path))
    outcome = finished.outcome
    assert outcome.complete
    assert isinstance(finished.source, RouteMotion)
    errors = finished.source.follower.errors()
    assert 0.0 < np.median(errors[:, 0]) < 0.15
    assert outcome.duration_s < 1.6 * job.route.duration_s
    _, blind = physics_route(job, job.route.actions)
    assert blind.route_errors()[-1, 0] > 2.0 * np.median(errors[:, 0])
    with pytest.raises(InputError, match="gait repertoire run"):
        prepare_run(job.run, job.robot, job.world)


def test_the_physics_is_timed_on_the_candidates_asked_for(file: Path) -> None:
    cost = search_cost(plan_route("flat-slalom", file), 2)
    assert cost.ran == 2
    assert cost.physics_candidate_s > FRAME_S * 1e-3
    assert cost.ratio > 1.0


def test_what_cannot_be_planned_is_said(file: Path, tmp_path: Path) -> None:
    for robot, world, said in (
        ("alternating16", None, "joints"),
        (None, "isotropic", "recorded on world flat"),
        (None, "jacksboro-gentle", "flat one"),
    ):
        with pytest.raises(InputError, match=said):
            plan_route("flat-slalom", file, robot=robot, world=world)
    with pytest.raises(InputError, match="no such plan"):
        load_plan(tmp_path / "none.json")
    for text in ("{", "[]", "{}", json.dumps({"format": "other"})):
        (tmp_path / "plan.json").write_text(text)
        with pytest.raises(InputError, match=r"plan\.json"):
            load_plan(tmp_path / "plan.json")
