"""Equal chords along a curve: ``N`` consecutive points on it, first at A, last at B ([PT] 2.3).

The order of methods: steepest descent on the chord ([PT] Algorithm 1, corrected in the errata);
bisection if it does not settle. Then come chords that end at a later crossing of their circle, a
sample of all crossings together (``chord_beam``), and the path of the existence proof
(``chord_path``). If none finds a solution, the result is an error, never an unequal partition.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from snakewalk.config.arrays import Floats, Ints
from snakewalk.controller.images.chord_beam import BranchBracket, sampled_solutions
from snakewalk.controller.images.chord_path import follow_chords
from snakewalk.drivers.compiling import compiled, readonly_array

TOLERANCE = 1e-9
"""Tolerance of the last point's place, in curve lengths."""
_RATE = 0.95  # of the correction; 1 is Newton's step for a straight curve
_DESCENTS = 12
_BISECTIONS = 80
_SCAN = 96  # number of chords tried between the smallest and the largest possible one
_MOST_STEPS = 40_000  # along the path: one or two seconds for 100 chords
_BENT = 1.05  # arc over chord from which all solutions are searched


class NoEquipartitionError(ValueError):
    """No chord divides this curve equally."""


@dataclass(frozen=True, slots=True)
class Equipartition:
    """Points at equal chords."""

    points: Floats
    """(N + 1, 2), the first and the last one the curve's ends."""
    at: Floats
    """(N + 1,) arc length at the points, increasing."""
    chord: float
    """Distance of neighbouring points, in the curve's unit."""
    method: str
    """Method of the solution: ``descent``, ``bisection``, ``bisector`` (2 chords), ``later
    crossing``, ``sample`` (``chord_beam``), ``path`` (``chord_path``)."""
    solutions: int
    """Solutions found, of which this is the closest to the curve; 1 where no other was searched, as
    no chord leaves its arc by more than 5 %."""
    distance: float
    """Mean distance of the curve from the chords."""


class _Curve:
    """The curve, extended straight beyond B, so that overshoot has a sign."""

    def __init__(self, curve: Floats, segments: int) -> None:
        step = np.hypot(*np.diff(curve, axis=0).T)
        kept = curve[np.concatenate([[True], step > 0.0])]
        step = step[step > 0.0]
        self.arc = np.concatenate([[0.0], np.cumsum(step)])
        self.length = float(self.arc[-1])
        far = 3.0 * self.length
        end = kept[-1] + (kept[-1] - kept[-2]) * (far / step[-1])
        self.curve = kept
        self.line = np.ascontiguousarray(np.vstack([kept, end]))
        self.line_arc = np.append(self.arc, self.length + far)
        self.segments = segments
        self.first: Ints = np.zeros(segments, dtype=np.int64)
        self.points = np.empty((segments + 1, 2))
        self.at = np.empty(segments + 1)
        # N chords are at most as long as the curve, and at least the distance from A to B
        self.least = float(np.hypot(*(kept[-1] - kept[0]))) / segments
        self.most = self.length / segments

    def residual(self, chord: float, crossing: Ints | None = None) -> float:
        """Signed arc from B to the last point; NaN if that point does not exist."""
        taken = self.first if crossing is None else crossing
        done = march(self.line, self.line_arc, chord, taken, self.points, self.at)
        return float(self.at[-1]) - self.length if done == self.segments else float("nan")

    def solution(self, chord: float, method: str, crossing: Ints | None = None) -> Equipartition:
        self.residual(chord, crossing)
        points = self.points.copy()
        along = self.at.copy()
        points[-1], along[-1] = self.curve[-1], self.length
        return Equipartition(points, along, chord, method, 1, self.distance(points, along))

    def distance(self, points: Floats, along: Floats) -> float:
        of = np.clip(np.searchsorted(along, self.arc, side="right") - 1, 0, self.segments - 1)
        chord = points[of + 1] - points[of]
        away = self.curve - points[of]
        share = (away * chord).sum(axis=1) / np.maximum((chord * chord).sum(axis=1), 1e-300)
        gap = np.hypot(*(away - np.clip(share, 0.0, 1.0)[:, None] * chord).T)
        return float(np.trapezoid(gap, self.arc)) / self.length


