"""Steps along a line, and samples of a picture on both sides of it."""

import cv2
import numpy as np

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


def seen_across(path: Floats, level: Singles, across: Floats) -> Singles:
    """(P, A) values of a picture at the distances ``across`` (A,) on the sides of a path (P, 2).

    Outside the picture the value is 0.
    """
    along = np.gradient(path, axis=0)
    side = np.column_stack([-along[:, 1], along[:, 0]])
    side = side / np.maximum(np.hypot(*along.T), 1e-9)[:, None]
    x, y = np.moveaxis(path[:, None] + across[:, None] * side[:, None], -1, 0).astype(np.float32)
    level_across = cv2.remap(level, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)
    return np.asarray(level_across, dtype=np.float32)
