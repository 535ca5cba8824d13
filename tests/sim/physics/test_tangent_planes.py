"""Where balls touch a height field: closed forms on planes, creases and edges, and brute force."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from snakewalk.config.heightfield import HeightField
from snakewalk.sim.physics.tangent_planes import PLANES, lay_planes, touch
from tests.helpers.physics import Floats

RADIUS_M = 0.03
RNG = np.random.default_rng(11)


def field(height: Floats, spacing: float) -> HeightField:
    rows, columns = height.shape
    return HeightField(height, spacing, -(columns - 1) * spacing / 2, -(rows - 1) * spacing / 2)


def contacts(ground: HeightField, centre_m: Floats) -> list[tuple[Floats, float]]:
    """Unit normals and distances of a ball's contacts, deepest first."""
    found = np.empty((PLANES, 4))
    corner = ground.x0_m, ground.y0_m, ground.spacing_m
    touch(*centre_m, RADIUS_M, ground.z_m, corner, found)
    again = np.empty((PLANES, 4))
    touch.py_func(*centre_m, RADIUS_M, ground.z_m, corner, again)
    np.testing.assert_allclose(found[:, 3], again[:, 3], atol=1e-12)
    met = found[found[:, 3] < RADIUS_M]
    met = met[np.argsort(met[:, 3])]
    return [((centre_m - row[:3]) / row[3], float(row[3])) for row in met]


@pytest.mark.fast_cases(6)
@pytest.mark.parametrize("spacing", [0.01, 0.03, 0.1])
@pytest.mark.parametrize("slope", [(0.0, 0.0), (0.15, 0.0), (-0.3, 0.2), (1.5, -1.0)])
def test_on_a_plane_there_is_one_contact_and_its_normal_is_the_planes(
    slope: tuple[float, float], spacing: float
) -> None:
    """Also at 0.7 mm of depth, where MuJoCo's height field has normals 10 degrees off."""
    y, x = (np.mgrid[-10:11, -10:11]) * spacing
    ground = field(slope[0] * x + slope[1] * y, spacing)
    normal = np.array([-slope[0], -slope[1], 1.0]) / np.sqrt(1.0 + slope[0] ** 2 + slope[1] ** 2)
    for _ in range(60):
        foot = np.array([*RNG.uniform(-3 * spacing, 3 * spacing, 2), 0.0])
        foot[2] = slope[0] * foot[0] + slope[1] * foot[1]
        depth = RNG.uniform(1e-6, 7e-4)
        met = contacts(ground, foot + (RADIUS_M - depth) * normal)
        assert len(met) == 1
        np.testing.assert_allclose(met[0][0], normal, atol=1e-9)
        assert met[0][1] == pytest.approx(RADIUS_M - depth, abs=1e-12)


def test_at_the_border_there_is_no_contact_with_what_is_at_the_other_border() -> None:
    x = np.tile(np.arange(-5, 6) * 0.02, (11, 1))
    ground = field(1.5 * x, 0.02)
    normal = np.array([-1.5, 0.0, 1.0]) / np.sqrt(3.25)
    foot = np.array([x[0, 0] + 0.02, 0.003, 1.5 * (x[0, 0] + 0.02)])
    ((found, _),) = contacts(ground, foot + 0.99 * RADIUS_M * normal)
    np.testing.assert_allclose(found, normal, atol=1e-9)


def test_a_plane_is_turned_from_the_vertical_to_the_normal() -> None:
    y, x = np.mgrid[-5:6, -5:6] * 0.02
    ground = field(0.4 * x - 0.3 * y, 0.02)
    normal = np.array([-0.4, 0.3, 1.0]) / np.sqrt(1.25)
    places = np.vstack([0.99 * RADIUS_M * normal, np.zeros((PLANES, 3))])
    turns = np.zeros((1 + PLANES, 4))
    planes = np.arange(1, 1 + PLANES, dtype=np.int32)[None]
    corner = ground.x0_m, ground.y0_m, ground.spacing_m
    balls, radii = np.zeros(1, dtype=np.int32), np.full(1, RADIUS_M)
    lay_planes(places, balls, radii, ground.z_m, corner, planes, places, turns)
    (k,) = np.flatnonzero(turns[:, 0])
    np.testing.assert_allclose(places[k], 0.0, atol=1e-9)
    up = Rotation.from_quat(turns[k, [1, 2, 3, 0]]).apply([0.0, 0.0, 1.0])
    np.testing.assert_allclose(up, normal, atol=1e-9)
    assert turns[k, 3] == 0.0  # about no vertical


