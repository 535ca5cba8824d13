"""The ground step: place a skeleton in plan on the ground ([PT] 2.6.5).

From the tail, each next point is the intersection of a vertical half circle of radius r in
direction Theta with the surface raised by half the local body height. Correction: the paper uses
the bare ground and raises the points afterwards, which changes segment lengths on a tapered body.
"""

from dataclasses import dataclass
from math import asin, atan2, cos, hypot, pi, sin
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.ndimage import grey_closing

from snakewalk.config.arrays import Floats
from snakewalk.config.heightfield import HeightField
from snakewalk.config.robot import RobotConfig
from snakewalk.drivers.compiling import compiled, readonly_array

Known = Literal["tail", "head"]
_STEPS = 60
_TOLERANCE = 1e-10  # of a segment length
FIELD = f"{readonly_array(dimensions=2, layout='C')}, float64, float64, float64"


@dataclass(frozen=True, slots=True)
class GroundedSkeleton:
    """Skeletons on the ground, head first."""

    points_m: Floats
    """(..., N + 1, 3) points in the world; consecutive ones are exactly a segment apart."""
    pitch_rad: Floats
    """(..., N) inclination of each segment, positive where the head side is higher."""
    gap_m: Floats
    """(..., N + 1) height over the raised surface: 0, except where the body's height changes by
    more than a segment length from point to point and no point of the half circle touches."""

    @property
    def steepest_rad(self) -> float:
        """Largest inclination; the printed method assumes less than 25 degrees."""
        return float(np.abs(self.pitch_rad).max())


def bridged(ground: HeightField, radius_m: float) -> HeightField:
    """Return the ground that a ball of ``radius_m`` can touch from above.

    Links bridge features narrower than their length: a trench, the corner below a step. (Grey
    closing with a ball; Serra 1982.)
    """
    reach = int(radius_m / ground.spacing_m)
    across = np.arange(-reach, reach + 1) * ground.spacing_m
    square = radius_m**2 - across[:, None] ** 2 - across**2
    ball: Any = np.sqrt(np.maximum(square, 0.0)) - radius_m  # scipy's stubs accept integers only
    z_m = grey_closing(ground.z_m, footprint=square >= 0.0, structure=ball, mode="nearest")
    return HeightField(z_m, ground.spacing_m, ground.x0_m, ground.y0_m)


def half_heights_m(robot: RobotConfig, segments: int) -> Floats:
    """Half the body's height at the points (segments + 1,) of a skeleton."""
    return np.array(robot.radii_m(segments + 1))


class GroundStep:
    """Places skeletons on one ground; ``None`` is a level floor at height 0.

    A crossing exists if neighbouring half heights differ by less than a segment: the half circle
    starts below the raised surface and ends above it. It is unique where the surface is nowhere
    steeper than 45 degrees; elsewhere the search starts from the previous point's plane. The ground
    continues level beyond the field.
    """

    def __init__(self, ground: HeightField | None) -> None:
        field = ground or HeightField(np.zeros((2, 2)), 1.0, 0.0, 0.0)
        self._field = np.ascontiguousarray(field.z_m), field.x0_m, field.y0_m, field.spacing_m

    def place(
        self,
        angles_rad: Floats,
        known_m: ArrayLike,
        segment_m: ArrayLike,
        half_height_m: ArrayLike,
        from_end: Known = "tail",
    ) -> GroundedSkeleton:
        """Place one skeleton, or a sequence of them.

        Args:
            angles_rad: (N,) or (T, N) tangent angles, head first.
            known_m: (2,) or (T, 2) position of the known end in plan.
            segment_m: r, (N,) or scalar; 0 puts two points in one place.
            half_height_m: (N + 1,) or scalar, half the body's height at each point.
            from_end: the end at ``known_m``.

        """
        angles = np.atleast_2d(angles_rad)
        frames, segments = angles.shape
        half = np.broadcast_to(np.asarray(half_height_m, float), (segments + 1,))
        start = np.broadcast_to(np.asarray(known_m, float), (frames, 2))
        each_m = np.broadcast_to(np.asarray(segment_m, float), (segments,))
        points = np.empty((frames, segments + 1, 3))
        pitch = np.empty((frames, segments))
        gap = np.empty((frames, segments + 1))
        _place(
            *self._field,
            np.cos(angles),
            np.sin(angles),
            start,
            each_m,
            half,
            from_end == "tail",
            points,
            pitch,
            gap,
        )
        if np.ndim(angles_rad) == 1:
            return GroundedSkeleton(points[0], pitch[0], gap[0])
        return GroundedSkeleton(points, pitch, gap)

    def lift(self, points_m: Floats, half_height_m: ArrayLike) -> GroundedSkeleton:
        """Keep skeletons (..., N + 1, 2) in the plane, and compute their heights only.

        This is the cheap form of [PT] 2.6.5. A segment of slope ``a`` is longer by ``1 / cos a``.
        """
        z_m, x0_m, y0_m, spacing_m = self._field
        field = HeightField(z_m, spacing_m, x0_m, y0_m)
        height_m = field.elevation_m(points_m[..., 0], points_m[..., 1])
        height_m = height_m + np.asarray(half_height_m, float)
        points = np.concatenate([points_m, height_m[..., None]], axis=-1)
        ahead = -np.diff(points, axis=-2)
        pitch_rad = np.arctan2(ahead[..., 2], np.hypot(ahead[..., 0], ahead[..., 1]))
        return GroundedSkeleton(points, pitch_rad, np.zeros(height_m.shape))


