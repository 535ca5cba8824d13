"""Rollout: where pieces of angle track would carry the body, on paper, before one is chosen.

The links' headings follow the track; in each step the rigid velocity balances Coulomb friction and
the slope's pull under every link (``rigid_motion``), as in the forecast of a whole plan, but
compiled and for many pieces at once. The balance knows no rate: lengths stand in place of times,
except where nothing holds the body and it slides with inertia.
"""

from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Floats, Ints
from snakewalk.config.heightfield import HeightField
from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import FrictionConfig
from snakewalk.controller.kinematics.links import half_lengths_m, link_weights
from snakewalk.controller.kinematics.retarget import Retarget
from snakewalk.controller.mechanics.ground_step import FIELD, plane
from snakewalk.controller.mechanics.rigid_motion import add_inertia, balance
from snakewalk.drivers.compiling import compiled, readonly_array

_STEP_SEGMENTS = 2.5
_BACK, _FORTH = 5, 40
"""Points of the path among which a place is looked for after a step."""
_AHEAD = 30
"""Points of the path from the centre to where its direction is compared."""


@dataclass(frozen=True, slots=True)
class PlanarPose:
    """Where a body is in plan."""

    centre_m: Floats
    """(2,) centre of the links."""
    offset_rad: float
    """Rotation from the track's angles to the world."""


@dataclass(frozen=True, slots=True)
class Drift:
    """What a body does beside the balance, per segment of pulse, in the frame of its mean line."""

    ahead_m: float = 0.0
    left_m: float = 0.0
    turn_rad: float = 0.0


PATH_STEP_M = 0.01
_BEYOND_M = 4.0


@dataclass(frozen=True, slots=True)
class PathTable:
    """A path as a table: a point every ``PATH_STEP_M``, and straight on beyond its end."""

    points_m: Floats
    """(n, 2)"""

    @classmethod
    def of(cls, points_m: Floats) -> "PathTable":
        """Carry points (n, 2), ``PATH_STEP_M`` apart, on along the last direction."""
        step = points_m[-1] - points_m[-2]
        step = step / np.hypot(step[0], step[1]) * PATH_STEP_M
        count = np.arange(1, round(_BEYOND_M / PATH_STEP_M) + 1)
        return cls(
            np.ascontiguousarray(np.vstack([points_m, points_m[-1] + count[:, None] * step]))
        )


@dataclass(frozen=True, slots=True)
class Rolled:
    """What became of C pieces; lengths in metres."""

    centre_m: Floats
    """(C, 2) at the end."""
    offset_rad: Floats
    """(C,) at the end."""
    off_path_m: Floats
    """(C,) root mean square distance of the centre from the path."""
    end_off_m: Floats
    """(C,) signed distance of the centre from the path at the end, positive to its left."""
    head_off_m: Floats
    """(C,) that of the head link."""
    heading_rad: Floats
    """(C,) mean heading at the end less the path's direction a little ahead of the centre."""
    along_m: Floats
    """(C,) progress on the path."""
    time_s: Floats
    """(C,) that the joints need for it."""


class Rollout:
    """Rolls out pieces of track for one robot on one ground; ``None`` is a level floor."""

    def __init__(
        self,
        robot: RobotConfig,
        friction: FrictionConfig,
        ground: HeightField | None,
        points: int,
    ) -> None:
        field = ground or HeightField(np.zeros((2, 2)), 1.0, 0.0, 0.0)
        self._field = np.ascontiguousarray(field.z_m), field.x0_m, field.y0_m, field.spacing_m
        retarget = Retarget(robot, points)
        self._edges, self._group = retarget.edges, retarget.group_of_link
        self.segment_m = robot.length_m / points
        """Length of a segment."""
        self._half_m, self._weight = half_lengths_m(robot), link_weights(robot)
        self._body = np.array(
            [
                friction.along,
                friction.across,
                robot.joint_speed_limit_rad_s,
            ]
        )

    def __call__(
        self,
        samples_rad: Floats,
        pieces_rad: Floats,
        head: float,
        start: PlanarPose,
        path: PathTable,
        path_at: int,
        cruise_segments_s: float,
        drift: Drift,
        until: float | None = None,
    ) -> Rolled:
        """Roll a body out over each piece.

        Args:
            samples_rad: (M,) of the track, from at least a body before ``head``.
            pieces_rad: (C, n) that would be appended.
            head: segments from the first sample to where the head is.
            start: where the body is.
            path: to measure by.
            path_at: index of its point nearest to the centre.
            cruise_segments_s: wanted speed of the pulse; joints at their speed limit slow it.
            drift: added to the balance.
            until: where the head ends; None is the end of the pieces.

        """
        count, length = pieces_rad.shape
        pulse = (len(samples_rad) + length if until is None else until) - head
        steps = max(1, round(pulse / _STEP_SEGMENTS))
        out = np.empty((count, 9))
        _roll(
            samples_rad, np.ascontiguousarray(pieces_rad), head, steps, pulse / steps,
            np.array([*start.centre_m, start.offset_rad]), *self._field, self._edges, self._group,
            self._half_m, self._weight, self._body, path.points_m, path_at, cruise_segments_s,
            np.array([drift.ahead_m, drift.left_m, drift.turn_rad]), out,
        )  # fmt: skip
        return Rolled(out[:, :2], *out.T[2:])