def equipartition(curve: Floats, segments: int = 100) -> Equipartition:
    """Divide ``curve`` (M, 2), M 2 or more, into ``segments`` equal chords.

    If an arc exceeds its chord by more than 5 %, all solutions by first crossings are searched; for
    8 segments or fewer, also by later crossings. The result is the solution closest to the curve.

    Raises:
        ValueError: wrong shape, not finite, no length, or no segments.
        NoEquipartitionError: no solution found.

    """
    if curve.ndim != 2 or curve.shape[1] != 2 or len(curve) < 2 or not np.isfinite(curve).all():
        raise ValueError(f"a curve is (2 or more, 2) finite points, not {curve.shape}")
    if segments < 1:
        raise ValueError(f"1 segment or more, not {segments}")
    if not np.ptp(curve, axis=0).any():
        raise ValueError("the curve has no length")
    given = _Curve(np.asarray(curve, dtype=float), segments)
    if segments == 1:
        if given.least <= TOLERANCE * given.length:
            raise NoEquipartitionError("one chord cannot span a closed curve")
        ends = given.curve[[0, -1]]
        ends_along = np.array([0.0, given.length])
        return Equipartition(
            ends, ends_along, given.least, "descent", 1, given.distance(ends, ends_along)
        )
    if segments == 2:
        return _halves(given)
    descent = _descend(given)
    if descent is not None and _fits(descent):
        return descent
    return _closest(given, descent)


def _fits(solution: Equipartition) -> bool:
    return float(np.diff(solution.at).max()) <= _BENT * solution.chord


def _halves(given: _Curve) -> Equipartition:
    """Two chords meet where the curve crosses the perpendicular bisector of AB."""
    curve = given.curve
    arc = given.arc
    side = ((curve - curve[0]) ** 2 - (curve - curve[-1]) ** 2).sum(axis=1)
    if given.least <= TOLERANCE * given.length:
        side = arc - 0.5 * given.length  # A is B: every point is valid, use the middle
    solutions = []
    for k in np.flatnonzero((side[:-1] < 0.0) != (side[1:] < 0.0)):
        part = side[k] / (side[k] - side[k + 1])
        points = np.stack([curve[0], curve[k] + part * (curve[k + 1] - curve[k]), curve[-1]])
        along = np.array([0.0, arc[k] + part * (arc[k + 1] - arc[k]), given.length])
        chord = float(np.hypot(*(points[1] - points[0])))
        solutions.append(
            Equipartition(points, along, chord, "bisector", 1, given.distance(points, along))
        )
    best = min(solutions, key=lambda solution: solution.distance)
    return replace(best, solutions=len(solutions))


def _descend(given: _Curve) -> Equipartition | None:
    """[PT] Algorithm 1: correct the chord by the mean arc error; bisect if it cycles."""
    tolerance = TOLERANCE * given.length
    low = 0.0
    high = np.inf
    chord = given.most
    for _ in range(_DESCENTS):
        error = given.residual(chord)
        if abs(error) <= tolerance:
            return given.solution(chord, "descent")
        low, high = (chord, high) if error < 0.0 else (low, chord)
        chord -= _RATE * error / given.segments
        if not low < chord < high:
            break
    if low == 0.0:
        low = max(given.least * (1.0 - 1e-12), 1e-6 * given.most)
    if not np.isfinite(high):
        high = given.most
    root = _bisect(given, low, high)
    return None if root is None else given.solution(root, "bisection")


def _bisect(given: _Curve, low: float, high: float, crossing: Ints | None = None) -> float | None:
    """Return the root between two chords; None where the residual jumps across zero."""
    tolerance = TOLERANCE * given.length
    rising = given.residual(low, crossing) < 0.0
    for _ in range(_BISECTIONS):
        chord = 0.5 * (low + high)
        error = given.residual(chord, crossing)
        if abs(error) <= tolerance:
            return chord
        if np.isnan(error) or chord in {low, high}:
            return None
        low, high = (chord, high) if (error < 0.0) == rising else (low, chord)
    return None


def _closest(given: _Curve, earlier: Equipartition | None) -> Equipartition:
    solutions = [] if earlier is None else [earlier]
    for method, crossing in _crossings(given.segments, search=earlier is None):
        for chord in _roots(given, crossing):
            if all(abs(chord - other.chord) > 1e-7 * given.most for other in solutions):
                solutions.append(given.solution(chord, method, crossing))
        if method == "later crossing" and solutions and given.segments > 8:
            break
    if not solutions:
        solutions = _by_sample(given)
    if not solutions:
        places = follow_chords(given.curve, given.arc, given.segments, _path_steps(given))
        if places is not None:
            solutions.append(_at_places(given, places))
    if not solutions:
        raise NoEquipartitionError(
            f"no {given.segments} equal chords on this curve of {len(given.curve)} points"
        )
    best = min(solutions, key=lambda solution: solution.distance)
    return Equipartition(
        best.points, best.at, best.chord, best.method, len(solutions), best.distance
    )


