"""Numbers to JSON: rounded below any sensor's resolution, NaN as null, valid JSON only.

Goals keep every digit, so that a replay is exact. Rows of every cycle have a fixed number of
digits: a compiled loop prints ``%.6f``, a template ``%.17g``, faster than the shortest exact text.
"""

import json
import math
from collections.abc import Sequence
from functools import cache, lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from snakewalk.config.arrays import Bytes, Floats, Ints
from snakewalk.config.heightfield import HeightField
from snakewalk.drivers.compiling import compiled, readonly_array

_DECIMALS = 6  # a thousandth of an encoder count, a microsecond, a micrometre
_GROUND_POINTS = 160  # along the longer edge
_NUMBER_BYTES = 24
"""More than a number of a million, its sign, its brackets and its comma."""
_EXACT = ".17g"  # gives every float64 back
DIGITS = {"exact": _EXACT, "rounded": f".{_DECIMALS}f"}
"""Formats of single numbers."""
encode = json.JSONEncoder(separators=(",", ":"), allow_nan=False).encode


def number(value: float) -> float | None:
    """One rounded float, or None for a value that is not finite."""
    return round(float(value), _DECIMALS) if np.isfinite(value) else None


def floats(values: ArrayLike) -> list[Any]:
    """Nested lists of rounded floats of any shape."""
    return exact(np.asarray(values, dtype=float).round(_DECIMALS))


def exact(values: ArrayLike) -> list[Any]:
    """Nested lists of floats with every digit."""
    array: Floats = np.asarray(values, dtype=float)
    if not np.isfinite(array).all():
        boxed = array.astype(object)
        boxed[~np.isfinite(array)] = None
        return list(boxed.tolist())
    return list(array.tolist())


def array(values: Any) -> Floats:
    """Return nested lists of a log as an array; null becomes NaN."""
    return np.array(values, dtype=float)


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


def exact_text(values: Floats) -> str:
    """JSON of ``exact``, for one row (n,)."""
    if not math.isfinite(values.dot(values)):
        return encode(exact(values))
    return _template(((len(values),),), _EXACT) % tuple(values.tolist())


def rounded_texts(arrays: Sequence[Floats]) -> list[str]:
    """JSON of ``floats`` for several arrays, (n,) or (n, m) each, at the cost of one."""
    flat = np.concatenate([values.ravel() for values in arrays])
    if not math.isfinite(flat.dot(flat)):
        return [encode(floats(values)) for values in arrays]
    shapes = tuple([values.shape for values in arrays])
    printed = np.empty(_NUMBER_BYTES * (len(flat) + len(shapes)), np.uint8)
    count = _print_rounded(flat, _lists(shapes), printed)
    if count < 0:
        return (_template(shapes, f".{_DECIMALS}f") % tuple(flat.tolist())).split("\n")
    return printed[:count].tobytes().decode("ascii").split("\n")


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


@cache
def _lists(shapes: tuple[tuple[int, ...], ...]) -> Ints:
    """(A, 2) rows of each array, 0 if it is one row, and numbers in a row."""
    sizes = np.array([(0, *shape)[-2:] for shape in shapes], dtype=np.int64)
    sizes.setflags(write=False)
    return sizes


@compiled(f"int64({readonly_array()}, {readonly_array('int64', 2)}, uint8[::1])")
def _print_rounded(values: Floats, lists: Ints, out: Bytes) -> int:  # noqa: C901  a compiled loop
    """Print finite ``values`` as ``_template`` does; how many bytes, or -1 where it must be used.

    The template is needed for large numbers, and for those so near the middle between two of six
    digits that their rounded product with a million does not decide which is printed.
    """
    position = k = 0
    for a in range(len(lists)):
        if a > 0:
            out[position] = 10  # a new line
            position += 1
        rows, columns = lists[a]
        if rows > 0:
            out[position] = 91  # [
            position += 1
        for row in range(max(rows, 1)):
            if row > 0:
                out[position] = 44  # ,
                position += 1
            out[position] = 91
            position += 1
            for column in range(columns):
                if column > 0:
                    out[position] = 44
                    position += 1
                if np.signbit(values[k]):
                    out[position] = 45  # -
                    position += 1
                scaled = abs(values[k]) * 1e6
                k += 1
                if scaled > 1e12 or abs(scaled - np.floor(scaled) - 0.5) <= 4e-16 * scaled:
                    return -1
                left = np.int64(np.rint(scaled))
                digits = 7
                while left >= 10**digits:
                    digits += 1
                for place in range(digits, -1, -1):
                    if place == digits - 6:
                        out[position + place] = 46  # .
                    else:
                        out[position + place] = 48 + left % 10
                        left //= 10
                position += digits + 1
            out[position] = 93  # ]
            position += 1
        if rows > 0:
            out[position] = 93
            position += 1
    return position


def thinned(ground: HeightField) -> dict[str, Any]:
    """Every n-th sample of a height field: enough to draw it."""
    step = max(1, -(-max(ground.z_m.shape) // _GROUND_POINTS))
    colour = ground.colour
    return {
        "z_m": ground.z_m[::step, ::step].round(4).tolist(),
        "spacing_m": ground.spacing_m * step,
        "x0_m": ground.x0_m,
        "y0_m": ground.y0_m,
        **({} if colour is None else {"colour": colour[::step, ::step].tolist()}),
    }