@compiled("float64(float64[::1], float64[::1], float64)")
def _area(total: Floats, track: Floats, at: float) -> float:
    """Integral of the track's angles from its start to a place."""
    k = min(max(int(at), 0), len(track) - 1)
    return float(total[k] + (at - k) * track[k])


@compiled(
    f"void(float64[::1], float64[::1], float64, float64[::1], int64[::1], {readonly_array()},"
    f" {readonly_array()}, float64[::1], float64[:, ::1], float64[::1])"
)
def _lay(
    total: Floats,
    track: Floats,
    head: float,
    edges: Floats,
    group: Ints,
    half_m: Floats,
    weight: Floats,
    headings: Floats,
    points: Floats,
    groups: Floats,
) -> None:
    """Write headings of the links and their centres about that of mass, in the track's frame."""
    for g in range(len(groups)):
        width = edges[g + 1] - edges[g]
        ahead = _area(total, track, head - edges[g])
        groups[g] = (ahead - _area(total, track, head - edges[g + 1])) / width
    x = y = sum_x = sum_y = whole = 0.0
    links = len(headings)
    for i in range(links):
        angle = groups[group[i]]
        headings[i] = angle
        c, s = half_m[i] * np.cos(angle), half_m[i] * np.sin(angle)
        x, y = x - c, y - s
        points[i, 0], points[i, 1] = x, y
        x, y = x - c, y - s
        sum_x, sum_y = sum_x + weight[i] * points[i, 0], sum_y + weight[i] * points[i, 1]
        whole += weight[i]
    for i in range(links):
        points[i, 0] -= sum_x / whole
        points[i, 1] -= sum_y / whole


@compiled("UniTuple(float64, 2)(float64[:, ::1], int64, float64, float64)")
def _nearest(path: Floats, at: int, x: float, y: float) -> tuple[float, float]:
    """Place on the path near ``at``, and the signed distance there, positive to its left."""
    last = len(path) - 2
    best, least = at, np.inf
    for k in range(max(at - _BACK, 0), min(at + _FORTH, last) + 1):
        dx, dy = x - path[k, 0], y - path[k, 1]
        square = dx * dx + dy * dy
        if square < least:
            least, best = square, k
    tx, ty = path[best + 1, 0] - path[best, 0], path[best + 1, 1] - path[best, 1]
    dx, dy = x - path[best, 0], y - path[best, 1]
    side = tx * dy - ty * dx
    return float(best), (1.0 if side >= 0.0 else -1.0) * np.sqrt(least)


@compiled(
    "float64(float64[::1], float64[:, ::1], float64[::1], float64[:, ::1], float64, float64,"
    " float64[::1], float64[:, ::1], float64[:, ::1])"
)
def _turned(
    here_rad: Floats,
    here_m: Floats,
    next_rad: Floats,
    next_m: Floats,
    offset_rad: float,
    step_s: float,
    headings: Floats,
    points: Floats,
    shape: Floats,
) -> float:
    """Write the body between two steps in the world, and how its links move; its mean heading."""
    c, s = np.cos(offset_rad), np.sin(offset_rad)
    mean, links = 0.0, len(headings)
    for i in range(links):
        x, y = 0.5 * (here_m[i, 0] + next_m[i, 0]), 0.5 * (here_m[i, 1] + next_m[i, 1])
        points[i, 0], points[i, 1] = c * x - s * y, s * x + c * y
        x, y = (next_m[i, 0] - here_m[i, 0]) / step_s, (next_m[i, 1] - here_m[i, 1]) / step_s
        shape[i, 0], shape[i, 1] = c * x - s * y, s * x + c * y
        headings[i] = offset_rad + 0.5 * (here_rad[i] + next_rad[i])
        mean += headings[i] / links
    return float(mean)


@compiled("float64(float64[::1], float64[::1], float64, float64, float64)")
def _pulse_rate(
    here_rad: Floats, next_rad: Floats, step: float, cruise: float, limit_rad_s: float
) -> float:
    """Segments a second from one set of group headings to the next, within the joints' speed."""
    rate = cruise
    for g in range(len(here_rad) - 1):
        turn = abs(next_rad[g] - next_rad[g + 1] - here_rad[g] + here_rad[g + 1])
        if rate * turn > limit_rad_s * step:
            rate = limit_rad_s * step / turn
    return rate


