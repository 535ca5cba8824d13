"""Equal chords by counting the branches of all crossings ([PT] 2.3).

At a given chord each place is a crossing of the curve with the circle around the place before it.
A sharp turn has three crossings where a gentle one has one, so the last place has several branches.
Two branches appear or vanish together, with opposite signs. The sum of the signs of the branches
that pass B therefore changes only at a chord at which one of them ends at B: an equipartition. The
sum is 0 for a short chord and 1 for the longest, so bisection on the sum finds such a chord.

The crossings are counted up to a limit along the curve. A place where the curve comes near itself
later is beyond it. There the sum may change without a solution, so all changes are tried.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from snakewalk.config.arrays import Floats, Ints
from snakewalk.drivers.compiling import compiled, readonly_array

_LIMITS = ((12.0, 64), (3.0, 64), (6.0, 128), (30.0, 256))
"""Limit of a place's crossings, in chords along the curve, and number of chords tried."""
_MOST_PLACES = 200_000  # of all branches of a chord: about 20 ms of CPU time
_MOST_BRANCHES = 2000
_MOST_CROSSINGS = 33
_MOST_ABANDONED_BRANCHES = 6  # chords with more branches than the limits permit
_BISECTIONS = 45


@dataclass(frozen=True, slots=True)
class ChordBranches:
    """All branches of one chord."""

    chord: float
    sign_sum: int
    """Sum of the signs of the branches that pass B."""
    excess: dict[bytes, float]
    """Signed arc from B to the last place, by the indices of its crossings."""
    is_complete: bool


@dataclass(frozen=True, slots=True)
class BranchBracket:
    """Two chords between which the last place of a branch passes B."""

    low: float
    high: float
    crossing: Ints
    """(N,) index of the crossing at each step."""


@dataclass(frozen=True, slots=True)
class BranchSearch:
    """Search for chords at which a branch ends at B."""

    line: Floats
    """(M, 2) vertices; the last piece extends the curve beyond B."""
    arc: Floats
    """(M,) arc length of the vertices."""
    length: float
    """Arc length of B."""
    segments: int

    def solutions(
        self, least: float, most: float, root: Callable[[BranchBracket], float | None]
    ) -> Iterator[tuple[float, Ints]]:
        """Yield chords and crossings of solutions, those of longer chords first.

        Args:
            least: smallest chord.
            most: largest chord.
            root: returns the chord at which a branch ends at B; None where the branch jumps,
                because it vanishes between the two chords and appears again.

        """
        for reach, number in _LIMITS:
            abandoned = 0
            tried = np.linspace(most, least, number)
            high = self.branches(float(tried[0]), reach)
            for chord in tried[1:]:
                low = self.branches(float(chord), reach)
                abandoned += not low.is_complete
                if abandoned > _MOST_ABANDONED_BRANCHES:
                    break
                yield from self._branches_between(low, high, reach, root)
                high = low

    def branches(self, chord: float, reach: float) -> ChordBranches:
        """Return all branches whose crossings are at most ``reach`` chords along the curve."""
        steps = np.zeros((_MOST_BRANCHES, self.segments), dtype=np.int8)
        excess = np.empty(_MOST_BRANCHES)
        limits = np.array([reach * chord, self.length])
        sign_sum, count, places = count_branches(self.line, self.arc, chord, limits, steps, excess)
        kept = range(min(count, _MOST_BRANCHES))
        by_steps = {steps[k].tobytes(): float(excess[k]) for k in kept}
        return ChordBranches(chord, sign_sum, by_steps, places <= _MOST_PLACES)

    def _branches_between(
        self,
        low: ChordBranches,
        high: ChordBranches,
        reach: float,
        root: Callable[[BranchBracket], float | None],
    ) -> list[tuple[float, Ints]]:
        """Bisect where the sum changes, until a branch ends at B between the two chords."""
        for _ in range(_BISECTIONS):
            brackets = _passing(low, high)
            chords = [root(bracket) for bracket in brackets]
            roots = [
                (chord, bracket.crossing)
                for chord, bracket in zip(chords, brackets, strict=True)
                if chord is not None
            ]
            is_complete = low.is_complete and high.is_complete
            if roots or low.sign_sum == high.sign_sum or not is_complete:
                return roots
            middle = self.branches(0.5 * (low.chord + high.chord), reach)
            low, high = (low, middle) if middle.sign_sum != low.sign_sum else (middle, high)
        return []


def _passing(low: ChordBranches, high: ChordBranches) -> list[BranchBracket]:
    return [
        BranchBracket(low.chord, high.chord, np.frombuffer(steps, np.int8).astype(np.int64))
        for steps, excess in low.excess.items()
        if steps in high.excess and excess * high.excess[steps] <= 0.0
    ]


_LINE = f"{readonly_array(dimensions=2, layout='C')}, {readonly_array(layout='C')}"


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


@compiled(f"UniTuple(int64, 3)({_LINE}, float64, float64[::1], int8[:, ::1], float64[::1])")
def count_branches(
    line: Floats, arc: Floats, chord: float, limits: Floats, steps: NDArray[np.int8], excess: Floats
) -> tuple[int, int, int]:
    """Visit all branches of a chord, depth first.

    A branch that passes B goes straight on there, so it is not followed further.

    Args:
        line: (M, 2).
        arc: (M,).
        chord: length of every step.
        limits: (2,) distance of a crossing along the curve, and arc length of B.
        steps: (K, N) out: indices of the crossings of the first K branches.
        excess: (K,) out: signed arc from B to their last places.

    Returns:
        Sum of the signs of the branches that pass B, number of branches, and number of places.

    """
    count = steps.shape[1]
    along = np.empty((count, _MOST_CROSSINGS))
    piece = np.zeros((count, _MOST_CROSSINGS), dtype=np.int64)
    number = np.zeros(count, dtype=np.int64)
    turn = np.zeros(count, dtype=np.int64)
    sign_sum = 0
    branches = 0
    places = 1
    level = 0
    number[0] = crossings_ahead(line, arc, chord, limits[0], along[0], piece[0], 0.0)
    while level >= 0 and places <= _MOST_PLACES:
        k = turn[level]
        if k >= number[level]:
            level -= 1
            if level >= 0:
                turn[level] += 1
            continue
        along_here = along[level, k]
        if level < count - 1 and along_here <= limits[1]:
            level += 1
            places += 1
            turn[level], piece[level, 0] = 0, piece[level - 1, k]
            number[level] = crossings_ahead(
                line, arc, chord, along_here + limits[0], along[level], piece[level], along_here
            )
            continue
        rest = along_here + (count - 1 - level) * chord - limits[1]
        if rest > 0.0:
            sign_sum += 1 if np.sum(turn[: level + 1]) % 2 == 0 else -1
        if branches < len(excess):
            steps[branches, : level + 1] = turn[: level + 1]
            excess[branches] = rest
        branches += 1
        turn[level] += 1
    return sign_sum, branches, places
