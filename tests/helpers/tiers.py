"""Cases of an expensive test: some of them in the fast tier, the others slow."""

from collections.abc import Container, Iterable
from typing import Any

import pytest


def slow_except(fast: Container[Any], cases: Iterable[Any]) -> list[Any]:
    """Return the cases of ``pytest.mark.parametrize``; all but the ``fast`` ones are slow."""
    return [
        case
        if case in fast
        else pytest.param(*(case if isinstance(case, tuple) else (case,)), marks=pytest.mark.slow)
        for case in cases
    ]
