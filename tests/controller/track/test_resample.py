"""Equal arcs along a body."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from snakewalk.controller.track.resample import equal_arc_length


def a_body(points: int, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return np.cumsum(rng.normal((1.5, 0.0), 1.0, (points, 2)), axis=0)


@pytest.mark.parametrize("count", [4, 5, 6, 12, 101])
def test_points_lie_on_the_spline_of_scipy_at_equal_arcs(count: int) -> None:
    body = a_body(count)
    at = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(body, axis=0).T))])
    spline = CubicSpline(at, body)
    fine = np.linspace(0.0, at[-1], 801)
    arc = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(spline(fine), axis=0).T))])
    expected = spline(np.interp(np.linspace(0.0, arc[-1], 101), arc, fine))
    np.testing.assert_allclose(equal_arc_length(body), expected, atol=1e-12 * at[-1])


@pytest.mark.parametrize("body", [np.zeros((9, 2)), a_body(3), np.full((9, 2), np.nan)])
def test_fewer_than_four_points_are_refused(body: np.ndarray) -> None:
    with pytest.raises(ValueError, match="4 distinct points"):
        equal_arc_length(body)
