"""The prototype bent along a path and stood on the ground: isometries, planes, contacts."""

import numpy as np
import pytest

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.heightfield import HeightField
from snakewalk.controller.animals.legged.animal_synthesis import ANIMALS, read_animal
from snakewalk.controller.animals.legged.motion_transformation import (
    PathNormals,
    local_planes,
    transformed,
)
from snakewalk.controller.animals.legged.prototype import prototype
from snakewalk.controller.terrain.path import SplinePath

STRAIGHT = SplinePath(np.array([[0.0, 0.0], [3.0, 0.0], [6.0, 0.0]]))


def circle(radius_m: float) -> SplinePath:
    """Three quarters of a circle to the left, begun at the origin along x."""
    turn = np.arange(0.0, 1.5 * np.pi, 0.01 / radius_m)
    return SplinePath.tabulated(radius_m * np.stack([np.sin(turn), 1.0 - np.cos(turn)], axis=1))


def plane(dx: float, dy: float) -> HeightField:
    """A field of constant slope around the origin."""
    x = np.linspace(-20.0, 20.0, 41)
    return HeightField(dy * x[:, None] + dx * x[None], 1.0, -20.0, -20.0)


def times(name: str) -> Floats:
    """Three cycles."""
    return np.linspace(0.0, 3.0, 145) * read_animal(name).cycle_s


@pytest.mark.parametrize("name", ANIMALS)
def test_on_a_straight_line_and_level_ground_nothing_changes(name: str) -> None:
    animal = read_animal(name)
    made = prototype(animal, times(name))
    motion = transformed(made, animal, STRAIGHT, None)
    for part in ("spine_m", "hip_m", "foot_m"):
        np.testing.assert_allclose(getattr(motion, part), getattr(made, part), atol=1e-9)
    np.testing.assert_allclose(motion.end_m, made.foot_m, atol=1e-9)  # every leg reaches


def test_a_circle_turns_the_line_and_keeps_distances_from_it() -> None:
    rng = np.random.default_rng(0)
    points = np.stack(
        [rng.uniform(0.1, 6.0, 200), rng.uniform(-0.5, 0.5, 200), rng.uniform(0.0, 1.0, 200)],
        axis=-1,
    )
    bent = PathNormals(circle(1.5)).bent(points)
    turn = points[:, 0] / 1.5
    radius = 1.5 - points[:, 1]  # a point to the left is nearer to the centre
    expected = np.stack([radius * np.sin(turn), 1.5 - radius * np.cos(turn), points[:, 2]], axis=-1)
    np.testing.assert_allclose(bent, expected, atol=2e-5)


def test_an_unsigned_distance_puts_both_feet_on_one_side() -> None:
    normals = PathNormals(circle(1.5))
    pair = np.array([[1.0, 0.2, 0.0], [1.0, -0.2, 0.0]])
    signed, printed = normals.bent(pair), normals.bent(np.abs(pair))
    assert np.linalg.norm(signed[0] - signed[1]) == pytest.approx(0.4, abs=1e-6)
    np.testing.assert_allclose(printed[0], printed[1])  # |P0 S0| = |P1 S1| says no side


def test_a_foot_beyond_the_centre_of_curvature_is_refused() -> None:
    with pytest.raises(
        InputError, match=r"radius is 0\.30\d m after 1\.00 m, and a foot is 0\.310 m"
    ):
        PathNormals(circle(0.3)).bent(np.array([[1.0, 0.31, 0.0]]))
    PathNormals(circle(0.3)).bent(np.array([[1.0, -0.31, 0.0]]))  # outside it may be


@pytest.mark.parametrize("name", ANIMALS)
def test_feet_stand_still_on_hills_and_bends(name: str) -> None:
    animal = read_animal(name)
    rng = np.random.default_rng(3)
    ground = HeightField(0.05 * rng.standard_normal((81, 81)), 0.25, -10.0, -10.0)
    made = prototype(animal, times(name))
    motion = transformed(made, animal, circle(1.0), ground)
    stays = motion.on_ground[1:] & motion.on_ground[:-1]
    assert np.linalg.norm(np.diff(motion.foot_m, axis=0), axis=-1)[stays].max() < 1e-9
    on = motion.foot_m[motion.on_ground]
    np.testing.assert_allclose(on[:, 2], ground.elevation_m(on[:, 0], on[:, 1]), atol=1e-9)


@pytest.mark.parametrize("name", ANIMALS)
def test_on_a_plane_the_body_stands_upright_on_it(name: str) -> None:
    animal = read_animal(name)
    made = prototype(animal, times(name))
    slope = np.tan(np.radians(20.0))
    motion = transformed(made, animal, STRAIGHT, plane(slope, 0.0))
    normal = np.array([-np.sin(np.radians(20.0)), 0.0, np.cos(np.radians(20.0))])
    np.testing.assert_allclose(motion.up, np.broadcast_to(normal, motion.up.shape), atol=1e-9)
    above = motion.spine_m @ normal
    np.testing.assert_allclose(above, made.spine_m[..., 2], atol=1e-9)
    hips = np.linalg.norm(motion.hip_m[:, 0] - motion.hip_m[:, 1], axis=-1)
    np.testing.assert_allclose(hips, 2.0 * animal.leg_pairs[0].hip_side * animal.length_m)


def test_a_plane_is_found_exactly() -> None:
    rng = np.random.default_rng(5)
    plan = rng.uniform(-1.0, 1.0, (7, 30, 2))
    slope = rng.uniform(-0.5, 0.5, (7, 2))
    height = (plan * slope[:, None]).sum(axis=-1) + 0.3
    middle, level, normal = local_planes(plan, height)
    np.testing.assert_allclose(level, (middle * slope).sum(axis=-1) + 0.3)
    np.testing.assert_allclose(-normal[:, :2] / normal[:, 2:], slope, atol=1e-12)