def _by_sample(given: _Curve) -> list[Equipartition]:
    """Return a solution among sampled branches, where there are too many to visit."""

    def root(bracket: BranchBracket) -> float | None:
        return _bisect(given, bracket.low, bracket.high, bracket.crossing)

    chords = max(given.least * (1.0 - 1e-12), 1e-6 * given.most), given.most
    for chord, crossing in sampled_solutions(
        given.line, given.line_arc, given.length, given.segments, chords, given.residual, root
    ):
        return [given.solution(chord, "sample", crossing)]
    return []


def _path_steps(given: _Curve) -> int:
    """Limit of steps along the path: each place passes each vertex a few times."""
    return min(8 * given.segments * len(given.curve) + 1000, _MOST_STEPS)


def _at_places(given: _Curve, places: Floats) -> Equipartition:
    points = np.stack([np.interp(places, given.arc, column) for column in given.curve.T], axis=-1)
    chord = float(np.hypot(*(points[1] - points[0])))
    return Equipartition(points, places, chord, "path", 1, given.distance(points, places))


def _crossings(segments: int, *, search: bool) -> Iterator[tuple[str, Ints]]:
    """Yield first crossings, then a later one at any step, then (few segments) at two steps."""
    crossing: Ints = np.zeros(segments, dtype=np.int64)
    yield "bisection", crossing
    if segments > 8 and not search:
        return
    most = 5 if segments == 3 else 2
    for steps in range(1, 3 if segments <= 8 else 2):
        for places in combinations(range(segments), steps):
            for number in np.ndindex(*(most,) * steps):
                later = crossing.copy()
                later[list(places)] = np.array(number) + 1
                yield "later crossing", later


def _roots(given: _Curve, crossing: Ints) -> Iterator[float]:
    tried = np.linspace(max(given.least, 1e-6 * given.most), given.most, _SCAN)
    errors = np.array([given.residual(chord, crossing) for chord in tried])
    for k in np.flatnonzero(np.abs(errors) <= TOLERANCE * given.length):
        yield float(tried[k])
    for k in np.flatnonzero(errors[:-1] * errors[1:] < 0.0):
        root = _bisect(given, float(tried[k]), float(tried[k + 1]), crossing)
        if root is not None:
            yield root


@compiled(
    f"int64({readonly_array(dimensions=2, layout='C')}, {readonly_array(layout='C')}, float64,"
    f" {readonly_array('int64', layout='C')}, float64[:, ::1], float64[::1])"
)
def march(  # noqa: C901  a compiled loop
    line: Floats, arc: Floats, chord: float, crossing: Ints, points: Floats, along: Floats
) -> int:
    """Write the points at distance ``chord`` from one another along ``line``.

    Args:
        line: (M, 2) vertices; the last piece must be long enough that no step leaves it.
        arc: (M,) arc length at the vertices.
        chord: length of every step.
        crossing: (N,) index of the circle's crossing that each step uses, 0 the first.
        points: (N + 1, 2) out.
        along: (N + 1,) out: their arc length.

    Returns:
        N, or fewer steps if a crossing does not exist.

    """
    px = line[0, 0]
    py = line[0, 1]
    along_here = 0.0
    points[0, 0], points[0, 1], along[0] = px, py, 0.0
    piece = 0
    square = chord * chord
    for step in range(crossing.shape[0]):
        left = crossing[step]
        is_crossing = False
        j = piece
        while j + 1 < line.shape[0] and not is_crossing:
            ex, ey = line[j + 1, 0] - px, line[j + 1, 1] - py
            if left == 0 and ex * ex + ey * ey < square:
                # before the first crossing the piece lies inside the circle; a piece of a later
                # crossing may cut the circle twice
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
                        if low < t <= 1.0 and not is_crossing:
                            if left > 0:
                                left -= 1
                                continue
                            begin = along_here if j == piece else arc[j]
                            along_here = begin + t * np.sqrt(a)
                            px, py = ax + t * dx, ay + t * dy
                            piece = j
                            is_crossing = True
            j += 1
        if not is_crossing:
            return step
        points[step + 1, 0], points[step + 1, 1], along[step + 1] = px, py, along_here
    return int(crossing.shape[0])
