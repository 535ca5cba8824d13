"""Tangent planes of a height field for the balls of a belly, updated in every step.

MuJoCo lets a ball meet each prism of a height field separately. It then also meets inner edges of a
level floor, with normals up to 10 degrees off, which throws a body about. Here every ball has two
planes through the surface points nearest to its centre: one on a slope or an edge, two in a crease.
The surface is that of ``HeightField``, two triangles per cell.
"""

import math
from dataclasses import dataclass

import mujoco
import numpy as np

from snakewalk.config.arrays import Floats, Int32s
from snakewalk.config.heightfield import HeightField
from snakewalk.drivers.compiling import compiled, readonly_array

PLANES = 2
"""Planes of a ball, which may lie in a crease; of a corner's three faces the deepest two count."""
AWAY_M = -1e3
"""Height of a plane that its ball does not touch."""
_SAME_CONTACT = 0.05
"""Points nearer to each other than this share of the radius are one contact."""
_PROBE = 1e-3
"""Share of a cell's width: distance from a point at which the surface is probed for nearer ones."""
_NEARER_TANGENT = 0.01
"""Least tangent of an angle at which a nearby point counts as nearer."""
_RING = 8


_FIELD = f"{readonly_array(dimensions=2, layout='C')}, UniTuple(float64, 3)"
_POINT = "float64, float64, float64"


@compiled(f"UniTuple(float64, 3)(float64, float64, {_FIELD})")
def _face(
    x: float, y: float, z_m: Floats, corner_m: tuple[float, float, float]
) -> tuple[float, float, float]:
    """Elevation and slopes along x and y of the triangle at a point, clamped to the border."""
    x0, y0, spacing = corner_m
    rows, columns = z_m.shape
    u = min(max((x - x0) / spacing, 0.0), columns - 1.0)
    v = min(max((y - y0) / spacing, 0.0), rows - 1.0)
    i, j = min(int(u), columns - 2), min(int(v), rows - 2)
    fu, fv = u - i, v - j
    z00, z11 = z_m[j, i], z_m[j + 1, i + 1]
    if fu >= fv:
        gx, gy = z_m[j, i + 1] - z00, z11 - z_m[j, i + 1]
    else:
        gx, gy = z11 - z_m[j + 1, i], z_m[j + 1, i] - z00
    return z00 + gx * fu + gy * fv, gx / spacing, gy / spacing


@compiled(f"boolean({_POINT}, float64[:, ::1])")
def _is_above_triangle(x: float, y: float, z: float, corners: Floats) -> bool:
    """Whether a point is on the upper side of a triangle's plane."""
    b0, b1, b2 = (
        corners[1, 0] - corners[0, 0],
        corners[1, 1] - corners[0, 1],
        corners[1, 2] - corners[0, 2],
    )
    c0, c1, c2 = (
        corners[2, 0] - corners[0, 0],
        corners[2, 1] - corners[0, 1],
        corners[2, 2] - corners[0, 2],
    )
    n0, n1, n2 = b1 * c2 - b2 * c1, b2 * c0 - b0 * c2, b0 * c1 - b1 * c0
    height = n0 * (x - corners[0, 0]) + n1 * (y - corners[0, 1]) + n2 * (z - corners[0, 2])
    return bool(height * n2 > 0.0)


@compiled(f"boolean({_POINT}, float64[:, ::1], float64[::1])")
def _nearest_point(x: float, y: float, z: float, corners: Floats, nearest: Floats) -> bool:
    a0, a1, a2 = corners[0, 0], corners[0, 1], corners[0, 2]
    b0, b1, b2 = corners[1, 0] - a0, corners[1, 1] - a1, corners[1, 2] - a2
    c0, c1, c2 = corners[2, 0] - a0, corners[2, 1] - a1, corners[2, 2] - a2
    p0, p1, p2 = x - a0, y - a1, z - a2
    bb, cc, bc = (
        b0 * b0 + b1 * b1 + b2 * b2,
        c0 * c0 + c1 * c1 + c2 * c2,
        b0 * c0 + b1 * c1 + b2 * c2,
    )
    pb, pc = p0 * b0 + p1 * b1 + p2 * b2, p0 * c0 + p1 * c1 + p2 * c2
    area = bb * cc - bc * bc
    s, t = (pb * cc - pc * bc) / area, (pc * bb - pb * bc) / area
    inside = s > 0.0 and t > 0.0 and s + t < 1.0
    if not inside:  # the nearest point of the three edges
        least = np.inf
        for edge in range(3):
            if edge == 0:
                es, et = min(max(pb / bb, 0.0), 1.0), 0.0
            elif edge == 1:
                es, et = 0.0, min(max(pc / cc, 0.0), 1.0)
            else:
                et = (pc - bc - pb + bb) / (bb + cc - 2.0 * bc)
                et = min(max(et, 0.0), 1.0)
                es = 1.0 - et
            q0, q1, q2 = (
                p0 - es * b0 - et * c0,
                p1 - es * b1 - et * c1,
                p2 - es * b2 - et * c2,
            )
            square = q0 * q0 + q1 * q1 + q2 * q2
            if square < least:
                least = square
                s = es
                t = et
    nearest[0], nearest[1], nearest[2] = (
        a0 + s * b0 + t * c0,
        a1 + s * b1 + t * c1,
        a2 + s * b2 + t * c2,
    )
    return bool(inside)


