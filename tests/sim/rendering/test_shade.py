"""The soft shadow: one dark area, as dark where parts overlap, on the ground under the sun."""

import mujoco
import numpy as np
import pytest

from snakewalk.config.heightfield import HeightField
from snakewalk.config.loader import load_robot, load_world
from snakewalk.sim.rendering.looks import Scene, dressed_model
from snakewalk.sim.rendering.offscreen import Offscreen
from snakewalk.sim.rendering.shade import SHADE, SUN_DIRECTION, SoftShade, add_sheet, shade_picture


def disc(x: float, y: float, radius: float) -> np.ndarray:
    """Points of a filled disc in the unit square."""
    side = np.linspace(-1.0, 1.0, 121) * radius
    points = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
    return points[np.hypot(*points.T) <= radius] + [x, y]


def test_parts_that_overlap_are_as_dark_as_one() -> None:
    one = shade_picture(disc(0.4, 0.5, 0.1))[..., 3].astype(int)
    row = np.concatenate([disc(x, 0.5, 0.1) for x in np.linspace(0.3, 0.7, 9)])
    many = shade_picture(row)[..., 3].astype(int)
    assert many.max() <= one.max() + 1
    inside = many[64, 45:85]
    assert np.ptp(inside) <= 1  # no discs can be told apart


def test_the_edge_is_soft_and_the_border_is_clear() -> None:
    alpha = shade_picture(disc(0.5, 0.5, 0.2))[64, :, 3].astype(int)
    edge = alpha[20:64]
    assert (np.diff(edge) >= 0).all()
    assert np.diff(edge).max() < 0.4 * edge.max()
    assert alpha[:30].max() == alpha[-30:].max() == 0


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("hills", [False, True])
def test_a_ball_in_the_air_darkens_the_ground_where_the_sun_puts_it(hills: bool) -> None:
    ground = None
    if hills:
        ground = HeightField(0.2 * np.random.default_rng(0).random((41, 41)), 0.2, -4.0, -4.0)
    model = dressed_model(
        Scene(load_robot("alternating16"), load_world("flat"), ground), additions=(add_sheet,)
    )
    data, option, camera = mujoco.MjData(model), mujoco.MjvOption(), mujoco.MjvCamera()
    mujoco.mj_forward(model, data)
    camera.lookat[:], camera.distance, camera.elevation = (2.0, 2.0, 0.0), 2.0, -90.0
    scene = mujoco.MjvScene(model, maxgeom=500)
    every = mujoco.mjtCatBit.mjCAT_ALL
    shade = SoftShade(model, ground)
    level = 0.0 if ground is None else float(ground.elevation_m(2.0, 2.0))
    rng = np.random.default_rng(1)
    ball = rng.normal(size=(4000, 3))
    ball *= 0.1 / np.linalg.norm(ball, axis=1, keepdims=True)
    pictures = []
    with Offscreen(model, 200, 200) as screen:
        for away_m in (50.0, 0.0):  # the first shadow is far outside the picture
            mujoco.mjv_updateScene(model, data, option, None, camera, every, scene)
            count = scene.ngeom
            slide = 0.3 * SUN_DIRECTION / -SUN_DIRECTION[2]
            shade.lay(scene, ball + np.array([2.0 + away_m, 2.0, level]) - slide)
            assert scene.ngeom == count  # no patches
            screen.reload(model, shade.texture)
            pictures.append(screen.draw(scene).astype(int).sum(axis=2))
    left = (pictures[1] / pictures[0]).min()
    assert left == pytest.approx(0.5, abs=0.06)  # half of the light, not a black patch
    darker = pictures[0] - pictures[1]
    rows, columns = np.nonzero(darker > 40)
    assert 100 < len(rows) < 2500
    assert abs(rows.mean() - 100) < 8
    assert abs(columns.mean() - 100) < 8
    assert model.skin(SHADE) is not None
