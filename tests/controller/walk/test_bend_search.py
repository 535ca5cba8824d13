"""The bend search: the vertex of a parabola in closed form, within the limits."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from snakewalk.controller.walk.bend_search import hexagon, vertex

MIDDLE = np.array([0.1, -0.2])
CURVES = st.floats(0.1, 10.0)


def test_a_hexagon_lies_about_its_middle_in_pairs() -> None:
    around = hexagon(MIDDLE)
    np.testing.assert_allclose(around[::2] + around[1::2], np.tile(2.0 * MIDDLE, (3, 1)))
    assert np.abs(hexagon(np.array([1.0, -1.0]))).max() == 1.0


@given(
    xx=CURVES,
    yy=CURVES,
    skew=st.floats(-0.9, 0.9),
    x=st.floats(-0.2, 0.2),
    y=st.floats(-0.4, 0.4),
    least=st.floats(-5.0, 5.0),
)
def test_the_vertex_of_a_parabola_is_found(
    xx: float, yy: float, skew: float, x: float, y: float, least: float
) -> None:
    matrix = np.array([[xx, 0.0], [0.0, yy]]) + skew * np.sqrt(xx * yy) * np.array([[0, 1], [1, 0]])
    at = MIDDLE + np.array([x, y])

    def cost(bends: np.ndarray) -> float:
        return least + float((bends - at) @ matrix @ (bends - at))

    found = vertex(MIDDLE, cost(MIDDLE), [cost(each) for each in hexagon(MIDDLE)])
    np.testing.assert_allclose(found.bends, at, atol=1e-6)
    assert found.enclosed


@pytest.mark.parametrize("far", [(0.6, 0.0), (0.0, 0.9), (-0.7, -0.7)])
def test_a_vertex_farther_away_is_sought_a_step_away(far: tuple[float, float]) -> None:
    middle = np.zeros(2)
    costs = [float(((each - far) ** 2).sum()) for each in hexagon(middle)]
    found = vertex(middle, float((np.array(far) ** 2).sum()), costs)
    assert not found.enclosed
    assert np.abs(found.bends / (0.25, 0.5)).max() == pytest.approx(1.0)
    assert float(found.bends @ far) > 0.0


@pytest.mark.parametrize("signs", [(-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0), (0.0, 0.0)])
def test_without_a_least_value_it_stays_where_it_is(signs: tuple[float, float]) -> None:
    costs = [float(np.dot(signs, (each - MIDDLE) ** 2)) for each in hexagon(MIDDLE)]
    found = vertex(MIDDLE, 0.0, costs)
    np.testing.assert_array_equal(found.bends, MIDDLE)
    assert not found.enclosed