@compiled(f"boolean({_POINT}, float64[::1], float64, {_FIELD})")
def _is_nearest_contact(
    x: float,
    y: float,
    z: float,
    point: Floats,
    distance: float,
    z_m: Floats,
    corner_m: tuple[float, float, float],
) -> bool:
    reach = _PROBE * corner_m[2]
    for k in range(_RING):
        angle = 2.0 * math.pi * k / _RING  # the edges of the triangles are among these
        px, py = point[0] + reach * math.cos(angle), point[1] + reach * math.sin(angle)
        pz, _, _ = _face(px, py, z_m, corner_m)
        step = math.sqrt(reach * reach + (pz - point[2]) ** 2)
        away = math.sqrt((x - px) ** 2 + (y - py) ** 2 + (z - pz) ** 2)
        if away < distance - _NEARER_TANGENT * step:
            return False
    return True


@compiled(f"void(float64[::1], {_POINT}[:, ::1])")
def _keep_plane(point: Floats, distance: float, same_m: float, planes: Floats) -> None:
    slot = 0
    for k in range(PLANES):
        distance_m2 = 0.0
        if planes[k, 3] < np.inf:
            for axis in range(3):
                distance_m2 += (planes[k, axis] - point[axis]) ** 2
            if distance_m2 < same_m * same_m:
                slot = k
                break
        if planes[k, 3] > planes[slot, 3]:
            slot = k
    if distance < planes[slot, 3]:
        planes[slot, 0], planes[slot, 1], planes[slot, 2] = point[0], point[1], point[2]
        planes[slot, 3] = distance


@compiled(f"void({_POINT}, float64, {_FIELD}, float64[:, ::1])")
def touch(
    x: float,
    y: float,
    z: float,
    radius_m: float,
    z_m: Floats,
    corner_m: tuple[float, float, float],
    planes: Floats,
) -> None:
    """Find where a ball meets the field: points (PLANES, 3) and distances in ``planes``.

    A distance of ``radius_m`` or more means no contact; 0 means a centre below the surface.
    """
    x0, y0, spacing = corner_m
    rows, columns = z_m.shape
    planes[:, 3] = np.inf
    level, _, _ = _face(x, y, z_m, corner_m)
    if z <= level:
        planes[0, 0], planes[0, 1], planes[0, 2], planes[0, 3] = x, y, level, 0.0
        return
    first = max(math.floor((x - radius_m - x0) / spacing), 0)
    last = min(math.floor((x + radius_m - x0) / spacing), columns - 2)
    low = max(math.floor((y - radius_m - y0) / spacing), 0)
    high = min(math.floor((y + radius_m - y0) / spacing), rows - 2)
    corners = np.empty((3, 3))
    nearest = np.empty(3)
    for row in range(low, high + 1):
        south = y0 + row * spacing
        dy = max(south - y, 0.0, y - south - spacing)
        for column in range(first, last + 1):
            west = x0 + column * spacing
            dx = max(west - x, 0.0, x - west - spacing)
            z00, z01 = z_m[row, column], z_m[row, column + 1]
            z10, z11 = z_m[row + 1, column], z_m[row + 1, column + 1]
            dz = max(z - max(z00, z01, z10, z11), 0.0)
            if dx * dx + dy * dy + dz * dz >= radius_m * radius_m:
                continue
            for upper in range(2):
                corners[0, 0], corners[0, 1], corners[0, 2] = west, south, z00
                corners[1, 0], corners[1, 1], corners[1, 2] = west + spacing, south + spacing, z11
                corners[2, 0], corners[2, 1], corners[2, 2] = west + spacing, south, z01
                if upper:
                    corners[2, 0], corners[2, 1], corners[2, 2] = west, south + spacing, z10
                inside = _nearest_point(x, y, z, corners, nearest)
                square = (x - nearest[0]) ** 2 + (y - nearest[1]) ** 2 + (z - nearest[2]) ** 2
                if square >= radius_m * radius_m:
                    continue
                distance = math.sqrt(square)
                if inside:  # not a face seen from behind, such as the wall under a trench's edge
                    counts = _is_above_triangle(x, y, z, corners)
                else:
                    counts = _is_nearest_contact(x, y, z, nearest, distance, z_m, corner_m)
                if counts:
                    _keep_plane(nearest, distance, _SAME_CONTACT * radius_m, planes)


