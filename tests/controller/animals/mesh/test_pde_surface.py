"""The biharmonic skin: curves met exactly, the equation met, and what fails as printed."""

from math import comb

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from snakewalk.config.errors import InputError
from snakewalk.controller.animals.mesh.pde_surface import TURN, PdeSurface
from tests.oracles.carried_mesh import carry_over

Floats = NDArray[np.float64]
COUNT = 48
CURVES_AT = np.linspace(0.0, 1.0, 4)
V = np.arange(COUNT) * TURN / COUNT


def tube(seed: int = 0, rough_m: float = 0.01) -> Floats:
    """Four rough rings about a bent line."""
    rng = np.random.default_rng(seed)
    rings = []
    for k, radius in enumerate((0.02, 0.06, 0.05, 0.01)):
        side = radius * (1.0 + 0.2 * np.cos(3 * V)) + rough_m * rng.normal(size=COUNT)
        rings.append(
            np.stack(
                [np.full(COUNT, -0.3 * k), side * np.cos(V) + 0.02 * k**2, side * np.sin(V)], 1
            )
        )
    return np.array(rings)


@pytest.mark.parametrize("modes", [0, 1, 5, 20])
@pytest.mark.parametrize("spread", [0.5, 1.0, 4.0])
def test_all_four_curves_are_met_exactly(modes: int, spread: float) -> None:
    curves = tube()
    surface = PdeSurface.through(curves, modes, spread)
    np.testing.assert_allclose(surface.points_m(CURVES_AT, V), curves, atol=1e-10)


def operator(surface: PdeSurface, order: int, factor: float, u: Floats, v: Floats) -> Floats:
    """``(d2/du2 + factor d2/dv2)^N X`` from the closed derivatives."""
    total = np.zeros((len(u), len(v), 3))
    for k in range(order + 1):
        part = surface.points_m(u, v, along=2 * (order - k), around=2 * k)
        total += comb(order, k) * factor**k * part
    return total


@pytest.mark.parametrize("count", [47, 48])
@pytest.mark.parametrize("order", [1, 2, 3])
def test_with_all_modes_the_surface_solves_the_equation_and_meets_every_curve(
    order: int, count: int
) -> None:
    """Rough curves, no remainder: the operator is nought to rounding, relative to its own terms."""
    rng = np.random.default_rng(order)
    curves = rng.normal(size=(2 * order, count, 3))
    spread = 0.7
    surface = PdeSurface.through(curves, spread=spread)
    turn = np.arange(count) * TURN / count
    np.testing.assert_allclose(
        surface.points_m(np.linspace(0, 1, 2 * order), turn), curves, atol=1e-8
    )
    assert not surface.left_out.any()
    u, v = np.linspace(0.05, 0.95, 7), np.linspace(0.1, 6.0, 9)
    size = np.abs(surface.points_m(u, v, along=2 * order)).max()
    assert np.abs(operator(surface, order, spread**2, u, v)).max() < 1e-9 * size
    assert np.abs(operator(surface, order, 1.0, u, v)).max() > 1e-2 * size


def test_derivatives_are_those_of_differences() -> None:
    surface = PdeSurface.through(tube(), 9, 1.3)
    u, v, h = np.array([0.37]), np.array([1.1]), 1e-5
    along = (surface.points_m(u + h, v) - surface.points_m(u - h, v)) / (2 * h)
    around = (surface.points_m(u, v + h) - surface.points_m(u, v - h)) / (2 * h)
    np.testing.assert_allclose(surface.points_m(u, v, along=1), along, rtol=1e-6, atol=1e-8)
    np.testing.assert_allclose(surface.points_m(u, v, around=1), around, rtol=1e-6, atol=1e-8)


def test_slopes_and_curvatures_are_met_where_they_are_given() -> None:
    rng = np.random.default_rng(3)
    given = rng.normal(size=(6, 20, 3))
    kinds = [0, 1, 2, 0, 1, 2]
    surface = PdeSurface.through(given, ring_places=[0, 0, 0, 1, 1, 1], slopes=kinds)
    turn = np.arange(20) * TURN / 20
    for k, kind in enumerate(kinds):
        np.testing.assert_allclose(
            surface.points_m(float(k > 2), turn, along=kind)[0], given[k], atol=1e-8
        )


def test_moved_curves_make_the_moved_surface() -> None:
    """A rigid motion and the solution commute: the surface has no place of its own."""
    curves = tube()
    turn = Rotation.from_rotvec([0.3, -1.1, 0.7]).as_matrix()
    u, v = np.linspace(0, 1, 9), np.linspace(0, 6, 11)
    moved = PdeSurface.through(curves @ turn.T + [1.0, 2.0, 3.0]).points_m(u, v)
    rest = PdeSurface.through(curves).points_m(u, v)
    np.testing.assert_allclose(moved, rest @ turn.T + [1.0, 2.0, 3.0], atol=1e-11)


