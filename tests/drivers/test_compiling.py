"""What is compiled is what is written, with and without arrays of its own."""

import numpy as np
import pytest
from numba.core.errors import NumbaError

from snakewalk.config.arrays import Floats
from snakewalk.drivers.compiling import compiled, readonly_array


def doubled(values: Floats, out: Floats) -> float:
    """Write twice the values behind the first; the sum of a view of them."""
    total = 0.0
    for k, value in enumerate(values[1:]):
        out[k] = 2.0 * value
        total += out[k]
    return total


@pytest.mark.parametrize("makes_arrays", [True, False])
def test_a_loop_reads_and_writes_what_it_is_given(makes_arrays: bool) -> None:
    made = compiled(
        f"float64({readonly_array(layout='C')}, float64[::1])", makes_arrays=makes_arrays
    )(doubled)
    values, out = np.array([9.0, 1.0, 2.5]), np.zeros(2)
    for _ in range(100):  # what it was given stays
        assert made(values, out) == 7.0
        assert made(values[:2].copy(), np.zeros(1)) == 2.0
    assert out.tolist() == [2.0, 5.0]
    assert values.tolist() == [9.0, 1.0, 2.5]


def test_a_loop_that_makes_an_array_has_to_say_so() -> None:
    def gathered(values: Floats) -> float:
        own = np.zeros(3)
        own[: len(values)] = values
        return float(own.sum())

    with pytest.raises(NumbaError):
        compiled(f"float64({readonly_array(layout='C')})", makes_arrays=False)(gathered)
