"""Equal chords by following the path of the existence proof ([PT] 2.3).

The places ``t_1 < ... < t_N`` and the chord c that satisfy ``abs(P(t_i) - P(t_(i-1))) = c`` form a
path that begins at c = 0. It can end only where ``t_N`` is the end of the curve: an equipartition.
The chord may shrink on the way, where a circle touches the curve. On a polyline the path is smooth
until a place reaches a vertex. There the place goes on to the next piece in the same direction,
as the cofactor that gives its sign does not depend on its own piece (Allgower & Georg 1990, 12).
"""

import numpy as np

from snakewalk.config.arrays import Floats, Ints

_CLOSE = 1e-13
"""Residual of a point on the path, as a share of the length of the curve."""
_NEWTON = 8
_STRAIGHT = 0.9  # cosine between tangents before and after a step, at least
_SMALLEST = 1e-12


class _Path:
    """Equations of the places on a polyline."""

    def __init__(self, curve: Floats, arc: Floats, segments: int) -> None:
        self.curve, self.arc, self.segments = curve, arc, segments
        self.length = float(arc[-1])
        self.slope = np.diff(curve, axis=0) / np.diff(arc)[:, None]
        self.piece: Ints = np.zeros(segments, dtype=np.int64)

    def equations(self, at: Floats) -> tuple[Floats, Floats]:
        """Residuals (N,) in chords and their derivatives (N, N + 1) by the places and the chord."""
        n, k = self.segments, self.piece
        place = self.curve[k] + (at[:n] - self.arc[k])[:, None] * self.slope[k]
        step = np.diff(place, axis=0, prepend=self.curve[:1])
        size = np.maximum(np.hypot(*step.T), 1e-300)
        unit = step / size[:, None]
        slopes = np.zeros((n, n + 1))
        row = np.arange(n)
        slopes[row, row] = (unit * self.slope[k]).sum(axis=1)
        slopes[row[1:], row[:-1]] = -(unit[1:] * self.slope[k[:-1]]).sum(axis=1)
        slopes[:, n] = -1.0
        return size - at[n], slopes

    def tangent(self, at: Floats, border: Floats) -> Floats:
        """Unit vector (N + 1,) along the path, on the side of ``border``."""
        _, slopes = self.equations(at)
        end = np.append(np.zeros(self.segments), 1.0)
        found = np.linalg.solve(np.vstack([slopes, border]), end)
        return np.asarray(found / np.linalg.norm(found))

    def corrected(self, at: Floats, border: Floats, value: float) -> Floats | None:
        """Nearest point of the path with ``border @ at == value``; None if Newton fails."""
        for _ in range(_NEWTON):
            gap, slopes = self.equations(at)
            gap = np.append(gap, border @ at - value)
            if np.abs(gap).max() <= _CLOSE * self.length:
                return at
            try:
                at = at - np.linalg.solve(np.vstack([slopes, border]), gap)
            except np.linalg.LinAlgError:
                return None
        return None

    def next_vertex(self, at: Floats, tangent: Floats) -> tuple[float, int]:
        """Return how far along the tangent a place first reaches a vertex, and which place."""
        rate = tangent[: self.segments]
        vertex = self.arc[self.piece + (rate > 0.0)]
        safe = np.where(np.abs(rate) > 1e-14, rate, 1.0)
        far = np.where(np.abs(rate) > 1e-14, (vertex - at[: self.segments]) / safe, np.inf)
        place = int(np.argmin(far))
        return max(float(far[place]), 0.0), place

    def crossed(self, at: Floats) -> Floats:
        """(N,) how far each place lies outside its piece: below 0, above, or 0 inside."""
        places = at[: self.segments]
        low, high = self.arc[self.piece], self.arc[self.piece + 1]
        return np.asarray(np.minimum(places - low, 0.0) + np.maximum(places - high, 0.0))


def follow_chords(curve: Floats, arc: Floats, segments: int, most_steps: int) -> Floats | None:
    """Return the places (N + 1,) of an equipartition; None if the steps do not suffice.

    Args:
        curve: (M, 2) without repeated points.
        arc: (M,) arc length at them.
        segments: N, 2 or more.
        most_steps: of the path.

    """
    path = _Path(curve, arc, segments)
    at = np.append(np.arange(1.0, segments + 1.0), 1.0) * (0.5 * arc[1] / segments)
    tangent = at / np.linalg.norm(at)
    reach = 0.05 * path.length
    for _ in range(most_steps):
        if reach < _SMALLEST * path.length:
            return None
        share, place = path.next_vertex(at, tangent)
        meets = share <= reach
        border, step = tangent, min(share, reach)
        value = float(tangent @ at) + step
        ahead = bool(tangent[place] > 0.0)
        if meets:
            border = np.zeros(segments + 1)
            border[place] = 1.0
            value = float(arc[path.piece[place] + ahead])
        there = path.corrected(at + step * tangent, border, value)
        if there is None or np.abs(path.crossed(there)).max() > 1e-10 * path.length:
            reach = 0.5 * step
            continue
        if not meets:
            after = path.tangent(there, tangent)
            if float(after @ tangent) < _STRAIGHT:
                reach *= 0.5
                continue
            at, tangent, reach = there, after, 2.0 * reach
            continue
        if place == segments - 1 and ahead and value == arc[-1]:
            return np.concatenate([[0.0], there[:-1]])
        path.piece[place] += 1 if ahead else -1
        if path.piece[place] < 0:
            return None
        at, tangent = there, path.tangent(there, border if ahead else -border)
        reach = max(2.0 * reach, float(np.diff(arc).min()))
    return None