def test_the_deepest_contact_is_the_nearest_point_of_the_surface() -> None:
    ground = field(0.02 * RNG.normal(size=(21, 21)), 0.03)
    near = np.linspace(-RADIUS_M, RADIUS_M, 301)
    dx, dy = np.meshgrid(near, near)
    tried = 0
    for _ in range(60):
        x, y = RNG.uniform(-0.2, 0.2, 2)
        surface = ground.elevation_m(x + dx, y + dy)
        centre = np.array([x, y, surface[150, 150] + RNG.uniform(0.5, 1.0) * RADIUS_M])
        distance = np.sqrt(dx**2 + dy**2 + (surface - centre[2]) ** 2).min()
        met = contacts(ground, centre)
        if distance < 0.98 * RADIUS_M:
            tried += 1
            assert met[0][1] == pytest.approx(distance, abs=2e-4)
        for normal, away in met:  # and the surface is there
            x, y, z = centre - away * normal
            assert ground.elevation_m(x, y) == pytest.approx(z, abs=1e-9)
    assert tried > 20


def test_in_a_crease_a_ball_touches_both_faces_and_on_a_ridge_the_edge() -> None:
    x = 0.02 * np.arange(-10, 11)
    valley = field(np.tile(np.abs(x), (21, 1)), 0.02)
    met = contacts(valley, np.array([0.0, 0.003, RADIUS_M * np.sqrt(2.0) - 0.0005]))
    assert len(met) == 2
    sides = sorted(float(normal[0]) for normal, _ in met)
    np.testing.assert_allclose(sides, [-np.sqrt(0.5), np.sqrt(0.5)], atol=1e-9)
    ridge = field(np.tile(-np.abs(x), (21, 1)), 0.02)
    met = contacts(ridge, np.array([0.004, 0.003, 0.029]))
    assert len(met) == 1
    np.testing.assert_allclose(met[0][0], np.array([0.004, 0.0, 0.029]) / met[0][1], atol=1e-9)


def test_before_a_step_a_ball_stands_on_the_floor_and_against_the_flank() -> None:
    """4 cm high on a grid of 1 cm: a flank of 76 degrees between x = 0 and 0.01."""
    x = 0.01 * np.arange(-20, 21)
    step = field(np.tile(np.where(x > 0.0, 0.04, 0.0), (41, 1)), 0.01)
    flank = np.array([-0.04, 0.0, 0.01]) / np.hypot(0.04, 0.01)
    z = RADIUS_M - 1e-4
    x = (-(RADIUS_M - 1e-4) + z * flank[2]) / -flank[0]
    met = contacts(step, np.array([x, 0.0, z]))
    assert len(met) == 2
    normals = sorted((normal for normal, _ in met), key=lambda normal: normal[2])
    np.testing.assert_allclose(normals[0], flank, atol=1e-6)
    np.testing.assert_allclose(normals[1], [0.0, 0.0, 1.0], atol=1e-6)
    # over the edge, and on the top behind it, the flank is not seen from behind
    met = contacts(step, np.array([0.0101, 0.003, 0.04 + 0.02]))
    assert len(met) == 1
    assert met[0][0][2] > 0.99
    for x in (0.012, 0.02, 0.03):
        met = contacts(step, np.array([x, 0.003, 0.04 + RADIUS_M - 1e-4]))
        assert len(met) == 1
        np.testing.assert_allclose(met[0][0], [0.0, 0.0, 1.0], atol=1e-9)


def test_a_ball_off_the_ground_touches_nothing_and_one_below_it_is_found() -> None:
    ground = field(np.zeros((11, 11)), 0.05)
    assert contacts(ground, np.array([0.01, 0.02, RADIUS_M + 1e-6])) == []
    found = np.empty((PLANES, 4))
    touch(0.01, 0.02, -0.01, RADIUS_M, ground.z_m, (-0.25, -0.25, 0.05), found)
    np.testing.assert_allclose(found[0], [0.01, 0.02, 0.0, 0.0])
    assert found[1, 3] >= RADIUS_M