@compiled(f"UniTuple(float64, 3)({FIELD}, float64, float64)", makes_arrays=False)
def plane(
    z: Floats, x0: float, y0: float, spacing: float, x: float, y: float
) -> tuple[float, float, float]:
    """``HeightField.plane`` of one point: elevation and gradient."""
    rows, columns = z.shape
    u = min(max((x - x0) / spacing, 0.0), columns - 1.0)
    v = min(max((y - y0) / spacing, 0.0), rows - 1.0)
    i, j = min(int(u), columns - 2), min(int(v), rows - 2)
    fu, fv = u - i, v - j
    if fu >= fv:
        gx, gy = z[j, i + 1] - z[j, i], z[j + 1, i + 1] - z[j, i + 1]
    else:
        gx, gy = z[j + 1, i + 1] - z[j + 1, i], z[j + 1, i] - z[j, i]
    return z[j, i] + gx * fu + gy * fv, gx / spacing, gy / spacing


@compiled(
    f"void({FIELD}, float64[:, ::1], float64[:, ::1], {readonly_array(dimensions=2)},"
    f" {readonly_array()}, {readonly_array()}, boolean, float64[:, :, ::1], float64[:, ::1],"
    " float64[:, ::1])"
)
def _place(
    z_m: Floats,
    x0: float,
    y0: float,
    spacing: float,
    cosines: Floats,
    sines: Floats,
    known_m: Floats,
    segment_m: Floats,
    half_m: Floats,
    from_tail: bool,
    points: Floats,
    pitch: Floats,
    gap: Floats,
) -> None:
    """Write points (T, N + 1, 3), pitch (T, N) and gap (T, N + 1), from the known end.

    Newton's method finds each tilt; it is exact within a triangle of the surface. A bisected
    bracket guards it. It starts at the crossing with the plane of the previous point.
    """
    frames, segments = cosines.shape
    sign, step = (1.0, -1) if from_tail else (-1.0, 1)
    for t in range(frames):
        anchor = segments if from_tail else 0
        x, y = known_m[t, 0], known_m[t, 1]
        ground, gx, gy = plane(z_m, x0, y0, spacing, x, y)
        z = ground + half_m[anchor]
        points[t, anchor, 0], points[t, anchor, 1], points[t, anchor, 2] = x, y, z
        miss = last = 0.0
        gap[t, anchor] = 0.0
        for _ in range(segments):
            there = anchor + step
            segment = min(anchor, there)
            r = segment_m[segment]
            if r == 0.0:  # two axes at one place
                points[t, there], gap[t, there] = points[t, anchor], gap[t, anchor]
                pitch[t, segment] = sign * last
                anchor = there
                continue
            dx, dy = sign * r * cosines[t, segment], sign * r * sines[t, segment]
            level = z - half_m[there]
            over = miss + half_m[anchor] - half_m[there]
            low, high = -0.5 * pi, 0.5 * pi
            reachable = abs(over) < r
            rise = gx * dx + gy * dy
            tilt = atan2(rise, r) - asin(min(max(over / hypot(r, rise), -1.0), 1.0))
            if not reachable:
                tilt = low if over > 0.0 else high
            for _ in range(_STEPS):
                c, s = cos(tilt), sin(tilt)
                ground, gx, gy = plane(z_m, x0, y0, spacing, x + dx * c, y + dy * c)
                miss = level + r * s - ground
                if not reachable or abs(miss) <= _TOLERANCE * r:
                    break
                if miss < 0.0:
                    low = tilt
                else:
                    high = tilt
                rate = r * c + s * (gx * dx + gy * dy)
                newton = tilt - miss / rate if rate != 0.0 else low
                tilt = newton if low < newton < high else 0.5 * (low + high)
            x, y, z = x + dx * cos(tilt), y + dy * cos(tilt), z + r * sin(tilt)
            points[t, there, 0], points[t, there, 1], points[t, there, 2] = x, y, z
            pitch[t, segment] = sign * tilt
            last = tilt
            gap[t, there] = miss
            anchor = there
