"""Ground from a pair of pictures: the camera's stand, and rendered hills of known heights."""

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.config.ground import build_ground
from snakewalk.config.loader import load_robot, load_world
from snakewalk.controller.mapping.stereo_camera import RectifiedPair
from snakewalk.controller.mapping.stereo_ground import (
    CameraStand,
    fit_ground,
    require_upright,
    stereo_ground,
)
from snakewalk.sim.rendering.stereo_view import StereoView


@pytest.mark.parametrize(("tilt", "roll"), [(0.3, 0.0), (0.6, 0.2), (0.1, -0.3)])
def test_a_stand_is_fitted_to_a_plane_with_a_wall_and_noise(tilt: float, roll: float) -> None:
    rng = np.random.default_rng(6)
    stand = CameraStand(0.7, tilt, roll)
    turn = stand.world_from_camera()
    np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-12)
    assert turn[2] @ [1.0, 0.0, 0.0] == pytest.approx(-np.sin(roll) * np.cos(tilt))  # right: down
    ground = np.column_stack([rng.uniform(0.5, 3, 3000), rng.uniform(-1, 1, 3000), np.zeros(3000)])
    wall = np.column_stack([np.full(1500, 2.5), rng.uniform(-1, 1, 1500), rng.uniform(0, 1, 1500)])
    camera = (np.concatenate([ground, wall]) - [0.0, 0.0, 0.7]) @ turn
    camera += rng.normal(0.0, 0.003, camera.shape)
    found = fit_ground(camera, np.full(len(camera), 0.003))
    assert found.height_m == pytest.approx(0.7, abs=0.003)
    assert found.tilt_rad == pytest.approx(tilt, abs=0.003)
    assert found.roll_rad == pytest.approx(roll, abs=0.003)


def slope(side_deg: float) -> CameraStand:
    """Return the stand fitted to a ground that rises to the left of an upright camera."""
    rng = np.random.default_rng(8)
    ahead, side = rng.uniform(0.5, 3.0, 3000), rng.uniform(-1.0, 1.0, 3000)
    ground = np.column_stack([ahead, side, np.tan(np.radians(side_deg)) * side])
    camera = (ground - [0.0, 0.0, 0.7]) @ CameraStand(0.7, 0.4, 0.0).world_from_camera()
    return fit_ground(camera + rng.normal(0.0, 0.003, camera.shape), np.full(3000, 0.003))


@pytest.mark.parametrize(("side_deg", "lower"), [(7.3, "right"), (-7.3, "left")])
def test_a_fitted_stand_that_rolls_is_rejected_as_a_slope_looks_alike(
    side_deg: float, lower: str
) -> None:
    with pytest.raises(InputError, match=f"{lower} side is lower.*--height, --tilt, --roll"):
        require_upright(slope(side_deg))


def test_a_fitted_stand_over_nearly_level_ground_is_accepted() -> None:
    require_upright(slope(1.0))
    require_upright(slope(-1.0))


def test_points_without_a_ground_have_no_stand() -> None:
    rng = np.random.default_rng(7)
    ball = rng.normal([0.0, 0.0, 5.0], 1.0, (2000, 3))
    with pytest.raises(InputError, match="no ground is seen"):
        fit_ground(ball, np.full(2000, 0.01))


@pytest.mark.slow
def test_heights_of_rendered_hills_and_what_is_hidden_stays_unknown() -> None:
    world, robot = load_world("jacksboro-basin"), load_robot("alternating16")
    ground = build_ground(world)
    view = StereoView(robot, world, ground, size_px=(320, 240), focal_px=260.0, seed=3)
    x, y, heading, tilt, height = 0.5, -0.5, 1.0, 0.55, 0.5
    low = float(ground.elevation_m(x, y))
    left, right = view.pictures((x, y, low + height), heading, tilt)
    view.close()
    seen = np.ones(left.shape[:2], bool)
    pair = RectifiedPair(left, right, seen, 260.0, (159.5, 119.5), 0.0, 0.1, np.eye(3))
    stand = CameraStand(height, tilt, 0.0)
    made = stereo_ground(pair, 64, 0.05, 0.04, stand, far_m=1.6)
    field = made.elevation
    row, column = np.nonzero(field.known)
    ahead, beside = field.x0_m + column * 0.05, field.y0_m + row * 0.05
    c, s = np.cos(heading), np.sin(heading)
    true_m = ground.elevation_m(x + c * ahead - s * beside, y + s * ahead + c * beside) - low
    error = field.z_m[field.known] - true_m
    assert np.sqrt((error**2).mean()) < 0.008
    assert abs(error.mean()) < 0.004
    assert len(error) * 0.05**2 > 0.7  # square metres
    assert ahead.max() <= 1.63
    assert not made.fitted
    edge = field.height_field().known
    assert not edge[:, :2].all()  # the view is a fan: its corners were not seen
    nothing = np.full_like(left, 128)
    blank = RectifiedPair(nothing, nothing, seen, 260.0, (159.5, 119.5), 0.0, 0.1, np.eye(3))
    with pytest.raises(InputError, match="nothing in the pictures is matched"):
        stereo_ground(blank, 64, 0.05, 0.04, stand)
