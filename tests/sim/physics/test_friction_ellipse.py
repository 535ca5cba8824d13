"""The laws of friction by themselves, and how they end at rest."""

import numpy as np
import pytest

from snakewalk.config.friction_law import ELLIPSE, LAWS, SCALES, WHEELS
from snakewalk.sim.physics.friction import (
    AXIS,
    BENT_STOP_SHARE,
    DEPTH,
    FORCE,
    LANES,
    LOAD,
    LOSS,
    NORMAL,
    ROWS,
    SLIDE,
    STILL,
    friction_force,
    make_lanes,
    rub,
    stop_share,
)
from tests.oracles.numpy_steps import dry_forces

MU = (0.1, 0.7, 0.3, float(ELLIPSE))
"""Forward, across, back, and the law."""
LOAD_N = 1.1
DRAG = 33.0
RNG = np.random.default_rng(5)
SLIDING = RNG.normal(size=(200, 2))


def force(v: np.ndarray) -> np.ndarray:
    return np.array(friction_force(LOAD_N, v[0], v[1], MU, DRAG, LOAD_N))


def test_sliding_force_lies_on_the_half_ellipse_that_opposes_it() -> None:
    for v in SLIDING:
        along = MU[0] if v[0] > 0.0 else MU[2]
        assert np.hypot(*(force(v) / (np.array([along, MU[1]]) * LOAD_N))) == pytest.approx(1.0)
        assert force(v)[0] * v[0] < 0.0


def test_no_other_force_of_the_ellipse_takes_more_energy() -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 721)
    # a force forward resists sliding back
    along = np.where(np.cos(angle) > 0.0, MU[2], MU[0])
    others = LOAD_N * np.stack([along * np.cos(angle), MU[1] * np.sin(angle)], axis=1)
    for v in SLIDING:
        taken = -force(v) @ v
        assert taken >= (-others @ v).max() - 1e-12
        assert taken == pytest.approx((-others @ v).max(), rel=1e-4)


@pytest.mark.parametrize("law", range(len(LAWS)))
def test_near_rest_it_is_the_drag_that_stops_a_link(law: int) -> None:
    for v in 1e-5 * SLIDING:
        pulls = friction_force(LOAD_N, v[0], v[1], (*MU[:3], law), DRAG, LOAD_N)
        np.testing.assert_allclose(pulls, -DRAG * v)


def test_scales_weigh_the_components_of_the_direction() -> None:
    for v in SLIDING:
        way = v / np.hypot(*v)
        mu = np.array([MU[0] if v[0] > 0.0 else MU[2], MU[1]])
        pulls = friction_force(LOAD_N, v[0], v[1], (*MU[:3], SCALES), DRAG, LOAD_N)
        np.testing.assert_allclose(pulls, -LOAD_N * mu * way)


def test_wheels_roll_and_slip_each_by_coulomb() -> None:
    for v in SLIDING:
        mu = np.array([MU[0] if v[0] > 0.0 else MU[2], MU[1]])
        pulls = friction_force(LOAD_N, v[0], v[1], (*MU[:3], WHEELS), 1e8, LOAD_N)
        np.testing.assert_allclose(pulls, -LOAD_N * mu * np.sign(v))


def test_laws_agree_on_the_axes_and_nowhere_else() -> None:
    laws = [(*MU[:3], law) for law in range(len(LAWS))]
    for v in np.array([[0.3, 0.0], [-0.3, 0.0], [0.0, 0.3]]):
        pulls = [friction_force(LOAD_N, v[0], v[1], law, 1e4, LOAD_N) for law in laws]
        np.testing.assert_allclose(pulls, [pulls[0]] * 3)
    taken = [-np.dot((0.2, 0.1), friction_force(1.0, 0.2, 0.1, law, 1e4, 1.0)) for law in laws]
    assert taken[SCALES] < taken[ELLIPSE] < taken[WHEELS]


