"""Bend search: the cheapest bends of the mean line over two half bodies, for a piece of track.

Bends are relative to their limit, in [-1, 1]. A hexagon about the best bends is judged, then the
minimum of the parabola through these seven costs.
"""

from typing import NamedTuple

import numpy as np

from snakewalk.config.arrays import Floats

SCREEN = np.array([[-0.5, 0.0], [0.0, 0.0], [0.5, 0.0]])
"""Bends by which states are compared."""
FAR = np.array([(first, second) for second in (-1.0, 0.0, 1.0) for first in (-1.0, 0.0, 1.0)])
"""Bends all over, for a body in trouble."""
UNLIKE = np.array([[0, 0], [-1, 0], [1, 0], [-1, 1], [1, -1]], dtype=float)
"""Bends of other states, for a body in trouble."""
_HEXAGON = np.array([(1, 0), (-1, 0), (0.5, 1), (-0.5, -1), (-0.5, 1), (0.5, -1)], dtype=float)
"""Pairs that lie opposite each other, along three axes."""
_STEP = np.array([0.25, 0.5])
"""Distance from the best bends to the hexagon about them (ours); the second bend counts half as
much."""


class Vertex(NamedTuple):
    """Minimum of a parabola."""

    bends: Floats
    """(2,) bends of the minimum."""
    enclosed: bool
    """Whether the best bend lies within the range of the judged ones."""


def hexagon(bends: Floats) -> Floats:
    """(6, 2) bends about ``bends`` (2,)."""
    return np.asarray(np.clip(bends + _STEP * _HEXAGON, -1.0, 1.0))


def vertex(bends: Floats, cost: float, costs: list[float]) -> Vertex:
    """Vertex of the parabola through ``cost`` at ``bends`` (2,) and ``costs`` at its hexagon.

    The vertex is at most a step away, and at ``bends`` if the parabola has no minimum. A hexagon
    that the limit cuts off is used as if it were complete.
    """
    pairs = list(zip(costs[::2], costs[1::2], strict=True))
    slopes = [0.5 * (ahead - back) for ahead, back in pairs]
    curves = [ahead + back - 2.0 * cost for ahead, back in pairs]
    # least squares: three axes give two slopes, and all three curvatures
    slope = (slopes[0] + 0.5 * (slopes[1] - slopes[2])) / 1.5, 0.5 * (slopes[1] + slopes[2])
    xx, xy = curves[0], 0.5 * (curves[1] - curves[2])
    yy = 0.5 * (curves[1] + curves[2]) - 0.25 * xx
    det = xx * yy - xy * xy
    if xx <= 0.0 or det <= 0.0:
        return Vertex(bends, enclosed=False)
    steps = (xy * slope[1] - yy * slope[0]) / det, (xy * slope[0] - xx * slope[1]) / det
    enclosed = max(abs(steps[0]), abs(steps[1])) < 1.0
    bounded = np.clip(np.array(steps), -1.0, 1.0)
    return Vertex(np.clip(bends + _STEP * bounded, -1.0, 1.0), enclosed)
