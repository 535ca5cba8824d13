"""Bodies of a crowd that do not intersect: a body that would enter another one waits.

A body is a chain of capsules along its links, seen from above. In each frame, while two bodies
intersect, the one whose motion makes them meet returns to its former place. Bodies that all return
do not intersect, so a start without intersections keeps this property.
"""

import numpy as np

from snakewalk.config.arrays import Bools, Floats, Ints, Singles
from snakewalk.controller.repertoire.crowd import Crowd
from snakewalk.drivers.compiling import callable_in_loops, compiled

NONE = -1
YIELDING_FRAMES = 6
"""Frames after which a body that waits moves sideways, too (ours)."""
YIELDING_LENGTHS = 0.005
"""Sideways distance of a waiting body in a frame, body lengths (ours)."""
_LINKS = "float32[:, :, ::1]"
_ROW = "float64[::1]"
_RADII = "float64[:, ::1]"


class SeparatedCrowd:
    """Moves the bodies of a crowd, each only where no other body is."""

    def __init__(self, crowd: Crowd, radius_m: Floats, length_m: float) -> None:
        """Separate bodies of a crowd.

        ``radius_m`` (L,) or (N, L) are half the widths of the recorded bodies at their links,
        ``length_m`` is their length. All bodies of the crowd have to be visible: the links of
        others are stale.
        """
        self._crowd = crowd
        self._length_m = length_m
        self._radius_m = radius_m * crowd.scale[:, None]
        self.blocker: Ints = np.full(len(crowd.scale), NONE)
        """(N,) the body that stops each body in this frame; -1: it moved."""
        self.met: Floats = np.zeros(len(crowd.scale))
        """(N,) where along itself each body was last stopped: 0 at the head, 1 at the tail."""
        self.held: Ints = np.zeros(len(crowd.scale), dtype=np.int64)
        """(N,) frames for which each body has waited."""

    def step(self) -> Bools:
        """Go on by a frame; (N,) bodies that moved."""
        crowd = self._crowd
        before = crowd.snapshot()
        crowd.step()
        self.blocker[:] = NONE
        while True:
            stopped = self._bodies_to_return(before[-1])
            if not len(stopped):
                break
            crowd.restore(before, stopped)
        moved: Bools = self.blocker == NONE
        self.held[moved] = 0
        self.held[~moved] += 1
        for body in np.flatnonzero(self.held >= YIELDING_FRAMES).tolist():
            self._yield(body)
        return moved

    def _yield(self, body: int) -> None:
        """Shift a body away from the one that stops it, unless it would meet another one."""
        crowd = self._crowd
        links = self._radius_m.shape[1]
        place = crowd.points_m[body, :2, round(self.met[body] * (links - 1))]
        other = crowd.points_m[self.blocker[body], :2, :links]
        away = place - other[:, np.linalg.norm(other.T - place, axis=1).argmin()]
        away = away.astype(float) / max(np.linalg.norm(away), 1e-9)
        move = YIELDING_LENGTHS * crowd.scale[body] * self._length_m * away
        before = crowd.origin_m[body].copy(), crowd.points_m[body].copy()
        crowd.shift(body, move)
        if not _is_clear(crowd.points_m, self._radius_m, body, len(crowd.scale)):
            crowd.origin_m[body], crowd.points_m[body] = before

    def intersecting(self) -> Ints:
        """Return the bodies that intersect one of a smaller number now."""
        points_m = self._crowd.points_m
        bodies = range(len(points_m))
        return np.flatnonzero([not _is_clear(points_m, self._radius_m, b, b) for b in bodies])

    def _bodies_to_return(self, old_m: Singles) -> Ints:
        """Mark further bodies that have to return to links ``old_m``, and return them."""
        blocker_before = self.blocker.copy()
        points = self._crowd.points_m
        _stop(points, old_m, self._radius_m, blocker_before, self.blocker, self.met)
        return np.flatnonzero(self.blocker != blocker_before)


