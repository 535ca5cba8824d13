"""Numbers to JSON: rounded below what any sensor resolves, NaN as null, nothing that is not JSON.

What was asked and sent keeps every digit, so that a replay can be compared and fed exactly.
"""

import json
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from config.heightfield import HeightField

_DECIMALS: Final = 6  # a thousandth of an encoder count, a microsecond, a micrometre
_GROUND_POINTS: Final = 160  # along the longer edge

encode = json.JSONEncoder(separators=(",", ":"), allow_nan=False).encode


def number(value: float) -> float | None:
    """One rounded float, or None for what is not finite."""
    return round(float(value), _DECIMALS) if np.isfinite(value) else None


def floats(values: ArrayLike) -> list[Any]:
    """Nested lists of rounded floats of any shape."""
    return exact(np.asarray(values, dtype=float).round(_DECIMALS))


def exact(values: ArrayLike) -> list[Any]:
    """Nested lists of floats with every digit."""
    array: NDArray[np.float64] = np.asarray(values, dtype=float)
    if not np.isfinite(array).all():
        boxed = array.astype(object)
        boxed[~np.isfinite(array)] = None
        return list(boxed.tolist())
    return list(array.tolist())


def thinned(ground: HeightField) -> dict[str, Any]:
    """Every n-th sample of a height field: enough to draw it."""
    step = max(1, -(-max(ground.z_m.shape) // _GROUND_POINTS))
    return {
        "z_m": ground.z_m[::step, ::step].round(4).tolist(),
        "spacing_m": ground.spacing_m * step,
        "x0_m": ground.x0_m,
        "y0_m": ground.y0_m,
    }
