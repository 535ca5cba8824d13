"""The force balance: closed forms of bodies that change shape on Coulomb friction."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from snakewalk.config.constants import GRAVITY_M_S2
from snakewalk.config.world import FrictionConfig
from snakewalk.controller.mechanics.rigid_motion import (
    Inertia,
    NoBalanceError,
    rigid_velocity,
)
from snakewalk.controller.mechanics.slope_load import holding_factor

RNG = np.random.default_rng(11)
SNAKE = FrictionConfig(along=0.1, across=0.7)
SAME = FrictionConfig(along=0.4, across=0.4)
X = np.linspace(0.0, -1.0, 17)
LINE = np.stack([X, np.zeros(17)], axis=1)


def wave(shift: float, amplitude: float = 0.7) -> tuple[np.ndarray, np.ndarray]:
    """Points (fixed head) and headings of a travelling sine."""
    heading = amplitude * np.sin(2 * np.pi * 1.2 * (shift - np.arange(17) / 17))
    step = np.stack([np.cos(heading), np.sin(heading)], axis=1) / 17
    points = -np.cumsum(0.5 * (step + np.vstack([np.zeros(2), step[:-1]])), axis=0)
    return points, heading


def net(w: np.ndarray, points, headings, shape, friction) -> tuple[np.ndarray, int]:
    """Independent sum of forces and moment of the moving links, and how many links stick."""
    total, stuck = np.zeros(3), 0
    for p, h, change in zip(points, headings, shape, strict=True):
        v = change + w[:2] + w[2] * np.array([-p[1], p[0]])
        axes = np.array([[np.cos(h), np.sin(h)], [-np.sin(h), np.cos(h)]])
        mu = np.array([friction.along, friction.across])
        local = axes @ v
        if np.hypot(*local) < 0.02:
            stuck += 1
            continue
        force = -axes.T @ (mu**2 * local) / np.hypot(*(mu * local))
        total += [*force, p[0] * force[1] - p[1] * force[0]]
    return total, stuck


@given(st.floats(-1, 1), st.floats(-1, 1), st.floats(-2, 2))
def test_a_rigid_motion_of_the_shape_is_undone(vx: float, vy: float, omega: float) -> None:
    shape = np.array([vx, vy]) + omega * np.stack([-LINE[:, 1], LINE[:, 0]], axis=1)
    w = rigid_velocity(LINE, np.zeros(17), shape, SNAKE)
    np.testing.assert_allclose(w, [-vx, -vy, -omega], atol=1e-5)


@pytest.mark.parametrize("friction", [SNAKE, SAME])
def test_forces_and_moment_balance(friction: FrictionConfig) -> None:
    for shift in RNG.uniform(0, 2, 10):
        (p0, h0), (p1, _) = wave(shift), wave(shift + 1e-4)
        shape = (p1 - p0) / 1e-4 * 30.0  # fast, so that the smoothing at rest does not count
        w = rigid_velocity(p0, h0, shape, friction)
        total, stuck = net(w, p0, h0, shape, friction)
        # a link at rest holds with anything up to its ellipse; the others must balance
        assert np.abs(total[:2]).max() <= stuck * friction.across + 0.01
        assert stuck <= 2


@pytest.mark.parametrize("links", [1, 3, 7, 8, 9, 16, 17, 25])
def test_any_number_of_links_spends_the_least_power(links: int) -> None:
    """Links stand in groups of eight: a group that is not full adds nothing of its own."""
    rng = np.random.default_rng(links)
    points, shape = rng.normal(size=(links, 2)), rng.normal(size=(links, 2))
    heading, normal = rng.uniform(-np.pi, np.pi, links), rng.uniform(0.5, 1.5, links)
    axes = np.stack([np.cos(heading), np.sin(heading)], axis=1)
    sides = np.stack([-axes[:, 1], axes[:, 0]], axis=1)

    def power(w: np.ndarray) -> float:
        v = shape + w[:2] + w[2] * np.stack([-points[:, 1], points[:, 0]], axis=1)
        along, across = (v * axes).sum(axis=1), (v * sides).sum(axis=1)
        return float((normal * np.hypot(SNAKE.along * along, SNAKE.across * across)).sum())

    found = rigid_velocity(points, heading, shape, SNAKE, normal=normal)
    least = power(found)
    for _ in range(300):
        assert least <= power(found + rng.normal(size=3) * rng.choice([1e-3, 0.1, 3.0])) + 1e-6


def advance(friction: FrictionConfig) -> float:
    """Forward way of the centre over one period of the wave, in body lengths per unit of pulse."""
    steps, x, angle, w = 200, np.zeros(2), 0.0, np.zeros(3)
    start = None
    for k in range(steps + 1):
        (p0, h0), (p1, _) = wave(k / steps / 1.2), wave((k + 1) / steps / 1.2)
        c, s = np.cos(angle), np.sin(angle)
        turn = np.array([[c, -s], [s, c]])
        centre = x + turn @ p0.mean(axis=0)
        start = centre if start is None else start
        w = rigid_velocity(p0, h0, p1 - p0, friction, w)
        x, angle = x + turn @ w[:2], angle + w[2]
    return float((centre - start)[0] * 1.2)


def test_a_travelling_wave_pushes_forward_only_where_sliding_along_is_easier() -> None:
    assert advance(FrictionConfig(along=0.01, across=1.0)) > advance(SNAKE) > 0.4
    assert advance(SAME) < 0.0


def test_the_scale_of_friction_does_not_matter() -> None:
    (p0, h0), (p1, _) = wave(0.3), wave(0.301)
    double = FrictionConfig(along=0.2, across=1.4)
    np.testing.assert_allclose(
        rigid_velocity(p0, h0, (p1 - p0) * 300, SNAKE),
        rigid_velocity(p0, h0, (p1 - p0) * 300, double),
        atol=1e-6,
    )


ALONG, ACROSS = np.arctan(SNAKE.along), np.arctan(SNAKE.across)


def ramp(slope_rad: float, down_rad: float, links: int = 17) -> dict[str, np.ndarray]:
    """Pull and share of links on a plane that falls by ``slope_rad`` towards ``down_rad``."""
    down = np.array([np.cos(down_rad), np.sin(down_rad)])
    return {
        "tangential": np.tile(np.sin(slope_rad) * down, (links, 1)),
        "normal": np.full(links, np.cos(slope_rad)),
    }


@pytest.mark.parametrize(("down_rad", "holds_rad"), [(0.0, ALONG), (np.pi / 2, ACROSS)])
def test_a_straight_body_lies_still_below_the_friction_angle_and_slides_above(
    down_rad: float, holds_rad: float
) -> None:
    still = np.zeros((17, 2))
    held = ramp(0.9 * holds_rad, down_rad)
    # what is left is the smoothing at rest, 0.1 mm/s across and 7 times that along
    assert np.abs(rigid_velocity(LINE, np.zeros(17), still, SNAKE, **held)).max() < 2e-3
    steep = ramp(1.01 * holds_rad, down_rad)
    with pytest.raises(NoBalanceError):
        rigid_velocity(LINE, np.zeros(17), still, SNAKE, **steep)
    expected = np.tan(holds_rad) / np.tan(1.01 * holds_rad)
    assert holding_factor(LINE, np.zeros(17), SNAKE, **steep) == pytest.approx(expected, abs=1e-3)


@given(st.floats(0.05, 1.2), st.floats(-np.pi, np.pi))
def test_a_straight_body_holds_while_the_pull_is_inside_the_ellipse(
    slope: float, down: float
) -> None:
    share = np.hypot(np.cos(down) / SNAKE.along, np.sin(down) / SNAKE.across) * np.tan(slope)
    found = holding_factor(LINE, np.zeros(17), SNAKE, **ramp(slope, down))
    assert found == pytest.approx(min(1.0, 1.0 / share), abs=1e-3)


def test_level_ground_gives_the_same_bits() -> None:
    for shift in RNG.uniform(0, 2, 20):
        (p0, h0), (p1, _) = wave(shift), wave(shift + 1e-3)
        level = ramp(0.0, 0.0)
        plain = rigid_velocity(p0, h0, (p1 - p0) * 300, SNAKE)
        np.testing.assert_array_equal(
            plain, rigid_velocity(p0, h0, (p1 - p0) * 300, SNAKE, **level)
        )


@given(st.floats(0, 2), st.floats(0, 0.15), st.floats(-3, 3), st.floats(-3, 3))
def test_turning_body_and_slope_together_turns_the_velocity(
    shift: float, slope: float, down: float, turned: float
) -> None:
    (p0, h0), (p1, _) = wave(shift), wave(shift + 1e-3)
    c, s = np.cos(turned), np.sin(turned)
    turn = np.array([[c, -s], [s, c]])
    shape = (p1 - p0) * 300
    one = rigid_velocity(p0, h0, shape, SNAKE, **ramp(slope, down))
    other = rigid_velocity(
        p0 @ turn.T, h0 + turned, shape @ turn.T, SNAKE, **ramp(slope, down + turned)
    )
    np.testing.assert_allclose(other, [*(turn @ one[:2]), one[2]], atol=1e-5)


def test_friction_carries_the_pull_of_the_slope() -> None:
    on = ramp(0.12, 2.0)
    for shift in RNG.uniform(0, 2, 10):
        (p0, h0), (p1, _) = wave(shift), wave(shift + 1e-4)
        shape = (p1 - p0) / 1e-4 * 30.0
        w = rigid_velocity(p0, h0, shape, SNAKE, **on)
        total, stuck = net(w, p0, h0, shape, SNAKE)
        total = total * np.cos(0.12)
        total[:2] += on["tangential"].sum(axis=0)
        total[2] += (p0[:, 0] * on["tangential"][:, 1] - p0[:, 1] * on["tangential"][:, 0]).sum()
        assert np.abs(total[:2]).max() <= stuck * SNAKE.across + 0.01
        assert stuck <= 2


@pytest.mark.parametrize("slope", [-0.2, 0.0, 0.2])
def test_with_inertia_a_sliding_body_gains_what_friction_leaves_of_gravity(slope: float) -> None:
    before, step_s = np.tile([1.0, 0.0], (17, 1)), 0.02
    inertia = Inertia(before, step_s)
    w = rigid_velocity(
        LINE, np.zeros(17), np.zeros((17, 2)), SNAKE, inertia=inertia, **ramp(slope, 0.0)
    )
    gained = step_s * GRAVITY_M_S2 * (np.sin(slope) - SNAKE.along * np.cos(slope))
    np.testing.assert_allclose(w, [1.0 + gained, 0.0, 0.0], atol=1e-6)
