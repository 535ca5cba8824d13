"""Equal chords on curves with sharp turns, from a sample of the branches ([PT] 2.3).

At a given chord each place is a crossing of the curve with the circle around the place before it.
A sharp turn has three crossings where a gentle one has one, so the last place has several branches.
Among many branches some end near B by chance: a small change of the chord
then moves the last place onto B, unless the branch vanishes before. At each step the search keeps
some places that are spread evenly along the curve.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from snakewalk.config.arrays import Floats, Ints
from snakewalk.drivers.compiling import compiled, readonly_array

_LIMITS = ((12.0, 48), (30.0, 192), (90.0, 192), (12.0, 1024))
"""Limit of a place's crossings, in chords along the curve, and number of chords tried."""
_KEPT_PLACES = 400
"""Places of a step that are followed."""
_NEAREST_BRANCHES = 24
"""Branches of a chord whose last places are moved to B."""
_MOST_CROSSINGS = 33
_WIDENINGS = 6
_LINE = f"{readonly_array(dimensions=2, layout='C')}, {readonly_array(layout='C')}"


@dataclass(frozen=True, slots=True)
class BranchBracket:
    """Two chords between which the last place of a branch passes B."""

    low: float
    high: float
    crossing: Ints
    """(N,) index of the crossing at each step."""


def sampled_solutions(
    line: Floats,
    arc: Floats,
    length: float,
    segments: int,
    chords: tuple[float, float],
    residual: Callable[[float, Ints], float],
    root: Callable[[BranchBracket], float | None],
) -> Iterator[tuple[float, Ints]]:
    """Yield chords and crossings of solutions.

    Args:
        line: (M, 2) vertices; the last piece extends the curve beyond B.
        arc: (M,) arc length of the vertices.
        length: arc length of B.
        segments: number of chords.
        chords: the smallest and the largest possible chord.
        residual: signed arc from B to the last place of a chord with these crossings.
        root: as in ``BranchSearch.solutions``.

    """
    least, most = chords
    steps = np.zeros((_NEAREST_BRANCHES, segments), dtype=np.int8)
    excess = np.empty(_NEAREST_BRANCHES)
    for reach, number in _LIMITS:
        # halves, quarters, ...: the chords of most solutions are in the middle
        order = np.argsort([int(f"{k:010b}"[::-1], 2) for k in range(number)], kind="stable")
        for chord in least + (most - least) * (order + 0.5) / number:
            limits = np.array([reach * chord, length])
            place_count = follow_places(line, arc, chord, limits, steps, excess)
            for k in np.argsort(np.abs(excess[:place_count])):
                crossing = steps[k].astype(np.int64)
                bracket = _bracket(chord, float(excess[k]), crossing, segments, residual)
                place = None if bracket is None else root(bracket)
                if place is not None:
                    yield place, crossing


def _bracket(
    chord: float,
    excess: float,
    crossing: Ints,
    segments: int,
    residual: Callable[[float, Ints], float],
) -> BranchBracket | None:
    """Chords between which the last place of a branch passes B; None if it vanishes before."""
    step = -excess / segments
    for _ in range(_WIDENINGS):
        other = residual(chord + step, crossing)
        if np.isnan(other):
            return None
        if other * excess <= 0.0:
            low, high = sorted((chord, chord + step))
            return BranchBracket(low, high, crossing)
        step *= 2.0
    return None


