"""A stereo head on the robot: the ground of its pictures, and a run over ground it did not know."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from snakewalk.config.camera import MappingConfig
from snakewalk.config.errors import InputError
from snakewalk.config.ground import build_ground
from snakewalk.config.heightfield import read_map
from snakewalk.config.loader import load_robot, load_run, load_world
from snakewalk.config.world import RandomGround, WorldConfig
from snakewalk.controller.kinematics.links import body_in_world
from snakewalk.controller.mapping.stereo_head import StereoHead
from snakewalk.controller.run.factory import prepare_walk, with_map
from snakewalk.controller.run.kinds.walk_run import WalkRun
from snakewalk.controller.run.request import RunRequest, RunResult
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.terrain.growing_map import GrowingMap
from snakewalk.sim.physics.plant import MujocoPlant
from tests.helpers.command import snakewalk

ROBOT = load_robot("alternating16-stereo")
HILLS = load_world("random-10").model_copy(
    update={
        "name": "hills",
        "ground": RandomGround(
            kind="random", rms_slope_rad=0.1745, correlation_m=0.3, size_m=4.4, seed=1
        ),
    }
)


def prepared(world: WorldConfig = HILLS, **run: object) -> WalkRun:
    found = prepare_walk("random-10", robot=ROBOT.name)
    changes = {"start_m": (-0.4, 0.0), "waypoints_m": ((1.6, 0.0),), "mapping": MappingConfig()}
    return replace(found, world=world, run=found.run.model_copy(update=changes | run))


@pytest.fixture(scope="module")
def look() -> tuple[GrowingMap, np.ndarray]:
    """The map of one pair of pictures from a body that lies still, and where its links are."""
    ground, joints = build_ground(HILLS), np.zeros(ROBOT.joint_count)
    assert ground is not None
    plant = MujocoPlant(ROBOT, HILLS, ground, 0.001)
    plant.reset((-0.4, 0.0), 0.3, joints)
    grown = GrowingMap.over(ground, 0.04)
    run = load_run("random-10").model_copy(update={"mapping": MappingConfig()})
    head = StereoHead(run, ROBOT, HILLS, ground, lambda: plant.qpos, grown)
    head.observe(0.0, plant.head_pose(), plant.qpos[7:])
    assert grown.pictures == 0  # it arrives later
    head.fuse(1.0)
    head.close()
    return grown, body_in_world(ROBOT, plant.head_pose(), joints).link_m


def test_one_look_shows_the_ground_ahead_of_the_head(look: tuple[GrowingMap, np.ndarray]) -> None:
    grown, links_m = look
    ground = build_ground(HILLS)
    assert ground is not None
    error_m = grown.errors_m(ground)
    assert np.median(np.abs(error_m)) < 0.012
    assert np.quantile(np.abs(error_m), 0.95) < 0.03
    assert len(error_m) * 0.04**2 > 0.5
    row, column = np.nonzero(grown.known)
    seen_m = np.stack([grown.x0_m + 0.04 * column, grown.y0_m + 0.04 * row], axis=1)
    ahead = (seen_m - links_m[0, :2]) @ [np.cos(0.3), np.sin(0.3)]
    assert ahead.min() > 0.05
    assert not grown.is_known(*links_m[8, :2])


@pytest.mark.slow
def test_the_body_is_not_taken_for_ground() -> None:
    """A head that is bent right round has its own body in the picture."""
    ground = build_ground(HILLS)
    assert ground is not None
    joints = np.zeros(ROBOT.joint_count)
    joints[list(ROBOT.yaw_joints)[:4]] = 0.75
    plant = MujocoPlant(ROBOT, HILLS, ground, 0.001)
    plant.reset((0.0, 0.0), 0.0, joints)
    grown = GrowingMap.over(ground, 0.04)
    run = load_run("random-10").model_copy(update={"mapping": MappingConfig()})
    head = StereoHead(run, ROBOT, HILLS, ground, lambda: plant.qpos, grown)
    head.observe(0.0, plant.head_pose(), plant.qpos[7:])
    head.fuse(1.0)
    head.close()
    assert np.quantile(np.abs(grown.errors_m(ground)), 0.99) < 0.05
    links_m = body_in_world(ROBOT, plant.head_pose(), plant.qpos[7:]).link_m
    assert not any(grown.is_known(x, y) for x, y, _ in links_m)


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> RunResult:
    """Some seconds of a walk over hills that it does not know."""
    folder = tmp_path_factory.mktemp("unknown")
    often = MappingConfig(replan_bodies=0.3)
    walks = prepared(motion="serpenoid", time_limit_s=2.5, mapping=often, seed=1)
    return run_robot(RunRequest(walks, folder, stoppable=False))


def test_a_run_maps_as_it_goes_and_plans_on_what_it_knows(finished: RunResult) -> None:
    facts = finished.map.facts()
    assert facts["pictures"] >= 5
    assert facts["seen_m2"] > 1.0
    assert facts["height_error_median_m"] < 0.006
    assert facts["head_over_unknown_m"] < 0.3  # the mast's blind spot before the head
    kinds = {event.kind: event.text for event in finished.record.events}
    assert "more of the ground is known" in kinds["replanned"]
    assert f"seen_m2 {facts['seen_m2']}" in kinds["map"]
    _, path_m = finished.record.paths[-1]
    ground_map = finished.map.ground_map
    assert ground_map is not None
    unknown = [point for point in path_m if not ground_map.is_known(*point[:2])]
    assert all(np.hypot(*(point[:2] - path_m[0, :2])) < 0.5 for point in unknown)


def test_the_map_of_a_run_is_left_in_its_folder(finished: RunResult) -> None:
    held = read_map(finished.log.parent / "map.npz")
    assert held.known is not None
    seen_m2 = held.known.sum() * held.spacing_m**2
    assert seen_m2 == pytest.approx(finished.map.facts()["seen_m2"], abs=0.01)


def test_before_the_run_nothing_of_the_true_ground_is_used() -> None:
    """Plan, first shape and heading are those of any other hills."""
    other = HILLS.model_copy(update={"ground": HILLS.ground.model_copy(update={"seed": 2})})
    one, two = prepared(), prepared(other)
    assert one.start_heading_rad == two.start_heading_rad
    np.testing.assert_array_equal(one.check_plan().path_m, two.check_plan().path_m)
    np.testing.assert_array_equal(one.initial_pose().joint_rad, two.initial_pose().joint_rad)


def test_a_plan_on_paper_says_that_it_knows_no_ground() -> None:
    words = ["plan", "random-10", "--robot", ROBOT.name, "--motion", "serpenoid", "--json"]
    done = snakewalk(*words, "--set", "run.mapping.period_s=1", "--set", "run.time_limit_s=2")
    found = json.loads(done.stdout)
    assert "is not known before the run" in "; ".join(found["warnings"])
    assert "slope_max_deg" not in found


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"robot": load_robot("alternating16")}, "has no stereo head.*alternating16-stereo"),
        ({"world": load_world("flat")}, "is level; there is nothing to map"),
        ({"pose": "joints"}, "pose joints knows no heights"),
        ({"motion": "walk-blind"}, "plans only once; use walk or serpenoid"),
    ],
)
def test_what_cannot_map_is_refused(
    changes: dict[str, object], message: str, tmp_path: Path
) -> None:
    found = prepared()
    parts = {key: value for key, value in changes.items() if key in ("robot", "world")}
    keys = {key: value for key, value in changes.items() if key not in parts}
    found = replace(found, run=found.run.model_copy(update=keys), **parts)
    with pytest.raises(InputError, match=message):
        run_robot(RunRequest(found, tmp_path, stoppable=False))
    assert not list(tmp_path.iterdir())


def test_the_option_says_what_the_walk_knows() -> None:
    run = load_run("random-10")
    assert with_map(run, None) is run
    mapped = with_map(run, "stereo")
    assert mapped.mapping == MappingConfig()
    assert with_map(mapped, "world").mapping is None
    with pytest.raises(InputError, match=r"--map lidar.*world, stereo"):
        with_map(run, "lidar")


def test_a_mast_weighs_on_its_link_and_keeps_the_body_from_rolling() -> None:
    plain = load_robot("alternating16")
    assert ROBOT.stereo_head is not None
    assert ROBOT.mass_kg - plain.mass_kg == pytest.approx(ROBOT.stereo_head.mass_kg)
    assert not prepared()._rolls
