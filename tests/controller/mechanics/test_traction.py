"""Gains of many shapes at once have the bits of each alone."""

import numpy as np
import pytest

from snakewalk.config.world import FrictionConfig
from snakewalk.controller.mechanics.rigid_motion import rigid_velocity
from snakewalk.controller.mechanics.traction import quasi_static_gain, rigid_velocities

FRICTION = FrictionConfig(along=0.1, across=0.7)


def shapes(count: int, points: int) -> np.ndarray:
    """Waves of random amplitude, length and phase."""
    rng = np.random.default_rng(0)
    a, waves, phase = rng.uniform([[0.1], [0.7], [0.0]], [[1.2], [2.5], [6.0]], (3, count))
    return a[:, None] * np.sin(
        2 * np.pi * np.outer(waves, np.linspace(0, 1, points)) + phase[:, None]
    )


@pytest.mark.parametrize("points", [100, 15])
def test_gains_of_many_shapes_are_those_of_each(points: int) -> None:
    many = shapes(40, points)
    alone = [quasi_static_gain(shape, FRICTION)[0] for shape in many]
    assert quasi_static_gain(many, FRICTION).tolist() == alone
    assert len(set(alone)) == 40


@pytest.mark.parametrize("links", [7, 8, 20])
def test_velocities_of_many_bodies_are_those_of_each(links: int) -> None:
    rng = np.random.default_rng(links)
    headings = shapes(12, links)
    points, change = rng.normal(size=(2, 12, links, 2))
    alone = [rigid_velocity(*body, FRICTION) for body in zip(points, headings, change, strict=True)]
    np.testing.assert_array_equal(rigid_velocities(points, headings, change, FRICTION), alone)