@compiled(f"int64({_LINE}, float64, float64, float64[::1], int64[::1], float64)")
def crossings_ahead(
    line: Floats,
    arc: Floats,
    chord: float,
    end: float,
    along: Floats,
    piece: Ints,
    from_along: float,
) -> int:
    """Write the crossings of the circle around the place ``from_along`` up to ``end``.

    Args:
        line: (M, 2).
        arc: (M,).
        chord: radius of the circle.
        end: arc length after which no piece begins.
        along: (K,) out: arc length of the crossings, increasing.
        piece: (K,) in: the piece of ``from_along``, as the first; out: pieces of the crossings.
        from_along: arc length of the circle's centre.

    Returns:
        their number, which is odd: the last one leads out of the circle.

    """
    first = piece[0]
    share = (from_along - arc[first]) / (arc[first + 1] - arc[first])
    px = line[first, 0] + share * (line[first + 1, 0] - line[first, 0])
    py = line[first, 1] + share * (line[first + 1, 1] - line[first, 1])
    count = 0
    j = first
    while j + 1 < len(line) and count + 1 < len(along) and arc[j] <= end:
        ax, ay, start = (px, py, from_along) if j == first else (line[j, 0], line[j, 1], arc[j])
        dx, dy = line[j + 1, 0] - ax, line[j + 1, 1] - ay
        a = dx * dx + dy * dy
        if a > 0.0:
            b = dx * (ax - px) + dy * (ay - py)
            inside = b * b - a * ((ax - px) ** 2 + (ay - py) ** 2 - chord * chord)
            if inside >= 0.0:
                for root in (-np.sqrt(inside), np.sqrt(inside)):
                    t = (root - b) / a
                    if 0.0 < t <= 1.0:
                        along[count], piece[count] = start + t * np.sqrt(a), j
                        count += 1
        j += 1
    return count - 1 if count > 0 and count % 2 == 0 else count


@compiled(f"int64({_LINE}, float64, float64[::1], int8[:, ::1], float64[::1])")
def follow_places(
    line: Floats, arc: Floats, chord: float, limits: Floats, steps: NDArray[np.int8], excess: Floats
) -> int:
    """Follow evenly spread places of a chord, step by step.

    Args:
        line: (M, 2).
        arc: (M,).
        chord: length of every step.
        limits: (2,) distance of a crossing along the curve, and arc length of B.
        steps: (K, N) out: indices of the crossings of the branches that end nearest to B.
        excess: (K,) out: signed arc from B to their last places.

    Returns:
        Number of those branches.

    """
    count = steps.shape[1]
    along = np.zeros(_KEPT_PLACES)
    piece = np.zeros(_KEPT_PLACES, dtype=np.int64)
    parent = np.zeros((count, _KEPT_PLACES), dtype=np.int64)
    taken = np.zeros((count, _KEPT_PLACES), dtype=np.int8)
    places = _KEPT_PLACES * _MOST_CROSSINGS
    kept = 1
    new_at, new_piece = np.empty(places), np.empty(places, dtype=np.int64)
    new_parent, new_taken = np.empty(places, dtype=np.int64), np.empty(places, dtype=np.int8)
    ahead = np.empty(_MOST_CROSSINGS)
    pieces = np.zeros(_MOST_CROSSINGS, dtype=np.int64)
    for step in range(count):
        number = 0
        for k in range(kept):
            pieces[0] = piece[k]
            crossings = crossings_ahead(
                line, arc, chord, along[k] + limits[0], ahead, pieces, along[k]
            )
            for c in range(crossings):
                if ahead[c] + (count - 1 - step) * chord > limits[1] + 2.0 * chord:
                    continue  # it ends too far beyond B
                new_at[number], new_piece[number] = ahead[c], pieces[c]
                new_parent[number], new_taken[number] = k, c
                number += 1
        if number == 0:
            return 0
        order = np.argsort(new_at[:number])
        kept = min(number, _KEPT_PLACES)
        for k in range(kept):
            selected = order[k * number // kept]
            along[k], piece[k] = new_at[selected], new_piece[selected]
            parent[step, k], taken[step, k] = new_parent[selected], new_taken[selected]
    off = np.abs(along[:kept] - limits[1])
    nearest = np.argsort(off)[: len(excess)]
    for row in range(len(nearest)):
        place = nearest[row]
        excess[row] = along[place] - limits[1]
        for back in range(count):
            step = count - 1 - back
            steps[row, step] = taken[step, place]
            place = parent[step, place]
    return len(nearest)
