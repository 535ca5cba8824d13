"""What is compiled is what is written, with and without arrays of its own."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numba.core.errors import NumbaError
from pytest_mock import MockerFixture

from snakewalk.config.arrays import Floats
from snakewalk.drivers import compiling, fallbacks
from snakewalk.drivers.compiling import compiled, readonly_array
from snakewalk.drivers.fallbacks import ENVIRONMENT, fallbacks_in_use


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


@pytest.fixture
def checked_again(mocker: MockerFixture, tmp_path: Path) -> Iterator[None]:
    """The check of numba's private option runs again, and numba's cache is empty."""
    mocker.patch("numba.config.CACHE_DIR", str(tmp_path))
    mocker.patch.dict(fallbacks._reported_fallbacks, clear=True)
    compiling._can_skip_counting.cache_clear()
    yield
    compiling._can_skip_counting.cache_clear()


def counts(loop: Any) -> bool:
    """Whether a compiled loop was made with the counting of references."""
    return "NRT_" in next(iter(loop.inspect_llvm().values()))


def nothing(values: Floats) -> float:
    return 0.0


SIGNATURE = f"float64({readonly_array(layout='C')}, float64[::1])"


@pytest.mark.usefixtures("checked_again")
def test_numba_without_the_option_counts_references_and_has_the_same_bits(
    mocker: MockerFixture, tmp_path: Path
) -> None:
    usual = compiled(SIGNATURE, makes_arrays=False)(doubled)
    compiling._can_skip_counting.cache_clear()
    mocker.patch("numba.config.CACHE_DIR", str(tmp_path / "other"))
    mocker.patch.object(compiling, "_NO_REFERENCE_COUNTS", {"_unknown": False})
    loop = compiled(SIGNATURE, makes_arrays=False)(doubled)
    values = np.random.default_rng(3).normal(size=50)
    ends = []
    for each in (usual, loop):
        out = np.zeros(49)
        ends.append((each(values, out), out.tobytes()))
    assert ends[0] == ends[1]
    assert not counts(usual)
    assert counts(loop)
    (text,) = fallbacks_in_use()
    assert "_nrt is not usable (KeyError)" in text


@pytest.mark.usefixtures("checked_again")
def test_the_environment_forces_counted_references(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(ENVIRONMENT, "numba")
    forced = compiled(SIGNATURE, makes_arrays=False)(doubled)
    assert forced._cache.__class__.__name__ == "NullCache"
    monkeypatch.delenv(ENVIRONMENT)
    compiling._can_skip_counting.cache_clear()
    assert counts(forced)
    assert len(fallbacks_in_use()) == 1


@pytest.mark.usefixtures("checked_again")
def test_an_option_that_compiles_wrongly_is_not_used(mocker: MockerFixture) -> None:
    mocker.patch.object(compiling, "_double", nothing)
    assert not compiling._can_skip_counting()
    (text,) = fallbacks_in_use()
    assert "is wrong" in text