def test_the_surface_solves_the_equation_with_the_factor_that_is_not_printed() -> None:
    """[GC] Eq. 1 lacks a^2: by finite differences the operator with it is nought."""
    spread, h = 2.0, 1e-2
    surface = PdeSurface.through(tube(rough_m=0.0), 5, spread)
    steps = h * np.arange(-4, 5)
    patch = surface.points_m(0.45 + steps, 0.7 + steps)

    def differences(x: Floats, factor: float) -> Floats:
        uu = (x[2:, 1:-1] - 2 * x[1:-1, 1:-1] + x[:-2, 1:-1]) / h**2
        vv = (x[1:-1, 2:] - 2 * x[1:-1, 1:-1] + x[1:-1, :-2]) / h**2
        return np.asarray(uu + factor * vv)

    right, printed = (np.abs(differences(differences(patch, f), f)).max() for f in (spread**2, 1.0))
    assert right < 0.02 * printed


def test_the_zeroth_term_is_the_spine_through_the_rings_middles() -> None:
    curves = tube()
    surface = PdeSurface.through(curves)
    np.testing.assert_allclose(surface.spine_m(CURVES_AT), curves.mean(axis=1), atol=1e-12)


def test_a_straight_cylinder_of_one_mode_is_a_cylinder_at_its_curves_and_round_between() -> None:
    ring = np.stack([0 * V, 0.05 * np.cos(V), 0.05 * np.sin(V)], axis=1)
    curves = np.array([ring - (0.4 * at, 0.0, 0.0) for at in CURVES_AT])
    points = PdeSurface.through(curves, 1).points_m(np.linspace(0, 1, 31), V)
    radius = np.hypot(points[..., 1], points[..., 2])
    assert np.ptp(radius, axis=1).max() < 1e-12
    np.testing.assert_allclose(radius, 0.05, rtol=2e-3)
    np.testing.assert_allclose(
        points[..., 0].mean(axis=1), -0.4 * np.linspace(0, 1, 31), atol=1e-12
    )


def test_printed_exponentials_are_singular_in_practice_and_scaled_ones_are_not() -> None:
    u = np.array(CURVES_AT)
    for mode, least in ((12, 1e7), (30, 1e15)):
        grow, fall = np.exp(mode * u), np.exp(-mode * u)
        printed = np.stack([grow, u * grow, fall, u * fall], axis=1)
        scaled = printed * np.array([np.exp(-mode), np.exp(-mode), 1.0, 1.0])
        assert np.linalg.cond(printed) > least
        assert np.linalg.cond(scaled) < 1e-4 * np.linalg.cond(printed)
    rough = PdeSurface.through(tube(rough_m=0.02), 23)
    np.testing.assert_allclose(rough.points_m(CURVES_AT, V), tube(rough_m=0.02), atol=1e-9)


def test_a_sample_at_two_pi_counts_double_and_is_refused() -> None:
    """With it the middle of a ring moves towards that point."""
    ring = np.stack([np.cos(V), np.sin(V), 0 * V], axis=1)
    closed = np.vstack([ring, ring[:1]])
    assert np.abs(ring.mean(axis=0)).max() < 1e-12
    assert closed.mean(axis=0)[0] == pytest.approx(1.0 / (COUNT + 1))
    with pytest.raises(InputError, match="leave out the one at 2 pi"):
        PdeSurface.through(np.array([closed + np.array([0.0, 0.0, k]) for k in range(4)]))


@pytest.mark.parametrize(
    ("curves", "modes", "words"),
    [
        (np.zeros((3, 8, 3)), 2, "shape"),
        (tube(), 24, "modes need"),
        (tube() * np.nan, 2, "finite"),
    ],
)
def test_useless_curves_are_refused(curves: Floats, modes: int, words: str) -> None:
    with pytest.raises(InputError, match=words):
        PdeSurface.through(curves, modes)


def test_the_spine_carries_the_skin_and_the_skin_a_mesh() -> None:
    u = np.linspace(0, 1, 40)
    surface = PdeSurface.through(tube())
    rest = surface.points_m(u, V)
    shift = np.stack([0 * u, 0.1 * np.sin(3 * u), 0 * u], axis=1)
    moved = surface.moved_m(u, V, shift)
    np.testing.assert_allclose(moved - rest, np.repeat(shift[:, None], COUNT, axis=1), atol=1e-12)
    mesh = rest[5:30, ::7].reshape(-1, 3) + 1e-4
    carried = carry_over(mesh, rest, moved)
    np.testing.assert_allclose(
        carried - mesh, np.repeat(shift[5:30], len(V[::7]), axis=0), atol=1e-12
    )
