"""One march along a polyline in steps of equal chords, compiled where numba is installed."""

import numpy as np
from numpy.typing import NDArray

from drivers.compiling import compiled, seen

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@compiled(
    f"int64({seen(dimensions=2, layout='C')}, {seen(layout='C')}, float64,"
    f" {seen('int64', layout='C')}, float64[:, ::1], float64[::1])"
)
def march(
    line: Floats, arc: Floats, chord: float, crossing: Ints, points: Floats, at: Floats
) -> int:
    """Write the points at distance ``chord`` from one another along ``line``.

    Args:
        line: (M, 2) vertices; the last piece should be long enough that no step leaves it.
        arc: (M,) arc length at the vertices.
        chord: length of every step.
        crossing: (N,) which crossing of its circle each step takes, 0 the first.
        points: (N + 1, 2) written.
        at: (N + 1,) arc length of them, written.

    Returns:
        N, or fewer steps where the wanted crossing does not exist.

    """
    px, py, here = line[0, 0], line[0, 1], 0.0
    points[0, 0], points[0, 1], at[0] = px, py, 0.0
    piece = 0
    square = chord * chord
    for step in range(crossing.shape[0]):
        left = crossing[step]
        found = False
        j = piece
        while j + 1 < line.shape[0] and not found:
            ex, ey = line[j + 1, 0] - px, line[j + 1, 1] - py
            if left == 0 and ex * ex + ey * ey < square:
                # for the first crossing the piece so far lies inside the circle; for a later one
                # it may cut the circle twice, which the roots below would tell
                ax, ay = line[j, 0] - px, line[j, 1] - py
                if j == piece or ax * ax + ay * ay < square:
                    j += 1
                    continue
            ax, ay = line[j, 0], line[j, 1]
            low = 0.0
            if j == piece:
                ax, ay = px, py
            dx, dy = line[j + 1, 0] - ax, line[j + 1, 1] - ay
            a = dx * dx + dy * dy
            if a > 0.0:
                b = dx * (ax - px) + dy * (ay - py)
                c = (ax - px) ** 2 + (ay - py) ** 2 - square
                inside = b * b - a * c
                if inside >= 0.0:
                    root = np.sqrt(inside)
                    for side in range(2):
                        t = (-b - root) / a if side == 0 else (-b + root) / a
                        if low < t <= 1.0 and not found:
                            if left > 0:
                                left -= 1
                                continue
                            begin = here if j == piece else arc[j]
                            here = begin + t * np.sqrt(a)
                            px, py = ax + t * dx, ay + t * dy
                            piece = j
                            found = True
            j += 1
        if not found:
            return step
        points[step + 1, 0], points[step + 1, 1], at[step + 1] = px, py, here
    return int(crossing.shape[0])
