"""Numbers to JSON: rounded below what any sensor resolves, NaN as null, nothing that is not JSON.

What was asked and sent keeps every digit, so that a replay can be compared and fed exactly. The
rows of every cycle are printed by templates with a fixed number of digits, ``%.6f`` and ``%.17g``:
the same numbers, four times quicker than the shortest text that gives a number back.
"""

import json
import math
from collections.abc import Sequence
from functools import cache, lru_cache
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snakewalk.config.heightfield import HeightField

_DECIMALS: Final = 6  # a thousandth of an encoder count, a microsecond, a micrometre
_GROUND_POINTS: Final = 160  # along the longer edge
_EXACT: Final = ".17g"  # gives every float64 back
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


def text(value: float) -> str:
    """One float with every digit.

    Raises:
        ValueError: it is not finite.

    """
    if not math.isfinite(value):
        raise ValueError(f"{value} is not a JSON number")
    return f"{value:{_EXACT}}"


def rounded_text(value: float) -> str:
    """JSON of ``number``."""
    return f"{value:.{_DECIMALS}f}" if math.isfinite(value) else "null"


def exact_text(values: NDArray[np.float64]) -> str:
    """JSON of ``exact``, for one row (n,)."""
    if not math.isfinite(values.dot(values)):
        return encode(exact(values))
    return _template(((len(values),),), _EXACT) % tuple(values.tolist())


def rounded_texts(arrays: Sequence[NDArray[np.float64]]) -> list[str]:
    """JSON of ``floats`` for several arrays, (n,) or (n, m) each, at the cost of one."""
    flat = np.concatenate([each.ravel() for each in arrays])
    if not math.isfinite(flat.dot(flat)):
        return [encode(floats(each)) for each in arrays]
    template = _template(tuple(each.shape for each in arrays), f".{_DECIMALS}f")
    return (template % tuple(flat.tolist())).split("\n")


@lru_cache(maxsize=256)
def flags_text(flags: bytes, kind: str) -> str:
    """JSON list of an array's bytes taken as ``kind``; mostly the same as in the last row."""
    return encode(np.frombuffer(flags, kind).tolist())


@cache
def _template(shapes: tuple[tuple[int, ...], ...], digits: str) -> str:
    """Nested lists of places for numbers, one line an array."""

    def lists(shape: tuple[int, ...]) -> str:
        if not shape:
            return f"%{digits}"
        return "[" + ",".join([lists(shape[1:])] * shape[0]) + "]"

    return "\n".join(map(lists, shapes))


def thinned(ground: HeightField) -> dict[str, Any]:
    """Every n-th sample of a height field: enough to draw it."""
    step = max(1, -(-max(ground.z_m.shape) // _GROUND_POINTS))
    return {
        "z_m": ground.z_m[::step, ::step].round(4).tolist(),
        "spacing_m": ground.spacing_m * step,
        "x0_m": ground.x0_m,
        "y0_m": ground.y0_m,
    }
