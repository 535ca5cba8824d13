"""Heights that no ground has: undeclared values of missing cells."""

from typing import Final

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import Assumptions, InputError

LOWEST_M: Final = -430.0
"""The lowest dry land: the shore of the Dead Sea, which sinks by a metre a year."""
HIGHEST_M: Final = 8850.0
"""The highest: Mount Everest, 8848.86 m (China and Nepal, 2020)."""
_MOST_M: Final = 1e6
_GAP_M: Final = 50.0
"""Step to all other heights, wider than their relief, that is suspicious (ours)."""
_MANY: Final = 3
"""Cells of one value there (ours)."""


def check_heights(z_m: Floats, per_value_m: float, assumed: Assumptions) -> None:
    """Reject heights that are probably values of missing cells.

    Args:
        z_m: heights in metres; NaN for no data.
        per_value_m: metres per step of the file's values, for the suggestion.
        assumed: may state ``lowest_m`` and ``highest_m`` of the ground.

    Raises:
        InputError: the question.

    """
    finite = z_m[np.isfinite(z_m)]
    if not len(finite):
        return
    lowest_m = assumed.given("lowest_m", -_MOST_M, _MOST_M)
    highest_m = assumed.given("highest_m", -_MOST_M, _MOST_M)
    low, high = float(finite.min()), float(finite.max())
    if low < (LOWEST_M if lowest_m is None else lowest_m):
        raise InputError(
            _question(
                finite, low, per_value_m, f"no dry land lies below {LOWEST_M:g} m", "lowest_m"
            )
        )
    if high > (HIGHEST_M if highest_m is None else highest_m):
        raise InputError(
            _question(finite, high, per_value_m, f"no land is over {HIGHEST_M:g} m", "highest_m")
        )
    if lowest_m is None:
        _check_gap(finite, low, per_value_m)
    if highest_m is None:
        _check_gap(-finite, -high, -per_value_m)


def _check_gap(values: Floats, low: float, per_value_m: float) -> None:
    """Reject one value in many cells, far below all others (for negated values: above)."""
    count = int((values == low).sum())
    others = values[values > low]
    if count < _MANY or not len(others):
        return
    gap = float(others.min()) - low
    relief = float(np.ptp(others))
    if gap > max(_GAP_M, relief):
        sign = 1.0 if per_value_m > 0.0 else -1.0
        side, key = ("below", "lowest_m") if sign > 0.0 else ("above", "highest_m")
        raise InputError(
            _question(
                sign * values, sign * low, abs(per_value_m), f"{gap:.4g} m {side} all others", key
            )
        )


def _question(finite: Floats, value: float, per_value_m: float, why: str, key: str) -> str:
    count = int((finite == value).sum())
    cells = f"{count} cell{'s' if count != 1 else ''}"
    return (
        f"holds heights of {value:.6g} m in {cells}: {why}; add "
        f"--no-data {value / per_value_m:.7g} if they are missing, "
        f"--assume {key}={value:.6g} if they are heights, or the right --height-unit"
    )
