"""Numbers as the rows of every cycle print them: the same as the plain encoder's."""

import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from snakewalk.controller.runlog.encode import (
    exact,
    exact_text,
    flags_text,
    floats,
    number,
    rounded_text,
    rounded_texts,
    text,
)

any_float = st.floats()
lists = st.lists(any_float, max_size=20)


@given(lists)
def test_every_digit_comes_back(values: list[float]) -> None:
    with np.errstate(over="ignore"):
        assert json.loads(exact_text(np.array(values))) == exact(values)


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_a_single_float_comes_back(value: float) -> None:
    assert json.loads(text(value)) == value


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_time_that_is_none_is_an_error(value: float) -> None:
    with pytest.raises(ValueError, match="not a JSON number"):
        text(value)


@given(st.lists(st.floats(-1e6, 1e6), min_size=6, max_size=6))
def test_rounded_rows_are_those_of_the_plain_encoder(values: list[float]) -> None:
    row, table = np.array(values[:4]), np.array(values).reshape(3, 2)
    first, second, empty = rounded_texts([row, table, np.zeros(0)])
    np.testing.assert_allclose(json.loads(first), floats(row), rtol=0, atol=1.01e-6)
    np.testing.assert_allclose(json.loads(second), floats(table), rtol=0, atol=1.01e-6)
    assert np.abs(np.array(json.loads(first)) - row).max() <= 0.5e-6 + 1e-9
    assert json.loads(empty) == []


_EDGES = [0.0, -0.0, 1e-9, -1e-9, 5e-7, 1.5e-6, 0.0000025, 999_999.9999995, -12.25, 1e6, 3e9]


@given(st.lists(st.floats(-1e7, 1e7) | st.sampled_from(_EDGES), max_size=8))
def test_rounded_rows_have_six_digits(values: list[float]) -> None:
    printed = "[" + ",".join(f"{value:.6f}" for value in values) + "]"
    assert rounded_texts([np.array(values)]) == [printed]
    assert rounded_texts([np.array([values, values])]) == [f"[{printed},{printed}]"]


def test_what_is_unknown_is_null_in_any_row() -> None:
    rows = [np.array([1.0, np.nan]), np.array([[np.inf, 0.25], [0.0, -1.0]])]
    first, second = rounded_texts(rows)
    assert json.loads(first) == [1.0, None]
    assert json.loads(second) == [[None, 0.25], [0.0, -1.0]]


@given(any_float)
def test_a_rounded_number_or_null(value: float) -> None:
    found, wanted = json.loads(rounded_text(value)), number(value)
    assert found == pytest.approx(wanted, rel=1e-15, abs=1e-6) if wanted is not None else not found


def test_flags_keep_their_kind() -> None:
    valid, error = np.array([True, False]), np.array([0, 128], np.uint8)
    assert json.loads(flags_text(valid.tobytes(), valid.dtype.char)) == [True, False]
    assert json.loads(flags_text(error.tobytes(), error.dtype.char)) == [0, 128]
