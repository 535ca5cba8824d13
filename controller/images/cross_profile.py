"""Steps along a line, and samples of a picture on both sides of it."""

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from snakewalk.config.arrays import Floats, Singles


def even_line(line: Floats, arc: Floats, step: float) -> Floats:
    """Return points of a line at equal steps of its length; the rest of a step is left out.

    ``arc`` is from ``arc_lengths``.
    """
    stations = np.arange(0.0, arc[-1], step)
    return np.column_stack([np.interp(stations, arc, column) for column in line.T])


def end_direction(line: Floats, back: int) -> Floats:
    """Return the unit vector (2,) to the last point of a line from the point ``back`` before it."""
    ahead = line[-1] - line[-1 - back]
    return np.asarray(ahead / max(np.hypot(*ahead), 1e-9))


def along_and_side(line: Floats) -> tuple[Floats, Floats]:
    """Return the unit vectors (P, 2) along a line (P, 2), and those a quarter turn from them."""
    along = np.gradient(line, axis=0)
    along = along / np.maximum(np.hypot(*along.T), 1e-9)[:, None]
    return along, np.column_stack([-along[:, 1], along[:, 0]])


def values_at(picture: NDArray[Any], places: Floats, border: int = cv2.BORDER_CONSTANT) -> Floats:
    """Return the values (...[, C]) of a picture at places (..., 2), linear between pixels.

    Args:
        picture: (h, w[, C]).
        places: x, y, with one to three leading axes.
        border: values outside the picture; 0 by default.

    """
    x, y = np.moveaxis(places.reshape(len(places), -1, 2), -1, 0).astype(np.float32)
    pixels = np.asarray(picture, dtype=np.float32)
    values = cv2.remap(pixels, x, y, cv2.INTER_LINEAR, borderMode=border)
    return np.asarray(values, dtype=float).reshape(*places.shape[:-1], *picture.shape[2:])


def seen_across(path: Floats, level: Singles, across: Floats) -> Singles:
    """(P, A) values of a picture at the distances ``across`` (A,) on the sides of a path (P, 2).

    Outside the picture the value is 0.
    """
    _, side = along_and_side(path)
    return values_at(level, path[:, None] + across[:, None] * side[:, None]).astype(np.float32)
