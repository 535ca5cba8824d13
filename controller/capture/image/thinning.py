"""A solid body thinned to a line of pixels, and the longest way along that line."""

import cv2
import numpy as np
from numpy.typing import NDArray

from snakewalk.config.arrays import Floats


def largest(mask: NDArray[np.bool_]) -> NDArray[np.uint8] | None:
    """(h, w) the largest part, 1 inside; None where there is nothing."""
    count, label, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=4)
    if count < 2:
        return None
    best = 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))
    return np.asarray(label == best, dtype=np.uint8)


def filled(solid: NDArray[np.uint8], hole_px: float) -> tuple[NDArray[np.uint8], bool]:
    """Holes filled, and whether one was larger than ``hole_px``, so that the body encloses it."""
    count, label, stats, _ = cv2.connectedComponentsWithStats(1 - solid, connectivity=8)
    outside = label[0, 0]
    holes = [stats[k, cv2.CC_STAT_AREA] for k in range(1, count) if k != outside]
    looped = max(holes, default=0) > hole_px
    return (label != outside).astype(np.uint8), bool(looped)


def longest_way(thin: NDArray[np.bool_]) -> tuple[Floats, float] | None:
    """The longest way between two ends (K, 2) x, y, and how far off it another part reaches."""
    rows, columns = np.nonzero(thin)
    if len(rows) < 3:
        return None
    one = _walk(rows, columns, thin.shape, [0])
    first = int(np.argmax(one[0]))
    far, before = _walk(rows, columns, thin.shape, [first])
    end = int(np.argmax(far))
    chain = [end]
    while before[chain[-1]] >= 0:
        chain.append(before[chain[-1]])
    away, _ = _walk(rows, columns, thin.shape, chain)
    return np.column_stack([columns[chain], rows[chain]]).astype(float), float(max(away))


def _walk(
    rows: NDArray[np.intp], columns: NDArray[np.intp], shape: tuple[int, ...], start: list[int]
) -> tuple[list[float], list[int]]:
    """Shortest ways over the pixels of a thin line from ``start``: lengths and predecessors."""
    wide = shape[1]
    place = {int(r) * wide + int(c): k for k, (r, c) in enumerate(zip(rows, columns, strict=True))}
    flat = list(place)
    slanted = 2.0**0.5
    sides = [(step, 1.0) for step in (1, -1, wide, -wide)]
    sides += [(step, slanted) for step in (wide + 1, wide - 1, -wide + 1, -wide - 1)]
    length, before = [-1.0] * len(flat), [-1] * len(flat)
    for k in start:
        length[k] = 0.0
    front = list(start)
    while front:
        later = []
        for k in front:
            for step, cost in sides:
                other = place.get(flat[k] + step, -1)
                if other >= 0 and length[other] < 0.0:
                    length[other] = length[k] + cost
                    before[other] = k
                    later.append(other)
        front = later
    return length, before