@callable_in_loops
def _segment_gap(
    ax: float, ay: float, bx: float, by: float, cx: float, cy: float, dx: float, dy: float
) -> float:
    """Distance of the segments ab and cd in the plane, 0 if they cross."""
    ux, uy, vx, vy = bx - ax, by - ay, dx - cx, dy - cy
    side_c = ux * (cy - ay) - uy * (cx - ax)
    two = ux * (dy - ay) - uy * (dx - ax)
    three = vx * (ay - cy) - vy * (ax - cx)
    four = vx * (by - cy) - vy * (bx - cx)
    if side_c * two < 0.0 and three * four < 0.0:
        return 0.0
    least = np.inf
    for k in range(4):
        if k < 2:
            px, py = (cx, cy) if k == 0 else (dx, dy)
            qx, qy, wx, wy = ax, ay, ux, uy
        else:
            px, py = (ax, ay) if k == 2 else (bx, by)
            qx, qy, wx, wy = cx, cy, vx, vy
        size = wx * wx + wy * wy
        share = ((px - qx) * wx + (py - qy) * wy) / size if size > 0.0 else 0.0
        share = min(max(share, 0.0), 1.0)
        least = min(least, np.hypot(px - qx - share * wx, py - qy - share * wy))
    return least


@callable_in_loops
def _meeting(
    one: Singles, radius_one: Floats, other: Singles, radius_other: Floats
) -> tuple[int, int]:
    """Links of two bodies that intersect, nearest to a head first; -1, -1 without such links."""
    links = len(radius_one)
    for k in range(2 * links - 3):  # the sum of both link numbers
        for a in range(max(0, k - links + 2), min(k, links - 2) + 1):
            b = k - a
            gap = _segment_gap(
                one[0, a],
                one[1, a],
                one[0, a + 1],
                one[1, a + 1],
                other[0, b],
                other[1, b],
                other[0, b + 1],
                other[1, b + 1],
            )
            wide = max(radius_one[a], radius_one[a + 1])
            if gap < wide + max(radius_other[b], radius_other[b + 1]):
                return a, b
    return NONE, NONE


@callable_in_loops
def _boxes(points: Singles, radius: Floats) -> Floats:
    """(N, 4) least and largest x and y of each body with its width."""
    links = radius.shape[1]
    box = np.empty((len(points), 4))
    for b in range(len(points)):
        wide = radius[b].max()
        x, y = points[b, 0, :links], points[b, 1, :links]
        box[b, 0], box[b, 1] = x.min() - wide, x.max() + wide
        box[b, 2], box[b, 3] = y.min() - wide, y.max() + wide
    return box


@callable_in_loops
def _boxes_are_apart(box: Floats, i: int, j: int) -> bool:
    across = box[i, 0] > box[j, 1] or box[j, 0] > box[i, 1]
    return bool(across or box[i, 2] > box[j, 3] or box[j, 2] > box[i, 3])


@compiled(
    f"void({_LINKS}, {_LINKS}, {_RADII}, int64[::1], int64[::1], {_ROW})",
    divides_by_zero=True,
)
def _stop(
    points: Singles,
    old: Singles,
    radius: Floats,
    blocker_before: Ints,
    blocker: Ints,
    met: Floats,
) -> None:
    """Write into ``blocker`` the bodies that must return; those of ``blocker_before`` did."""
    box = _boxes(points, radius)
    last = radius.shape[1] - 1.0
    for i in range(len(points)):
        for j in range(i):
            if (blocker_before[i] != NONE and blocker_before[j] != NONE) or _boxes_are_apart(
                box, i, j
            ):
                continue
            at_i, at_j = _meeting(points[i], radius[i], points[j], radius[j])
            if at_i == NONE:
                continue
            if blocker_before[i] != NONE or blocker_before[j] != NONE:
                stops_i = blocker_before[j] != NONE
            else:
                by_i = _meeting(points[i], radius[i], old[j], radius[j])[0] != NONE
                by_j = _meeting(old[i], radius[i], points[j], radius[j])[0] != NONE
                stops_i = by_i if by_i != by_j else at_i <= at_j
            if stops_i:
                blocker[i], met[i] = j, at_i / last
            else:
                blocker[j], met[j] = i, at_j / last


@compiled(f"boolean({_LINKS}, {_RADII}, int64, int64)", divides_by_zero=True)
def _is_clear(points: Singles, radius: Floats, i: int, others: int) -> bool:
    """Whether a body intersects none of the first ``others`` bodies."""
    box = _boxes(points, radius)
    for j in range(others):
        if j == i or _boxes_are_apart(box, i, j):
            continue
        if _meeting(points[i], radius[i], points[j], radius[j])[0] != NONE:
            return False
    return True
