"""From a line of pixels to a curve in the middle of the body, from tip to tip."""

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from snakewalk.config.arrays import Floats

Level = NDArray[np.float32]
WORKING_WIDTH = 14.0
"""Width of the body while it is thinned, px."""
_SMOOTH = 3.0  # of the chain of pixels, working px
_CENTRINGS = 2
_FOLLOW = 1.0  # how readily the way to a tip turns with the ridge


def to_the_tips(
    chain: Floats, fine: Level, threshold: float, depth: Level, tip: float
) -> Floats | None:
    """Smooth the chain of pixels, cut the forks off its ends, and go on to the boundary."""
    line = gaussian_filter1d(chain, _SMOOTH, axis=0, mode="nearest")
    arc = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
    deep = sample(depth, line)
    # within a radius of the end the axis of a blunt body turns into one of its corners
    inner = np.flatnonzero((arc >= deep) & (arc[-1] - arc >= deep))
    if len(inner) < 4:
        return None
    core = line[inner[0] : inner[-1] + 1]
    for _ in range(_CENTRINGS):
        core = _centred(core, fine, threshold)
    reach = min(round(WORKING_WIDTH), len(core))
    head = _tip(core[:reach][::-1], fine, tip)
    tail = _tip(core[-reach:], fine, tip)
    return np.vstack([head[::-1], core, tail])


def _centred(line: Floats, fine: Level, threshold: float) -> Floats:
    """Move each point to the middle between both sides.

    Thinning is off by up to a pixel, and smoothing cuts bends short.
    """
    along = np.gradient(line, axis=0)
    side = np.column_stack([-along[:, 1], along[:, 0]]) / np.hypot(*along.T)[:, None]
    out = np.arange(0.0, WORKING_WIDTH, 0.5)
    reach = []
    for sign in (1.0, -1.0):
        ray = line[:, None] + sign * out[:, None] * side[:, None]
        level = sample(fine, ray)
        below = level < threshold
        last = np.argmax(below, axis=1)
        row = np.arange(len(line))
        high, low = level[row, np.maximum(last - 1, 0)], level[row, last]
        part = np.clip((high - threshold) / np.maximum(high - low, 1e-6), 0.0, 1.0)
        reach.append(np.where(last > 0, out[last] - 0.5 + 0.5 * part, np.nan))
    off = 0.5 * (reach[0] - reach[1])
    known = np.flatnonzero(np.abs(off) < 0.25 * WORKING_WIDTH)
    if not known.size:
        return line
    off = np.interp(np.arange(len(line)), known, off[known])
    return np.asarray(line + gaussian_filter1d(off, _SMOOTH, mode="nearest")[:, None] * side)


def _tip(end: Floats, fine: Level, threshold: float) -> Floats:
    """Points on from the last of ``end`` (K, 2), along the ridge, to where the body ends."""
    ahead = end[-1] - end[0]
    ahead = ahead / np.hypot(*ahead)
    across = np.linspace(-0.5, 0.5, 15) * WORKING_WIDTH
    here, found, last = end[-1], [], threshold
    for _ in range(round(4.0 * WORKING_WIDTH)):
        there = here + ahead
        side = np.array([-ahead[1], ahead[0]])
        level = sample(fine, np.vstack([there, there + across[:, None] * side]))
        if level[0] <= threshold:
            part = (last - threshold) / max(last - level[0], 1e-6)
            found.append(here + float(np.clip(part, 0.0, 1.0)) * ahead)
            break
        last = float(level[0])
        weight = np.maximum(level[1:] - threshold, 0.0)
        off = float((weight * across).sum() / max(float(weight.sum()), 1e-9))
        turned = ahead + _FOLLOW * off / WORKING_WIDTH * side
        ahead = turned / np.hypot(*turned)
        here = there + 0.5 * _FOLLOW * off * side
        found.append(here)
    return np.asarray(found)


def sample(image: NDArray[np.generic], points: Floats) -> Floats:
    """Values (...) between the pixels at points (..., 2), one or two leading axes; 0 outside."""
    rows = points if points.ndim == 3 else points[:, None]
    x, y = np.ascontiguousarray(np.moveaxis(rows, -1, 0), dtype=np.float32)
    found = cv2.remap(
        np.asarray(image, dtype=np.float32),
        x,
        y,
        cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=0,
    )
    return np.asarray(found, dtype=float).reshape(points.shape[:-1])
