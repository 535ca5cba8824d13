"""Equal chords by following the path of the existence proof ([PT] 2.3).

The places ``t_1 < ... < t_N`` and the chord c with ``abs(P(t_i) - P(t_(i-1))) = c`` form a path
that starts at c = 0. It can end only where ``t_N`` is the end of the curve: an equipartition. The
chord may shrink on the path, where a circle touches the curve. On a polyline the path is smooth
until a place reaches a vertex. There the place continues to the next piece in the same direction,
because the cofactor that gives its sign does not depend on its own piece (Allgower & Georg 1990,
12).

Equation i contains only the places i - 1 and i and the chord. The direction of the path and
Newton's step are therefore built by plane rotations, one equation at a time, without a matrix.
"""

import numpy as np

from snakewalk.config.arrays import Floats, Ints
from snakewalk.drivers.compiling import compiled, readonly_array

_PATH_TOLERANCE = 1e-13
"""Residual of a point on the path, as a share of the length of the curve."""
_NEWTON = 8
_STRAIGHT_LEAD = 0.9  # smallest cosine between tangents before and after a step
_SMALLEST_STEP = 1e-12
_CURVE = f"{readonly_array(dimensions=2, layout='C')}, {readonly_array(layout='C')}"


def follow_chords(curve: Floats, arc: Floats, segments: int, most_steps: int) -> Floats | None:
    """Return the places (N + 1,) of an equipartition; None if ``most_steps`` do not suffice.

    Args:
        curve: (M, 2) without repeated points.
        arc: (M,) arc length of the points.
        segments: N, 2 or more.
        most_steps: limit of steps along the path.

    """
    along = np.append(np.arange(1.0, segments + 1.0), 1.0) * (0.5 * arc[1] / segments)
    curve = np.ascontiguousarray(curve)
    arc = np.ascontiguousarray(arc)
    piece: Ints = np.zeros(segments, dtype=np.int64)
    if not follow(curve, arc, along, piece, most_steps):
        return None
    return np.concatenate([[0.0], along[:-1]])


@compiled(f"void({_CURVE}, float64[::1], int64[::1], float64[::1], float64[:, ::1])")
def equations(
    curve: Floats, arc: Floats, along: Floats, piece: Ints, gap: Floats, slopes: Floats
) -> None:
    """Write the residuals of the equations, and their slopes.

    Args:
        curve: (M, 2).
        arc: (M,).
        along: (N + 1,) the places and the chord.
        piece: (N,) index of the piece of each place.
        gap: (N,) out: excess of each chord's length.
        slopes: (N, 2) out: slopes by the previous place and by its own.

    """
    count = len(piece)
    px, py, tx, ty = curve[0, 0], curve[0, 1], 0.0, 0.0
    for i in range(count):
        k = piece[i]
        long = arc[k + 1] - arc[k]
        ux, uy = (curve[k + 1, 0] - curve[k, 0]) / long, (curve[k + 1, 1] - curve[k, 1]) / long
        x = curve[k, 0] + (along[i] - arc[k]) * ux
        y = curve[k, 1] + (along[i] - arc[k]) * uy
        size = max(np.hypot(x - px, y - py), 1e-300)
        ex, ey = (x - px) / size, (y - py) / size
        gap[i] = size - along[count]
        slopes[i, 0], slopes[i, 1] = -(ex * tx + ey * ty), ex * ux + ey * uy
        px, py, tx, ty = x, y, ux, uy


@compiled(
    f"void({readonly_array(layout='C')}, {readonly_array(dimensions=2, layout='C')}, float64[::1],"
    " float64[::1])"
)
def solve(gap: Floats, slopes: Floats, step: Floats, along: Floats) -> None:
    """Write a step (N + 1,) that closes the gaps, and the unit vector along the path.

    The first equations leave one free direction. The next equation rotates it in the plane of
    itself and the next place.
    """
    count = len(gap)
    grow = np.empty(count)
    turn = np.empty((count, 2))  # shares of the direction: of the new place, and the remainder
    before = 0.0
    old = 0.0
    chord = 0.0
    free = 1.0  # entries of the last place and of the chord
    for i in range(count):
        a, s = slopes[i, 0] * before - free, slopes[i, 1]
        size = max(np.hypot(a, s), 1e-300)
        a, s = a / size, s / size
        grow[i] = (-gap[i] - slopes[i, 0] * old + chord) / size
        chord += grow[i] * a * free
        free *= s
        before = -a
        old = grow[i] * s
        turn[i, 0], turn[i, 1] = a, s
    later = 0.0
    remains = 1.0  # sum of later growths, product of later shares
    for i in range(count - 1, -1, -1):
        a, s = turn[i]
        step[i] = grow[i] * s - a * later
        along[i] = -a * remains
        later = grow[i] * a + s * later
        remains *= s
    step[count], along[count] = chord, free


@compiled(f"boolean({_CURVE}, float64[::1], int64[::1], int64)")
def follow(curve: Floats, arc: Floats, places: Floats, piece: Ints, most_steps: int) -> bool:  # noqa: C901  a compiled loop
    """Move ``places`` (N + 1,) along the path until the last place is the end of the curve."""
    count = len(piece)
    length = arc[-1]
    gap = np.empty(count)
    slopes = np.empty((count, 2))
    step = np.empty(count + 1)
    along = np.empty(count + 1)
    tangent = places / np.sqrt((places * places).sum())
    there = np.empty(count + 1)
    least = np.diff(arc).min()
    reach = 0.05 * length
    for _ in range(most_steps):
        if reach < _SMALLEST_STEP * length:
            return False
        share = np.inf
        place = 0
        for i in range(count):  # distance along the tangent at which a place first reaches a vertex
            if abs(tangent[i]) > 1e-14:
                far = (arc[piece[i] + (1 if tangent[i] > 0.0 else 0)] - places[i]) / tangent[i]
                if far < share:
                    share = far
                    place = i
        share = max(share, 0.0)
        meets = share <= reach
        size = min(share, reach)
        ahead = tangent[place] > 0.0
        vertex = arc[piece[place] + (1 if ahead else 0)]
        value = vertex if meets else (tangent * places).sum() + size
        there[:] = places + size * tangent
        close = False
        for _newton in range(_NEWTON):
            equations(curve, arc, there, piece, gap, slopes)
            off = value - (there[place] if meets else (tangent * there).sum())
            if max(np.abs(gap).max(), abs(off)) <= _PATH_TOLERANCE * length:
                close = True
                break
            solve(gap, slopes, step, along)
            lead = along[place] if meets else (tangent * along).sum()
            if abs(lead) < 1e-300:
                break
            rest = off - (step[place] if meets else (tangent * step).sum())
            there += step + rest / lead * along
        for i in range(count):
            inside = arc[piece[i]] - 1e-10 * length <= there[i]
            close = close and inside and there[i] <= arc[piece[i] + 1] + 1e-10 * length
        if not close:
            reach = 0.5 * size
            continue
        if meets and place == count - 1 and ahead and vertex == length:
            places[:] = there
            return True
        if meets:
            piece[place] += 1 if ahead else -1
            if piece[place] < 0:
                return False
            equations(curve, arc, there, piece, gap, slopes)
        solve(gap, slopes, step, along)
        lead = (along[place] if ahead else -along[place]) if meets else (tangent * along).sum()
        if lead < 0.0:
            along *= -1.0
        if not meets and abs(lead) < _STRAIGHT_LEAD:
            reach *= 0.5
            continue
        places[:], tangent[:] = there, along
        reach = max(2.0 * reach, least) if meets else 2.0 * reach
    return False