def test_force_shrinks_to_nothing_without_a_jump() -> None:
    speeds = np.linspace(0.0, 0.1, 2001)
    for v in SLIDING[:20]:
        way = v / np.hypot(*v)
        forces = np.array([force(speed * way) for speed in speeds])
        assert np.abs(np.diff(forces, axis=0)).max() < DRAG * 1.01 * speeds[1]
    assert tuple(force(np.zeros(2))) == (0.0, 0.0)
    assert friction_force(0.0, 1.0, 1.0, MU, DRAG, 0.0) == (0.0, 0.0)


@pytest.mark.parametrize("law", range(len(LAWS)))
def test_many_at_once_are_one_by_one(law: int) -> None:
    mu = (*MU[:3], law)
    v = np.concatenate([SLIDING, 1e-4 * SLIDING, np.zeros((1, 2))])
    load = RNG.uniform(0.0, 3.0, len(v))
    along, across = dry_forces(0.5 * load, v[:, 0], v[:, 1], mu, DRAG, load)
    single = [friction_force(0.5 * n, *each, mu, DRAG, n) for n, each in zip(load, v, strict=True)]
    np.testing.assert_allclose(np.stack([along, across], axis=1), single, atol=1e-15)


def lined_up(contacts: list[dict[int, np.ndarray]]) -> np.ndarray:
    """A table of contacts, each given by its rows."""
    table, _ = make_lanes(len(contacts))
    table[:] = 1.0
    for k, each in enumerate(contacts):
        for row, values in each.items():
            at = k // LANES * ROWS + k % LANES + row
            table[at : at + len(values) * LANES : LANES] = values
    return table


def test_contacts_side_by_side_rub_on_their_own_plane_and_as_each_would_alone() -> None:
    contacts = []
    for v in RNG.normal(size=(19, 3)):
        normal = RNG.normal(size=3) + np.array([0.0, 0.0, 4.0])
        rows = {SLIDE: v, NORMAL: normal / np.linalg.norm(normal), AXIS: RNG.normal(size=3)}
        rows[AXIS] /= np.linalg.norm(rows[AXIS])
        rows |= {DEPTH: np.array([1e-4, 3e-4]), LOAD: np.array([LOAD_N]), STILL: np.array([DRAG])}
        contacts.append(rows)
    table = lined_up(contacts)
    rub(table, len(contacts), MU)
    for k, each in enumerate(contacts):
        at, alone = k // LANES * ROWS + k % LANES, lined_up([each])
        rub(alone, 1, MU)
        acts = table[at + FORCE : at + FORCE + 3 * LANES : LANES]
        assert acts.tolist() == alone[FORCE : FORCE + 3 * LANES : LANES].tolist()
        normal = each[NORMAL]
        along = each[AXIS] - (each[AXIS] @ normal) * normal
        along /= np.linalg.norm(along)
        across = np.cross(normal, along)
        slides = each[SLIDE] @ along, each[SLIDE] @ across
        expected = friction_force(LOAD_N / 3.0, *slides, MU, DRAG, LOAD_N)
        np.testing.assert_allclose(
            (acts @ along, acts @ across, acts @ normal), (*expected, 0.0), atol=1e-12
        )
        assert table[at + LOSS] == pytest.approx(acts @ each[SLIDE])
        assert table[at + LOSS] < 0.0


@pytest.mark.parametrize("heading", [0.0, 0.4, np.pi / 2, 3.0])
def test_a_straight_body_that_may_roll_is_stopped_three_times_more_gently(heading: float) -> None:
    s = np.linspace(0.0, 1.0, 17)
    line = np.stack([s * np.cos(heading), s * np.sin(heading), 0.0 * s], axis=1)
    assert stop_share(line, 0.03) == pytest.approx(1.8 / 3.0)
    bent = line + 0.2 * np.sin(9.0 * s)[:, None] * np.array([-np.sin(heading), np.cos(heading), 0])
    assert stop_share(bent, 0.03) == pytest.approx(BENT_STOP_SHARE)