@compiled(
    f"void(float64[:, ::1], int32[::1], float64[::1], {_FIELD}, int32[:, ::1], "
    "float64[:, ::1], float64[:, ::1])"
)
def lay_planes(
    places_m: Floats,
    balls: Int32s,
    ball_m: Floats,
    z_m: Floats,
    corner_m: tuple[float, float, float],
    planes: Int32s,
    plane_m: Floats,
    plane_quat: Floats,
) -> None:
    """Move the planes of every ball to its contacts, or away.

    Args:
        places_m: (geoms, 3) centres in the world.
        balls: (B,) indices of the balls.
        ball_m: (B,) their radii.
        z_m: (rows, columns) elevations, m.
        corner_m: x and y of the first sample, and the spacing.
        planes: (B, PLANES) indices of their planes.
        plane_m: (geoms, 3) places of the geoms; written.
        plane_quat: (geoms, 4) orientations; written.

    """
    laid = np.empty((PLANES, 4))
    for b in range(len(balls)):
        centre = places_m[balls[b]]
        radius_m = ball_m[b]
        touch(centre[0], centre[1], centre[2], radius_m, z_m, corner_m, laid)
        for k in range(PLANES):
            plane = planes[b, k]
            if laid[k, 3] >= radius_m:
                plane_m[plane, 2] = AWAY_M
                continue
            n0, n1, n2 = 0.0, 0.0, 1.0
            if laid[k, 3] > 0.0:
                n0 = (centre[0] - laid[k, 0]) / laid[k, 3]
                n1 = (centre[1] - laid[k, 1]) / laid[k, 3]
                n2 = (centre[2] - laid[k, 2]) / laid[k, 3]
            else:  # the centre is below the surface: the normal of the face above it
                _, gx, gy = _face(laid[k, 0], laid[k, 1], z_m, corner_m)
                steep = math.sqrt(1.0 + gx * gx + gy * gy)
                n0, n1, n2 = -gx / steep, -gy / steep, 1.0 / steep
            for axis in range(3):
                plane_m[plane, axis] = laid[k, axis]
            # the shortest rotation from the vertical to the normal
            length = math.sqrt(2.0 * (1.0 + n2))
            plane_quat[plane, 0] = 0.5 * length
            plane_quat[plane, 1] = -n1 / length
            plane_quat[plane, 2] = n0 / length
            plane_quat[plane, 3] = 0.0


@dataclass(frozen=True, slots=True)
class TangentPlanes:
    """The planes of one model and their field."""

    model: mujoco.MjModel
    balls: Int32s
    """(B,) geoms of the bellies; none on a level floor."""
    planes: Int32s
    """(B, PLANES) planes at each ball."""
    radius_m: Floats
    """(B,) of the balls."""
    z_m: Floats
    corner_m: tuple[float, float, float]

    @classmethod
    def of(cls, model: mujoco.MjModel, ground: HeightField | None) -> "TangentPlanes":
        """Find the planes made by ``sim.physics.body``."""
        if ground is None:
            none = np.zeros(0, dtype=np.int32)
            flat = np.zeros((2, 2))
            corner = (0.0, 0.0, 1.0)
            return cls(model, none, none.reshape(0, PLANES), np.zeros(0), flat, corner)
        first = model.pair_geom1.reshape(-1, PLANES).astype(np.int32)
        balls = model.pair_geom2.reshape(-1, PLANES)[:, 0].astype(np.int32)
        corner = ground.x0_m, ground.y0_m, ground.spacing_m
        radius_m = np.ascontiguousarray(model.geom_size[balls, 0])
        return cls(model, balls, first, radius_m, np.ascontiguousarray(ground.z_m), corner)

    def lay(self, data: mujoco.MjData) -> None:
        """Lay the planes under the balls; call it before every step."""
        if len(self.balls):
            mujoco.mj_kinematics(self.model, data)
            lay_planes(
                data.geom_xpos,
                self.balls,
                self.radius_m,
                self.z_m,
                self.corner_m,
                self.planes,
                self.model.geom_pos,
                self.model.geom_quat,
            )
