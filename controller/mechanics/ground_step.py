"""The ground step: a skeleton in plan is laid on the ground ([PT] 2.6.5).

From the tail on, each next point lies on the vertical half circle of radius r in direction Theta,
where that meets the surface lifted by half the local body height. Correction: the text meets the
bare ground and lifts the points afterwards, which changes segment lengths on a tapered body; here
the surface is lifted first, so they are exact.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import asin, atan2, cos, hypot, pi, sin
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from snakewalk.config.arrays import Floats
from snakewalk.config.heightfield import HeightField
from snakewalk.config.robot import RobotConfig

Known = Literal["tail", "head"]
Plane = Callable[[float, float], tuple[float, float, float]]
_STEPS = 60
_TOLERANCE = 1e-10  # of a segment length


@dataclass(frozen=True, slots=True)
class Laid:
    """Skeletons on the ground, head first."""

    points_m: Floats
    """(..., N + 1, 3) points in the world; consecutive ones are exactly a segment apart."""
    pitch_rad: Floats
    """(..., N) inclination of each segment, positive where the head side is higher."""
    gap_m: Floats
    """(..., N + 1) height over the lifted surface: 0, except where the body's height changes by
    more than a segment length from point to point and no point of the half circle touches."""

    @property
    def steepest_rad(self) -> float:
        """Largest inclination; the printed method assumes less than 25 degrees."""
        return float(np.abs(self.pitch_rad).max())


def half_heights_m(robot: RobotConfig, segments: int) -> Floats:
    """Half the body's height at the points of a skeleton (segments + 1,): the robot's profile."""
    return np.array(robot.radii_m(segments + 1))


class GroundStep:
    """Lays skeletons on one ground; ``None`` is a level floor at height 0.

    A crossing always exists while neighbouring half heights differ by less than a segment: the
    half circle starts below the lifted surface and ends above it. It is the only one where the
    surface is nowhere steeper than 45 degrees; beyond, the one found from the pitch of the segment
    before is taken. Beyond the field's border its edge goes on level.
    """

    def __init__(self, ground: HeightField | None) -> None:
        self._ground = ground or HeightField(np.zeros((2, 2)), 1.0, 0.0, 0.0)
        self._plane = scalar_plane(self._ground)

    def frames(
        self,
        angles_rad: Floats,
        known_m: ArrayLike,
        segment_m: float,
        half_height_m: ArrayLike,
        known: Known = "tail",
    ) -> Laid:
        """Lay a sequence of skeletons, all frames at once.

        Args:
            angles_rad: (T, N) tangent angles, head first.
            known_m: (T, 2) or (2,) where the tail end (or the head) is in plan.
            segment_m: r.
            half_height_m: (N + 1,) or scalar, half the body's height at each point.
            known: which end ``known_m`` is.

        """
        frames, segments = angles_rad.shape
        half = np.broadcast_to(np.asarray(half_height_m, float), (segments + 1,))
        order, sign = _order(segments, known)
        points = np.empty((frames, segments + 1, 3))
        pitch, gap = np.empty((frames, segments)), np.zeros((frames, segments + 1))
        here = order[0]
        points[:, here, :2] = known_m
        z, *gradient = self._ground.plane(points[:, here, 0], points[:, here, 1])
        points[:, here, 2] = z + half[here]
        for there in order[1:]:
            segment = min(here, there)
            start, angle = points[:, here], angles_rad[:, segment]
            way = sign * segment_m * np.array([np.cos(angle), np.sin(angle)])
            over = gap[:, here] + (half[here] - half[there])
            tilt, gap[:, there], gradient = self._meet(
                start, way, start[:, 2] - half[there], over, gradient
            )
            run = np.cos(tilt)
            points[:, there, 0] = start[:, 0] + way[0] * run
            points[:, there, 1] = start[:, 1] + way[1] * run
            points[:, there, 2] = start[:, 2] + segment_m * np.sin(tilt)
            pitch[:, segment] = sign * tilt
            here = there
        return Laid(points, pitch, gap)

    def one(
        self,
        angles_rad: Floats,
        known_m: ArrayLike,
        segment_m: float,
        half_height_m: ArrayLike,
        known: Known = "tail",
    ) -> Laid:
        """Lay one skeleton (N,): what ``frames`` does, in scalars, for the control loop."""
        segments = len(angles_rad)
        half = np.broadcast_to(np.asarray(half_height_m, float), (segments + 1,)).tolist()
        order, sign = _order(segments, known)
        cosines, sines = np.cos(angles_rad).tolist(), np.sin(angles_rad).tolist()
        x, y = (float(value) for value in np.asarray(known_m, float))
        z, gx, gy = self._plane(x, y)
        z += half[order[0]]
        points, tilts, gaps = [(x, y, z)], [], [0.0]
        here = order[0]
        for there in order[1:]:
            segment = min(here, there)
            dx, dy = sign * segment_m * cosines[segment], sign * segment_m * sines[segment]
            level, over = z - half[there], gaps[-1] + half[here] - half[there]
            tilt, miss, gx, gy = _meet_one(
                self._plane, x, y, level, over, dx, dy, segment_m, gx, gy
            )
            x, y, z = x + dx * cos(tilt), y + dy * cos(tilt), z + segment_m * sin(tilt)
            points.append((x, y, z))
            tilts.append(sign * tilt)
            gaps.append(miss)
            here = there
        step = -1 if known == "tail" else 1
        return Laid(np.array(points)[::step], np.array(tilts)[::step], np.array(gaps)[::step])

    def _meet(
        self, start_m: Floats, way_m: Floats, level_m: Floats, over_m: Floats, slope: list[Floats]
    ) -> tuple[Floats, Floats, list[Floats]]:
        """Tilts (T,) where half circles meet the lifted surface, heights left over, slopes there.

        Newton's method, which is exact within a triangle of the surface and begins on the start's,
        inside a bracket that bisects.

        Args:
            start_m: (T, 3) the centres.
            way_m: (2, T) the radius in plan, in marching direction.
            level_m: (T,) height of the centres less half the body's height at the point to come.
            over_m: (T,) height of the centres over the lifted surface.
            slope: surface gradient at the centres, two of (T,).

        """
        r = np.hypot(way_m[0], way_m[1])
        free = np.abs(over_m) < r
        tilt = _on_plane(over_m, slope[0] * way_m[0] + slope[1] * way_m[1], r)
        tilt = np.where(free, tilt, np.copysign(0.5 * pi, -over_m))
        low, high = np.full_like(r, -0.5 * pi), np.full_like(r, 0.5 * pi)
        for _ in range(_STEPS):
            c, s = np.cos(tilt), np.sin(tilt)
            z, gx, gy = self._ground.plane(
                start_m[:, 0] + way_m[0] * c, start_m[:, 1] + way_m[1] * c
            )
            miss = level_m + r * s - z
            open_ = free & (np.abs(miss) > _TOLERANCE * r)
            if not open_.any():
                break
            low, high = np.where(miss < 0.0, tilt, low), np.where(miss < 0.0, high, tilt)
            rate = r * c + s * (gx * way_m[0] + gy * way_m[1])
            newton = tilt - miss / np.where(rate == 0.0, np.inf, rate)
            inside = (newton > low) & (newton < high)
            tilt = np.where(open_, np.where(inside, newton, 0.5 * (low + high)), tilt)
        return tilt, miss, [gx, gy]


def _on_plane(over_m: Floats, rise_m: Floats, r_m: Floats) -> Floats:
    """Where ``r sin(tilt) + over = rise cos(tilt)``: the crossing with one plane."""
    reach = np.hypot(r_m, rise_m)
    return np.arctan2(rise_m, r_m) - np.arcsin(np.clip(over_m / reach, -1.0, 1.0))


def _order(segments: int, known: Known) -> tuple[range, float]:
    """Points in marching order, and which way that is along the tangent angles."""
    return (range(segments, -1, -1), 1.0) if known == "tail" else (range(segments + 1), -1.0)


def _meet_one(
    plane: Plane,
    x: float,
    y: float,
    level: float,
    over: float,
    dx: float,
    dy: float,
    r: float,
    gx: float,
    gy: float,
) -> tuple[float, float, float, float]:
    """``GroundStep._meet`` in scalars: tilt, height left over, slopes there."""
    low, high = -0.5 * pi, 0.5 * pi
    free = abs(over) < r
    rise = gx * dx + gy * dy
    tilt = atan2(rise, r) - asin(min(max(over / hypot(r, rise), -1.0), 1.0))
    if not free:
        tilt = low if over > 0.0 else high
    miss = 0.0
    for _ in range(_STEPS):
        c, s = cos(tilt), sin(tilt)
        ground, gx, gy = plane(x + dx * c, y + dy * c)
        miss = level + r * s - ground
        if not free or abs(miss) <= _TOLERANCE * r:
            break
        if miss < 0.0:
            low = tilt
        else:
            high = tilt
        rate = r * c + s * (gx * dx + gy * dy)
        newton = tilt - miss / rate if rate else low
        tilt = newton if low < newton < high else 0.5 * (low + high)
    return tilt, miss, gx, gy


def scalar_plane(ground: HeightField) -> Plane:
    """``HeightField.plane`` for one point, some twenty times as fast."""
    rows, columns = ground.z_m.shape
    z: list[list[float]] = ground.z_m.tolist()
    x0, y0, spacing = ground.x0_m, ground.y0_m, ground.spacing_m
    last_u, last_v = columns - 1.0, rows - 1.0

    def plane(x: float, y: float) -> tuple[float, float, float]:
        u = min(max((x - x0) / spacing, 0.0), last_u)
        v = min(max((y - y0) / spacing, 0.0), last_v)
        i, j = min(int(u), columns - 2), min(int(v), rows - 2)
        fu, fv = u - i, v - j
        here, above = z[j], z[j + 1]
        if fu >= fv:
            gx, gy = here[i + 1] - here[i], above[i + 1] - here[i + 1]
        else:
            gx, gy = above[i + 1] - above[i], above[i] - here[i]
        return here[i] + gx * fu + gy * fv, gx / spacing, gy / spacing

    return plane
