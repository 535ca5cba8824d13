"""Paths and trail of a film: what is in force is bright, what it replaced pale, on the ground."""

import mujoco
import numpy as np
import pytest

from snakewalk.config.arrays import Floats
from snakewalk.config.heightfield import HeightField
from snakewalk.sim.rendering.trail import FORMER, LIFT_M, MOST, PATH, TRAIL, Trail, make_trail

FIRST = np.array([[0.0, 0.0], [1.2, 0.0]])
SECOND = np.array([[0.6, 0.0, 0.0], [0.6, 1.2, 0.0]])
TIMES = np.linspace(0.0, 10.0, 501)
HEAD = np.column_stack([0.2 * TIMES, np.zeros_like(TIMES)])
SLOPE = HeightField(np.tile(np.arange(0.0, 2.01, 0.1), (21, 1)), 0.2, -2.0, -2.0)


def drawn(trail: Trail, now_s: float) -> list[mujoco.MjvGeom]:
    model = mujoco.MjModel.from_xml_string("<mujoco/>")
    scene = mujoco.MjvScene(model, maxgeom=trail.most)
    trail.add(scene, now_s)
    return list(scene.geoms[: scene.ngeom])


def of(geoms: list[mujoco.MjvGeom], rgba: tuple[float, ...]) -> Floats:
    same = [geom.pos.copy() for geom in geoms if np.allclose(geom.rgba, rgba)]
    return np.array(same).reshape(-1, 3)


def test_the_path_in_force_is_bright_and_the_one_before_it_pale() -> None:
    trail = make_trail([(0.0, FIRST), (4.0, SECOND)], TIMES, HEAD, None)
    before, after = drawn(trail, 3.9), drawn(trail, 4.0)
    assert np.ptp(of(before, PATH), axis=0) == pytest.approx([1.08, 0.0, 0.0], abs=1e-6)
    assert len(of(before, FORMER)) == 0
    assert np.ptp(of(after, PATH), axis=0) == pytest.approx([0.0, 1.08, 0.0], abs=1e-6)
    assert of(after, FORMER) == pytest.approx(of(before, PATH))


def test_the_trail_ends_where_the_head_is_and_its_end_is_kept() -> None:
    trail = make_trail([], TIMES, HEAD, None)
    assert len(drawn(trail, 0.0)) == 0
    assert len(of(drawn(trail, 5.0), TRAIL)) == pytest.approx(1.0 / 0.03, abs=1)
    long = make_trail([], 100.0 * TIMES, 100.0 * HEAD, None)
    assert len(drawn(long, 1000.0)) == MOST <= long.most


def test_lines_lie_on_the_ground() -> None:
    trail = make_trail([(0.0, FIRST)], TIMES, HEAD[:, :2], SLOPE)
    for points_m in (*trail.dots_m, trail.head_m):
        elevation_m = SLOPE.elevation_m(points_m[:, 0], points_m[:, 1])
        assert points_m[:, 2] == pytest.approx(elevation_m + LIFT_M)
        assert np.ptp(points_m[:, 2]) > 0.4


def test_a_run_without_a_path_has_none() -> None:
    assert make_trail([(0.0, np.zeros((0, 2)))], TIMES, HEAD, None).dots_m[0].shape == (0, 3)
