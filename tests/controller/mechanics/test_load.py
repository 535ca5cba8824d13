"""Torque from friction: statics in closed form."""

import numpy as np
import pytest

from snakewalk.config.world import FrictionConfig
from snakewalk.controller.mechanics.load import friction_n, yaw_load_n_m

SNAKE = FrictionConfig(along=0.1, across=0.7)


def test_friction_is_the_ellipse_against_the_motion() -> None:
    along = friction_n(np.array([[0.2, 0.0]]), np.zeros(1), SNAKE, 2.0)
    across = friction_n(np.array([[0.0, 0.2]]), np.zeros(1), SNAKE, 2.0)
    np.testing.assert_allclose(along, [[-0.2, 0.0]], rtol=1e-4, atol=1e-12)
    np.testing.assert_allclose(across, [[0.0, -1.4]], rtol=1e-4, atol=1e-12)
    turned = friction_n(np.array([[0.0, 0.2]]), np.full(1, np.pi / 2), SNAKE, 2.0)
    np.testing.assert_allclose(turned, [[0.0, -0.2]], rtol=1e-4, atol=1e-12)


def test_a_bar_dragged_sideways_loads_its_joints_like_a_cantilever() -> None:
    links, length, weight = 10, 0.07, 1.1
    centres = np.stack([-length * (np.arange(links) + 0.5), np.zeros(links)], axis=1)
    velocity = np.tile([0.0, 0.3], (links, 1))
    force = friction_n(velocity, np.zeros(links), SNAKE, weight)
    load = yaw_load_n_m(centres, np.zeros(links), np.full(links, length), force)
    behind = length * np.arange(links - 1, 0, -1)  # what hangs behind each joint
    expected = 0.7 * weight / length * behind**2 / 2
    np.testing.assert_allclose(np.abs(load), expected, rtol=1e-6)


def test_forces_in_balance_load_front_and_back_alike() -> None:
    """Seen from the head side the same moment appears, with the other sign."""
    rng = np.random.default_rng(0)
    links = 12
    headings = rng.normal(size=links)
    ends = np.vstack(
        [np.zeros(2), -np.cumsum(np.stack([np.cos(headings), np.sin(headings)], 1), 0)]
    )
    centres = 0.5 * (ends[1:] + ends[:-1])
    force = rng.normal(size=(links, 2))
    force -= force.mean(axis=0)
    arm = centres - centres.mean(axis=0)
    moment = (arm[:, 0] * force[:, 1] - arm[:, 1] * force[:, 0]).sum()
    twist = np.stack([-arm[:, 1], arm[:, 0]], axis=1)
    force -= twist * moment / (arm**2).sum()
    load = yaw_load_n_m(centres, headings, np.ones(links), force)
    for j in range(links - 1):
        ahead = centres[: j + 1] - ends[j + 1]
        f = force[: j + 1]
        assert load[j] == pytest.approx(-(ahead[:, 0] * f[:, 1] - ahead[:, 1] * f[:, 0]).sum())