@compiled(
    f"void({FIELD}, float64, float64, float64[:, ::1], {readonly_array()}, float64[::1],"
    " float64[::1])"
)
def _pull(
    z_m: Floats,
    x0: float,
    y0: float,
    spacing: float,
    x: float,
    y: float,
    points: Floats,
    weight: Floats,
    normal: Floats,
    linear: Floats,
) -> None:
    """Write each link's load, and add the slope's force and moment on all, in mean link weights."""
    for i in range(len(points)):
        _, gx, gy = plane(z_m, x0, y0, spacing, x + points[i, 0], y + points[i, 1])
        normal[i] = weight[i] / np.sqrt(1.0 + gx * gx + gy * gy)
        fx, fy = -gx * normal[i], -gy * normal[i]
        linear[0] += fx
        linear[1] += fy
        linear[2] += points[i, 0] * fy - points[i, 1] * fx


@compiled(
    f"void({readonly_array(layout='C')}, float64[:, ::1], float64, int64, float64, float64[::1],"
    f" {FIELD}, float64[::1], int64[::1], {readonly_array()}, {readonly_array()}, float64[::1],"
    " float64[:, ::1], int64, float64, float64[::1], float64[:, ::1])"
)
def _roll(
    samples: Floats,
    pieces: Floats,
    head: float,
    steps: int,
    step: float,
    start: Floats,
    z_m: Floats,
    x0: float,
    y0: float,
    spacing: float,
    edges: Floats,
    group: Ints,
    half_m: Floats,
    weight: Floats,
    body: Floats,
    path: Floats,
    path_at: int,
    cruise: float,
    drift: Floats,
    out: Floats,
) -> None:
    """Roll out pieces (C, n); ``out`` (C, 9) are the columns of ``Rolled``."""
    along, across, limit = body[0], body[1], body[2]
    known, new, links = len(samples), pieces.shape[1], len(group)
    track, total = np.empty(known + new), np.zeros(known + new + 1)
    here_g, next_g = np.empty(len(edges) - 1), np.empty(len(edges) - 1)
    here_h, next_h, heading = np.empty(links), np.empty(links), np.empty(links)
    here_p, next_p, points = np.empty((links, 2)), np.empty((links, 2)), np.empty((links, 2))
    shape, moving, normal = np.empty((links, 2)), np.empty((links, 2)), weight.copy()
    linear, velocity = np.empty(3), np.empty(3)
    inertia, none = np.empty((3, 3)), np.zeros((3, 3))
    level = z_m.min() == z_m.max()
    for c in range(len(pieces)):
        track[:known], track[known:] = samples, pieces[c]
        for k in range(known + new):
            total[k + 1] = total[k] + track[k]
        x, y, phi = start[0], start[1], start[2]
        at, place, off, square, time = head, float(path_at), 0.0, 0.0, 0.0
        velocity[:], moving[:] = 0.0, 0.0
        _lay(total, track, at, edges, group, half_m, weight, here_h, here_p, here_g)
        for _ in range(steps):
            at += step
            _lay(total, track, at, edges, group, half_m, weight, next_h, next_p, next_g)
            dt = step / _pulse_rate(here_g, next_g, step, cruise, limit)
            mean = _turned(here_h, here_p, next_h, next_p, phi, dt, heading, points, shape)
            linear[:] = 0.0
            if not level:
                _pull(z_m, x0, y0, spacing, x, y, points, weight, normal, linear)
            if not balance(points, heading, shape, along, across, normal, linear, none, velocity):
                add_inertia(points, shape, moving, dt, linear, inertia)
                balance(points, heading, shape, along, across, normal, linear, inertia, velocity)
            for i in range(links):
                moving[i, 0] = shape[i, 0] + velocity[0] - velocity[2] * points[i, 1]
                moving[i, 1] = shape[i, 1] + velocity[1] + velocity[2] * points[i, 0]
            ahead, left = step * np.cos(mean), step * np.sin(mean)
            x += velocity[0] * dt + ahead * drift[0] - left * drift[1]
            y += velocity[1] * dt + left * drift[0] + ahead * drift[1]
            phi += velocity[2] * dt + step * drift[2]
            time += dt
            here_h, next_h = next_h, here_h
            here_p, next_p = next_p, here_p
            here_g, next_g = next_g, here_g
            place, off = _nearest(path, int(place), x, y)
            square += off * off
        k = min(int(place) + _AHEAD, len(path) - 2)
        error = phi + here_h.mean()
        error -= np.arctan2(path[k + 1, 1] - path[k, 1], path[k + 1, 0] - path[k, 0])
        head_x = x + np.cos(phi) * here_p[0, 0] - np.sin(phi) * here_p[0, 1]
        head_y = y + np.sin(phi) * here_p[0, 0] + np.cos(phi) * here_p[0, 1]
        out[c, 0], out[c, 1], out[c, 2] = x, y, phi
        out[c, 3], out[c, 4] = np.sqrt(square / steps), off
        out[c, 5] = _nearest(path, k, head_x, head_y)[1]
        out[c, 6] = error - 2.0 * np.pi * np.floor(error / (2.0 * np.pi) + 0.5)
        out[c, 7], out[c, 8] = PATH_STEP_M * (place - path_at), time
