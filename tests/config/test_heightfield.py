"""The height field is exact on planes and continuous everywhere."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from snakewalk.config.heightfield import HeightField, surface

RNG = np.random.default_rng(3)


@given(a=st.floats(-1, 1), b=st.floats(-1, 1), c=st.floats(-5, 5))
def test_a_plane_is_reproduced_exactly(a: float, b: float, c: float) -> None:
    y, x = np.mgrid[0:6, 0:9] * 0.25
    field = HeightField(a * (x - 1.0) + b * (y - 0.5) + c, 0.25, -1.0, -0.5)
    px, py = RNG.uniform(-1, 1.0, 50), RNG.uniform(-0.5, 0.75, 50)
    np.testing.assert_allclose(field.elevation_m(px, py), a * px + b * py + c, atol=1e-12)
    np.testing.assert_allclose(field.slope_rad(px, py), np.arctan(np.hypot(a, b)), atol=1e-9)


def test_elevation_is_continuous_and_bounded_by_its_samples() -> None:
    field = HeightField(RNG.normal(size=(12, 10)), 0.1, 0.0, 0.0)
    x, y = RNG.uniform(0, 0.9, 4000), RNG.uniform(0, 1.1, 4000)
    z = field.elevation_m(x, y)
    assert field.z_m.min() <= z.min() <= z.max() <= field.z_m.max()
    step = 1e-7
    steepest = np.abs(np.diff(field.z_m, axis=0)).max() + np.abs(np.diff(field.z_m, axis=1)).max()
    bound = 4 * step / 0.1 * steepest
    assert np.abs(field.elevation_m(x + step, y + step) - z).max() <= bound


def test_points_outside_are_told_and_clamped() -> None:
    field = HeightField(np.array([[0.0, 1.0], [2.0, 3.0]]), 1.0, 0.0, 0.0)
    assert field.contains([0.5, 1.5], [0.5, 0.5]).tolist() == [True, False]
    assert field.elevation_m(9.0, 9.0) == 3.0


@pytest.mark.parametrize("bad", [np.zeros(4), np.zeros((1, 5)), np.full((3, 3), np.nan)])
def test_what_is_no_surface_is_refused(bad: np.ndarray) -> None:
    with pytest.raises(ValueError, match="finite"):
        HeightField(bad, 1.0, 0.0, 0.0)


def test_the_surface_is_what_the_elevation_says_inside_each_triangle_too() -> None:
    field = HeightField(RNG.normal(size=(5, 7)), 0.2, -1.0, 0.5)
    corners_m, faces = surface(field)
    assert corners_m.shape == (35, 3)
    assert len(faces) == 2 * 4 * 6
    inside_m = corners_m[faces].mean(axis=1)
    np.testing.assert_allclose(
        field.elevation_m(inside_m[:, 0], inside_m[:, 1]), inside_m[:, 2], atol=1e-12
    )
    one, other = (corners_m[faces[:, k], :2] - corners_m[faces[:, 0], :2] for k in (1, 2))
    area_m2 = 0.5 * (one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0])
    np.testing.assert_allclose(area_m2, 0.02)
