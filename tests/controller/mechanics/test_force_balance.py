"""The balance of friction under each law: the forces of a sum written here vanish."""

import numpy as np
import pytest

from snakewalk.config.friction_law import LawName
from snakewalk.config.world import FrictionConfig
from snakewalk.controller.mechanics.rigid_motion import (
    Inertia,
    NoBalanceError,
    rigid_velocity,
)
from tests.controller.mechanics.test_rigid_motion import LINE, wave

LAWS: tuple[LawName, ...] = ("scales", "wheels", "ellipse")
RNG = np.random.default_rng(3)
STUCK_M_S = 0.05
"""Speed on an axis below which it may hold by less than its coefficient."""


def milk_snake(law: LawName) -> FrictionConfig:
    return FrictionConfig(along=0.11, back=0.14, across=0.2, law=law)


def resistance(law: LawName, mu: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Resistance along and across (2,) per load, by the publication of each law."""
    if law == "wheels":
        return mu * np.sign(v)
    if law == "scales":
        return mu * v / np.linalg.norm(v)
    return mu**2 * v / np.linalg.norm(mu * v)


@pytest.mark.parametrize("law", LAWS)
def test_forces_and_moment_vanish(law: LawName) -> None:
    friction = milk_snake(law)
    for shift in RNG.uniform(0.0, 2.0, 10):
        (points, headings), (after, _) = wave(shift), wave(shift + 1e-4)
        shape = (after - points) / 1e-4 * 30.0  # fast, so that the smoothing at rest does not count
        w = rigid_velocity(points, headings, shape, friction)
        total, free = np.zeros(3), np.zeros(3)
        for p, h, change in zip(points, headings, shape, strict=True):
            axes = np.array([[np.cos(h), np.sin(h)], [-np.sin(h), np.cos(h)]])
            v = axes @ (change + w[:2] + w[2] * np.array([-p[1], p[0]]))
            mu = np.array([friction.along if v[0] >= 0.0 else friction.backward, friction.across])
            pulls = resistance(law, mu, v)
            still = np.abs(v) < STUCK_M_S if law == "wheels" else np.full(2, False)
            for axis, pull, rests, most in zip(axes, pulls, still, mu, strict=True):
                acts = np.array([*axis, p[0] * axis[1] - p[1] * axis[0]])
                total += 0.0 if rests else pull * acts
                free += most * np.abs(acts) if rests else 0.0
        assert (np.abs(total) <= free + 1e-3).all()


@pytest.mark.parametrize("law", LAWS)
def test_a_rigid_motion_of_the_shape_is_undone(law: LawName) -> None:
    shape = np.array([0.3, -0.2]) + 0.5 * np.stack([-LINE[:, 1], LINE[:, 0]], axis=1)
    w = rigid_velocity(LINE, np.zeros(17), shape, milk_snake(law))
    np.testing.assert_allclose(w, [-0.3, 0.2, -0.5], atol=1e-4)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize(("heading_rad", "mu"), [(0.0, 0.11), (np.pi, 0.14), (np.pi / 2, 0.2)])
def test_a_straight_body_holds_on_the_slope_of_its_coefficient(
    law: LawName, heading_rad: float, mu: float
) -> None:
    """Forward, backward and across; beyond that slope it slides with inertia."""
    c, s = np.cos(heading_rad), np.sin(heading_rad)
    points = LINE @ np.array([[c, s], [-s, c]])
    points = points - points.mean(axis=0)
    headings, still = np.full(17, heading_rad), np.zeros((17, 2))

    def pull(share: float) -> np.ndarray:
        return np.tile([share * mu, 0.0], (17, 1))

    w = rigid_velocity(points, headings, still, milk_snake(law), tangential=pull(0.95))
    assert np.abs(w).max() < 0.02
    with pytest.raises(NoBalanceError):
        rigid_velocity(points, headings, still, milk_snake(law), tangential=pull(1.1))
    inertia = Inertia(still, 0.1)
    w = rigid_velocity(
        points, headings, still, milk_snake(law), tangential=pull(1.1), inertia=inertia
    )
    assert w[0] == pytest.approx(0.1 * mu * 9.81 * 0.1, rel=0.05)
