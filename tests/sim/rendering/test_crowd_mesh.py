"""Tubes of a crowd: closed, around their centre lines, and drawn with a shadow."""

import mujoco
import numpy as np
import pytest

from snakewalk.config.arrays import Floats
from snakewalk.config.heightfield import HeightField
from snakewalk.config.loader import load_robot, load_world
from snakewalk.sim.rendering.crowd_film import BodyChain, CrowdShot, CrowdView
from snakewalk.sim.rendering.crowd_mesh import MESHES, TubeGrid
from snakewalk.sim.rendering.shade import SUN_DIRECTION

SIZE_PX = (320, 240)


def wave(points: int) -> Floats:
    """(points, 3) centre line of a body of about 0.3 m, 15 mm above the ground."""
    x = np.linspace(0.15, -0.15, points)
    return np.column_stack([x, 0.03 * np.sin(20.0 * x), np.full(points, 0.015)])


@pytest.mark.parametrize(("mesh", "points"), list(zip(MESHES, (4, 9, 17), strict=True)))
def test_a_tube_is_closed_faces_outward_and_has_the_volume_of_its_body(
    mesh: tuple[int, int], points: int
) -> None:
    grid = TubeGrid(*mesh)
    lines = np.stack([wave(points), wave(points) + np.array([1.0, 2.0, 3.0])])
    corner, normal = grid.tubes(lines, np.full((2, points), 0.015))
    assert corner.shape == normal.shape == (2, grid.corners, 3)
    np.testing.assert_allclose(corner[1] - corner[0], np.tile([1.0, 2.0, 3.0], (len(corner[0]), 1)))
    np.testing.assert_allclose(np.linalg.norm(normal, axis=2), 1.0)
    a, b, c = (corner[0][grid.faces[:, k]] for k in range(3))
    volume = float((np.cross(a, b) * c).sum()) / 6.0
    length = np.linalg.norm(np.diff(wave(200), axis=0), axis=1).sum()
    assert 0.5 < volume / (np.pi * 0.015**2 * length) < 1.1
    turned = np.stack([grid.faces, np.roll(grid.faces, -1, axis=1)], axis=-1)
    sides = {tuple(edge) for edge in turned.reshape(-1, 2).tolist()}
    ends = {grid.corners - k for k in range(1, grid.sides + 1)} | set(range(grid.sides))
    open_edges = {e for e in sides if e[::-1] not in sides}
    assert {corner for edge in open_edges for corner in edge} <= ends


@pytest.mark.slow
def test_levels_look_alike_and_the_sun_casts_a_shadow() -> None:
    robot, world = load_robot("yaw16"), load_world("jacksboro-basin")
    flat = HeightField(np.zeros((5, 5)), 1.0, -2.0, -2.0)
    view = CrowdView(robot, world, flat, 3, SIZE_PX)

    def shot(*bodies: BodyChain) -> np.ndarray:
        where = CrowdShot(np.zeros(3), 0.5, 90.0, -89.0, list(bodies), "")
        return np.array(view.draw(where), dtype=int)

    try:
        empty = shot()
        area = []
        for level, points in enumerate((4, 9, 17)):
            drawn = shot(BodyChain(wave(points), np.full(points, 0.015), 0, level)) - empty
            body = drawn[..., 0] - drawn[..., 2] > 25
            area.append(body)
            shadow = (drawn.max(axis=2) < -4) & ~body
            rows, columns = (np.argwhere(part).mean(axis=0) for part in (body, shadow))
            right, up = columns[1] - rows[1], rows[0] - columns[0]
            assert shadow.sum() > 0.15 * body.sum()
            assert np.dot([right, up], SUN_DIRECTION[:2]) > 0.0
        for level in (0, 1):
            both, either = area[level] & area[2], area[level] | area[2]
            assert both.sum() > (0.6, 0.8)[level] * either.sum()
        kinds = [BodyChain(wave(17), np.full(17, 0.015), kind, 2) for kind in range(3)]
        shot(*kinds)
        faces = view._scene.skinfacenum
        names = [
            mujoco.mj_id2name(view._model, mujoco.mjtObj.mjOBJ_SKIN, k) for k in range(len(faces))
        ]
        drawn_faces = dict(zip(names, faces.tolist(), strict=True))
        assert drawn_faces["crowd0-2"] == len(TubeGrid(*MESHES[2]).faces)
    finally:
        view.close()
