"""Windowed variance and slope: closed forms on a plane, up to the border; brute force agrees."""

import numpy as np
import pytest
from scipy.signal import fftconvolve

from snakewalk.config.heightfield import HeightField
from snakewalk.config.world import PlannerConfig
from snakewalk.controller.terrain.relief import (
    Relief,
    _window_sum,
    elevation_variance_m2,
    fitted_slope_rad,
)

SPACING = 0.05


def field(of, half=1.5) -> HeightField:
    count = round(2 * half / SPACING) + 1
    x = np.linspace(-half, half, count)
    xx, yy = np.meshgrid(x, x)
    return HeightField(np.asarray(of(xx, yy), float), SPACING, -half, -half)


def test_a_plane_has_its_own_slope_even_at_the_corners() -> None:
    ground = field(lambda x, y: 0.3 * x - 0.2 * y + 7.0)
    slope = fitted_slope_rad(ground, 0.2)
    np.testing.assert_allclose(slope, np.arctan(np.hypot(0.3, 0.2)), atol=1e-9)


def test_variance_of_a_plane_is_the_quarter_of_rise_over_the_radius_squared() -> None:
    ground = field(lambda x, y: 0.3 * x + 0.4 * y)
    inside = elevation_variance_m2(ground, 0.5)[15:-15, 15:-15]
    np.testing.assert_allclose(inside, 0.25 * 0.5**2 / 4, rtol=0.05)  # a disc of samples
    assert np.ptp(inside) < 1e-12


def check_against_brute_force(ground: HeightField, radius_m: float) -> None:
    variance, slope = elevation_variance_m2(ground, radius_m), fitted_slope_rad(ground, radius_m)
    rows, columns = ground.z_m.shape
    yy, xx = np.mgrid[:rows, :columns] * ground.spacing_m
    corners = ((0, 0), (rows - 1, columns - 1), (0, columns // 2))
    for row, column in (*corners, (rows // 2, columns // 2), (3, columns - 2)):
        near = np.hypot(xx - xx[row, column], yy - yy[row, column]) <= radius_m + 1e-9
        z = ground.z_m[near]
        plane = np.linalg.lstsq(
            np.stack([xx[near], yy[near], np.ones(near.sum())], axis=1), z, rcond=None
        )[0]
        assert variance[row, column] == pytest.approx(z.var())
        assert slope[row, column] == pytest.approx(np.arctan(np.hypot(*plane[:2])))


def test_windows_are_cut_at_the_border_as_brute_force_cuts_them() -> None:
    rng = np.random.default_rng(3)
    check_against_brute_force(HeightField(rng.normal(100.0, 0.1, (21, 17)), SPACING, 0, 0), 0.17)


@pytest.mark.parametrize("spacing_m", [0.1, 0.05, 0.04, 0.03, 0.025, 0.02, 0.01])
@pytest.mark.parametrize("radius_m", [0.15, 0.3, 0.35, 0.6])
def test_a_window_holds_every_sample_within_its_radius(spacing_m: float, radius_m: float) -> None:
    rng = np.random.default_rng(4)
    count = 2 * int(1.2 * radius_m / spacing_m) + 9
    z = rng.normal(0.0, 0.1, (count, count + 2))
    check_against_brute_force(HeightField(z, spacing_m, -0.3, 0.7), radius_m)


@pytest.mark.parametrize("spacing_m", [0.1, 0.05, 0.025])
def test_a_spike_on_the_radius_is_not_overlooked(spacing_m: float) -> None:
    cells = round(0.3 / spacing_m)
    z = np.zeros((2 * cells + 1, 2 * cells + 1))
    z[cells, 0] = 1.0
    variance = elevation_variance_m2(HeightField(z, spacing_m, 0.0, 0.0), 0.3)
    assert variance[cells, cells] > 1e-4


def test_a_window_bridges_a_ripple_that_the_surface_shows() -> None:
    ground = field(lambda x, y: 0.01 * np.sin(2 * np.pi * x / 0.2))
    wide = fitted_slope_rad(ground, 0.4)[20:-20, 20:-20]
    assert wide.max() < 0.1 * ground.slope_rad(*np.meshgrid(*[np.linspace(-1, 1, 400)] * 2)).max()


def test_risk_keeps_both_limits_and_the_margin() -> None:
    config = PlannerConfig(
        slope_limit_rad=0.2, variance_limit_m2=1e-3, edge_margin_m=0.4, slope_window_m=0.15
    )
    relief = Relief(field(lambda x, y: 0.15 * x**2), config)
    rng = np.random.default_rng(0)
    x, y = rng.uniform(-1.6, 1.6, (2, 4000))
    safe = relief.safe(x, y)
    assert 0.2 < safe.mean() < 0.8
    assert (relief.slope_rad(x, y)[safe] <= 0.2).all()
    assert (relief.variance_m2(x, y)[safe] <= 1e-3).all()
    assert (np.maximum(abs(x), abs(y))[safe] <= 1.1 + 1e-6).all()
    assert relief.safe(0.0, 1.1)
    assert not relief.safe(0.0, 1.11)


def test_ground_that_was_not_measured_is_never_safe() -> None:
    """Level and filled in, it looks the best of all; no point within a slope window is safe."""
    z = np.zeros((61, 61))
    known = np.ones(z.shape, bool)
    known[20:31, 25:41] = False
    config = PlannerConfig(slope_window_m=0.1, edge_margin_m=0.0)
    relief = Relief(HeightField(z, 0.05, -1.5, -1.5, known), config)
    at = np.stack(np.meshgrid(np.arange(61), np.arange(61)), axis=-1)[~known] * 0.05 - 1.5
    rng = np.random.default_rng(2)
    near = at[rng.integers(len(at), size=3000)] + rng.uniform(-0.09, 0.09, (3000, 2)) / np.sqrt(2)
    assert not relief.safe(*near.T).any()
    assert not relief.known(*near.T).any()
    row, column = np.nonzero(known)
    points = np.stack([column, row], axis=-1) * 0.05 - 1.5
    gap = np.hypot(*(points[:, None] - at).transpose(2, 0, 1)).min(axis=1)
    assert relief.safe(*points[gap > 0.16].T).all()
    assert relief.known(*points[gap > 0.16].T).all()


@pytest.mark.parametrize("window", [(7, 7), (12, 5), (41, 40)])
def test_sums_in_windows_are_scipys_to_the_bit(window: tuple[int, int]) -> None:
    rng = np.random.default_rng(3)
    values, weight = rng.normal(size=(60, 75)), rng.normal(size=window)
    expected = fftconvolve(values, weight[::-1, ::-1], mode="same")
    np.testing.assert_array_equal(_window_sum(values, weight), expected)
