"""Bodies that wander on hills: culling, levels of detail, the ground under them, the film."""

from pathlib import Path

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.config.ground import build_ground
from snakewalk.config.heightfield import HeightField
from snakewalk.config.loader import load_robot, load_world
from snakewalk.controller.repertoire.behaviour import Wandering
from snakewalk.controller.repertoire.commands.crowd import crowd
from snakewalk.controller.repertoire.crowd_film import (
    FAR,
    HIDDEN,
    MIDDLE,
    NEAR,
    SIZE_PX,
    CrowdScene,
    CrowdView,
    DetailedCrowd,
    detail_levels,
    film_crowd,
)
from snakewalk.controller.repertoire.habit import Habit
from snakewalk.controller.repertoire.repertoire import Repertoire
from snakewalk.controller.repertoire.species import Species
from snakewalk.sim.rendering.view_frustum import ViewFrustum


@pytest.fixture(scope="module")
def hills() -> HeightField:
    ground = build_ground(load_world("jacksboro-basin"))
    assert ground is not None
    return ground


def species(repertoire: Repertoire, bodies: int, habit: Habit = Habit.WANDER) -> Species:
    """Bodies of 0.3 times the recorded length."""
    return Species(repertoire, np.full(bodies, 0.3), np.full(17, 0.025), habit)


def test_no_body_of_which_a_part_is_in_view_is_culled_and_most_others_are() -> None:
    random = np.random.default_rng(0)
    parts = np.linspace(-0.5, 0.5, 41)
    wrong = hidden = 0
    for _ in range(40):
        frustum = ViewFrustum.orbit(
            random.uniform(-1.0, 1.0, 3),
            random.uniform(0.5, 4.0),
            random.uniform(0.0, 360.0),
            random.uniform(-80.0, -5.0),
            fovy_deg=45.0,
            size_px=(960, 540),
        )
        centre = random.uniform(-5.0, 5.0, (200, 3))
        along = random.normal(size=(200, 3))
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        points = centre[:, None] + 0.4 * parts[:, None] * along[:, None]
        seen = np.zeros(points.shape[:2], dtype=bool)
        depth, across, up = np.moveaxis((points - frustum.eye_m) @ frustum.axes.T, 2, 0)
        seen = (depth > 0.0) & (np.abs(across) <= frustum.half_tan[0] * depth)
        seen = (seen & (np.abs(up) <= frustum.half_tan[1] * depth)).any(axis=1)
        levels = detail_levels(frustum, centre, np.full(200, 0.4))
        assert (levels[seen] > HIDDEN).all()
        wrong += int((levels[~seen] > HIDDEN).sum())
        hidden += int((~seen).sum())
    assert wrong < 0.1 * hidden


def test_levels_fall_with_the_distance() -> None:
    frustum = ViewFrustum.orbit(np.zeros(3), 1.0, 0.0, 0.0, fovy_deg=45.0, size_px=(960, 540))
    ahead = np.array([[d - 1.0, 0.0, 0.0] for d in (1.0, 5.0, 15.0, -3.0)])
    assert detail_levels(frustum, ahead, np.full(4, 0.5)).tolist() == [NEAR, MIDDLE, FAR, HIDDEN]


@pytest.mark.slow
def test_bodies_lie_on_the_ground_and_near_ones_keep_their_length(
    repertoire: Repertoire, hills: HeightField
) -> None:
    wandering = Wandering([species(repertoire, 12)], hills, seed=2, separate=False)
    wandering.step(60)
    laid = DetailedCrowd(hills, wandering.radius_m, wandering.swims)
    levels = np.arange(12) % 4
    chains = laid.chains(wandering.crowd, levels)
    assert [chain.level + FAR for chain in chains] == [k for k in levels if k != HIDDEN]
    for chain in chains:
        over = chain.points_m[:, 2] - hills.elevation_m(*chain.points_m[:, :2].T)
        np.testing.assert_allclose(over, chain.radius_m, atol=1e-9)
        assert len(chain.points_m) == {FAR: 4, MIDDLE: 9, NEAR: 17}[chain.level + FAR]
        if chain.level + FAR == NEAR:
            links = wandering.crowd.link_m(chain.kind)
            flat = np.linalg.norm(np.diff(links[:, :2], axis=0), axis=1)
            steps = np.linalg.norm(np.diff(chain.points_m, axis=0), axis=1)
            np.testing.assert_allclose(steps, flat.mean(), rtol=1e-6)


@pytest.mark.slow
def test_they_wander_within_the_field_apart_from_each_other_and_alike_for_a_seed(
    repertoire: Repertoire, hills: HeightField
) -> None:
    one, two = (
        Wandering([species(repertoire, 40)], hills, seed=5, separate=False) for _ in range(2)
    )
    start = one.crowd.origin_m.copy()
    for _ in range(10):
        one.step(60)
        at = one.crowd.origin_m
        assert hills.contains(at[:, 0], at[:, 1]).all()
    two.step(600)
    np.testing.assert_array_equal(one.crowd.origin_m, two.crowd.origin_m)
    gone = np.hypot(*(one.crowd.origin_m - start)[:, :2].T)
    assert np.median(gone) > 0.6
    apart = np.linalg.norm(at[:, None, :2] - at[None, :, :2], axis=2) + np.eye(40)
    assert np.median(apart.min(axis=1)) > 0.5 * one.length_m[0]
    assert len(set(one.crowd.playing.tolist())) > 3


def test_a_ground_that_is_all_steep_is_refused(repertoire: Repertoire) -> None:
    steep = HeightField(np.outer(np.ones(4), [0.0, 2.0, 4.0, 6.0]), 1.0, 0.0, 0.0)
    with pytest.raises(InputError, match="nowhere under"):
        Wandering([species(repertoire, 3)], steep)


@pytest.mark.nightly("a film of many bodies: 11 s of CPU")
def test_a_film_is_drawn(repertoire: Repertoire, hills: HeightField, tmp_path: Path) -> None:
    robot, world = load_robot("yaw16"), load_world("jacksboro-basin")
    scene = CrowdScene(Wandering([species(repertoire, 8)], hills), hills)
    film = tmp_path / "a.mp4"
    view = CrowdView(robot, world, hills, 8, SIZE_PX)
    assert film_crowd(scene, view, film, seconds=0.1, frame_s=repertoire.frame_s) == 2
    assert film.stat().st_size > 5000
    assert scene.costs.levels.sum() == 16


def test_bad_input_of_the_command_is_said(tmp_path: Path, repertoire: Repertoire) -> None:
    file = tmp_path / "r.npz"
    repertoire.save(file)
    for given, said in (
        ({"files": [tmp_path / "none.npz"]}, "no such file"),
        ({"bodies": [1, 2]}, "--bodies: 2 values for 1 files"),
        ({"out": tmp_path / "a.png"}, "ends in .mp4"),
        ({"world": "flat"}, "has no hills"),
    ):
        with pytest.raises(InputError, match=said):
            crowd(
                **{"files": [file], "world": "jacksboro-basin", "out": tmp_path / "a.mp4"} | given
            )
    assert [path.name for path in tmp_path.iterdir()] == ["r.npz"]
