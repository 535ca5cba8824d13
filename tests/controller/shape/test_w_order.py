"""W of [PT] Eq. 4-7: its order against fractions, its stated properties, and the star."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from snakewalk.controller.shape.star import star_order
from snakewalk.controller.shape.walks import compare_w

counts = st.tuples(st.integers(1, 40), st.integers(0, 60), st.integers(0, 30)).filter(
    lambda one: one[1] > 0 or one[2] == 0  # never selected: never left
)


def w(degree: int, selected: int, failures: int) -> Fraction:
    """Eq. 7 term by term."""
    sign_m, sign_f = int(selected > 0), int(failures > 0)
    unvisited = 1 - sign_m
    visited = degree * (sign_m + sign_f)
    failed = selected * 2**failures
    return Fraction(degree, unvisited + visited + failed)


@given(counts, counts)
def test_w_is_compared_exactly(a: tuple[int, int, int], b: tuple[int, int, int]) -> None:
    difference = w(*a) - w(*b)
    assert compare_w(a, b) == (difference > 0) - (difference < 0)


@given(counts.filter(lambda one: one[1] <= one[0] + one[2]))
def test_where_eq_3_holds_w_tells_the_three_classes_apart(one: tuple[int, int, int]) -> None:
    _, selected, failures = one
    value = w(*one)
    assert (value >= 1) == (selected == 0)
    assert (Fraction(1, 2) <= value < 1) == (selected > 0 and failures == 0)
    assert (value < Fraction(1, 2)) == (failures > 0)


def test_a_float_cannot_hold_2_to_the_f_and_the_order_still_stands() -> None:
    with pytest.raises(OverflowError):
        float(2**1100)
    assert compare_w((3, 1, 1100), (3, 1, 1101)) == 1
    assert compare_w((4, 9, 5000), (4, 4, 5001)) == -1  # 9 > 4 * 2
    assert compare_w((4, 8, 5000), (4, 4, 5001)) == 0


def order(rows: list[tuple[int, int, float]]) -> list[int]:
    m, f, error = zip(*rows, strict=True)
    return list(star_order(np.array(m), np.array(f), np.array(error)))


def test_a_star_orders_by_unvisited_then_unfailed_then_m_2_to_the_f() -> None:
    rows = [(4, 1, 0.0), (1, 2, 0.0), (9, 0, 0.0), (0, 0, 0.3), (2, 0, 0.0), (3, 1, 0.0)]
    assert order(rows) == [3, 4, 2, 1, 5, 0]  # 1 2^2 < 3 2^1 < 4 2^1
    assert order([(3, 0, 0.0), (2, 0, 0.5), (1, 1, 0.0)]) == [1, 0, 2]


def test_a_tie_on_a_star_goes_to_the_smaller_heading_error_of_either_sign() -> None:
    assert order([(0, 0, 0.4), (0, 0, -0.1), (0, 0, 0.2)]) == [1, 2, 0]
    assert order([(2, 1, -0.4), (1, 2, 0.3), (4, 0, 0.9)]) == [2, 1, 0]
    assert order([(3, 5, 0.0), (2, 5, 0.1), (4, 4, -0.1), (2, 5, 0.05)]) == [3, 1, 2, 0]


def test_a_star_does_not_overflow() -> None:
    assert order([(1, 5001, 0.0), (3, 5000, 0.0), (1, 5000, 0.0), (2, 5000, -0.1)]) == [2, 0, 3, 1]


@given(
    st.lists(
        st.tuples(st.integers(0, 4), st.integers(0, 3), st.sampled_from([-0.5, 0.0, 0.1, 0.5])),
        min_size=1,
        max_size=40,
    ),
    st.sampled_from([(0, 0), (1, 0), (1, 1)]),
)
def test_a_star_is_ordered_as_by_integers(
    rows: list[tuple[int, int, float]], least: tuple[int, int]
) -> None:
    rows = [(m + least[0], f + least[1] if m + least[0] else 0, error) for m, f, error in rows]

    def key(k: int) -> tuple[int, int, float]:
        m, f, error = rows[k]
        return (0 if m == 0 else 1 if f == 0 else 2, m << f, abs(error))

    assert order(rows) == sorted(range(len(rows)), key=key)


def test_a_star_without_leaves_is_refused() -> None:
    nothing = np.zeros(0, dtype=np.int64)
    with pytest.raises(ValueError, match="no next state"):
        next(star_order(nothing, nothing, np.zeros(0)))
