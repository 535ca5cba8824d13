"""Cases of an expensive test: some of them in the fast tier, the others slow."""

from collections.abc import Collection, Iterable
from typing import Any

import pytest


def slow_except(fast: Collection[Any], cases: Iterable[Any]) -> list[Any]:
    """Return the cases of ``pytest.mark.parametrize``; all but the ``fast`` ones are slow."""
    return [case if case in fast else _slow(case) for case in cases]


def slow_after(count: int, cases: Iterable[Any]) -> list[Any]:
    """Return the cases of ``pytest.mark.parametrize``; all after the first few are slow."""
    return [case if k < count else _slow(case) for k, case in enumerate(cases)]


def _slow(case: Any) -> Any:
    return pytest.param(*(case if isinstance(case, tuple) else (case,)), marks=pytest.mark.slow)
