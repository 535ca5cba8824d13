"""Rollout: where pieces of angle track would carry the body, on paper, before one is chosen.

The links' headings follow the track; in each step the rigid velocity balances Coulomb friction and
the slope's pull under every link (``rigid_motion``), as in the forecast of a whole plan, but
compiled and for many pieces at once. The balance knows no rate: lengths stand in place of times,
except where nothing holds the body and it slides with inertia.
"""

from dataclasses import dataclass
from typing import Any

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
_STATE = 11
"""Numbers of a body between two steps."""


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
    waypoint_m: Floats
    """(2,) the next one."""
    waypoint_at: float
    """Index of the point at which the path passes it; infinite where it leads to none."""

    @classmethod
    def of(
        cls, points_m: Floats, waypoint_m: Floats | None = None, waypoint_at: float = np.inf
    ) -> "PathTable":
        """Carry points (n, 2), ``PATH_STEP_M`` apart, on along the last direction."""
        step = points_m[-1] - points_m[-2]
        step = step / np.hypot(step[0], step[1]) * PATH_STEP_M
        count = np.arange(1, round(_BEYOND_M / PATH_STEP_M) + 1)
        return cls(
            np.ascontiguousarray(np.vstack([points_m, points_m[-1] + count[:, None] * step])),
            np.zeros(2) if waypoint_m is None else waypoint_m,
            waypoint_at,
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
    passed_m: Floats
    """(C,) least distance of the centre from the next waypoint; 0 where it is not passed."""
    along_m: Floats
    """(C,) progress on the path."""
    time_s: Floats
    """(C,) that the joints need for it."""


class Followed:
    """How a body that moves otherwise follows a path: measured as rollouts are."""

    def __init__(self, path: PathTable, path_at: int) -> None:
        """Begin at the path's point with index ``path_at``."""
        self._path, self._from, self._steps = path, path_at, 0
        self._state = np.zeros(_STATE)
        self._state[3], self._state[10] = path_at, np.inf

    def note(self, centre_m: Floats, dt_s: float) -> None:
        """Take the centre of mass (2,), ``dt_s`` after the last."""
        path, (x, y) = self._path, centre_m
        _note(self._state, path.points_m, path.waypoint_m, float(x), float(y), dt_s)
        self._steps += 1

    def rolled(self, headings_rad: Floats, points_m: Floats) -> Rolled:
        """Result for links that head so (L,) at the end, at points (L, 2) about the centre."""
        out, path = np.empty((1, 10)), self._path
        given = self._steps, headings_rad, np.ascontiguousarray(points_m), path.points_m
        _write_result(self._state, *given, self._from, path.waypoint_at, out[0])
        return Rolled(out[:, :2], *out.T[2:])


class Rollout:
    """Rolls out pieces of track for one robot on one ground; ``None`` is a level floor."""

    def __init__(
        self,
        robot: RobotConfig,
        friction: FrictionConfig,
        ground: HeightField | None,
        points: int,
    ) -> None:
        self.change_ground(ground or HeightField(np.zeros((2, 2)), 1.0, 0.0, 0.0))
        retarget = Retarget(robot, points)
        shares = half_lengths_m(robot), link_weights(robot)
        self._links = (*shares, retarget.edges, retarget.group_of_link)
        self.segment_m = robot.length_m / points
        """Length of a segment."""
        self._speed_limit_rad_s = robot.joint_speed_limit_rad_s
        self.use_friction(friction)

    def use_friction(self, friction: FrictionConfig) -> None:
        """Roll out with this friction; what has begun goes on with that of before."""
        self._body = np.array([friction.along, friction.across, self._speed_limit_rad_s])

    def change_ground(self, ground: HeightField) -> None:
        """Roll out on another ground from now on."""
        self._field = np.ascontiguousarray(ground.z_m), ground.x0_m, ground.y0_m, ground.spacing_m

    def steepest(self, points_m: Floats) -> float:
        """Greatest mean slope of the ground over ten points in a row of (n, 2)."""
        slopes = np.array([plane(*self._field, float(x), float(y))[1:] for x, y in points_m])
        count = min(10, len(slopes))
        rows = np.lib.stride_tricks.sliding_window_view(slopes, count, axis=0).mean(axis=-1)
        return float(np.hypot(*rows.T).max())

    def begin(
        self,
        samples_rad: Floats,
        head: float,
        start: PlanarPose,
        path: PathTable,
        path_at: int,
        cruise_segments_s: float,
        drift: Drift,
    ) -> "RolloutTree":
        """Where every rollout of a decision begins.

        Args:
            samples_rad: (M,) of the track, from at least a body before ``head``.
            head: segments from the first sample to where the head is.
            start: where the body is.
            path: to measure by.
            path_at: index of its point nearest to the centre.
            cruise_segments_s: wanted speed of the pulse; joints at their speed limit slow it.
            drift: added to the balance.

        """
        given = (
            *(np.array([*start.centre_m, start.offset_rad]), *self._field, *self._links),
            *(self._body, path.points_m, path_at),
            *(np.array([*path.waypoint_m, path.waypoint_at]), cruise_segments_s),
            np.array([drift.ahead_m, drift.left_m, drift.turn_rad]),
        )
        return RolloutTree(samples_rad, head, len(self._links[0]), given)


class RolloutTree:
    """Rollouts from one pose on one track: what pieces have in common is rolled out once."""

    def __init__(
        self, samples_rad: Floats, head: float, links: int, given: tuple[Any, ...]
    ) -> None:
        """Of ``Rollout.begin``; ``given`` are arguments of ``_roll``."""
        self._samples, self._head, self._given = samples_rad, head, given
        self._count = 0
        self._pieces = np.empty((0, 0))
        self._states, self._moving = np.empty((0, 0, _STATE)), np.empty((0, 0, links, 2))

    def roll(self, pieces_rad: Floats, pulse: float | None = None) -> Rolled:
        """Roll a body out over each piece.

        Args:
            pieces_rad: (C, n) that would be appended.
            pulse: segments that the head travels; None is to the end of the pieces.

        """
        count, length = pieces_rad.shape
        if pulse is None:
            pulse = len(self._samples) + length - self._head
        steps = max(1, round(pulse / _STEP_SEGMENTS))
        before = self._make_room(count, length, steps)
        self._pieces[before : self._count] = pieces_rad
        out = np.empty((count, 10))
        _roll(
            *(self._samples, self._pieces[: self._count], before, self._head, pulse / steps),
            *(*self._given, self._states, self._moving, out),
        )
        return Rolled(out[:, :2], *out.T[2:])

    def _make_room(self, count: int, length: int, steps: int) -> int:
        """Make room for so many more pieces; the place of the first."""
        if (length, steps + 1) != (self._pieces.shape[1], self._states.shape[1]):
            self._count = 0
        before = self._count
        self._count += count
        if before == 0 or self._count > len(self._pieces):
            room, links = 2 * self._count, self._moving.shape[2]
            pieces, states = np.empty((room, length)), np.empty((room, steps + 1, _STATE))
            moving = np.empty((room, steps + 1, links, 2))
            if before > 0:
                pieces[:before], states[:before] = self._pieces[:before], self._states[:before]
                moving[:before] = self._moving[:before]
            self._pieces, self._states, self._moving = pieces, states, moving
        return before


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
    ahead = _area(total, track, head - edges[0])
    for g in range(len(groups)):
        behind = _area(total, track, head - edges[g + 1])
        groups[g] = (ahead - behind) / (edges[g + 1] - edges[g])
        ahead = behind
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


@compiled("void(float64[::1], float64[:, ::1], float64[::1], float64, float64, float64)")
def _note(state: Floats, path: Floats, waypoint: Floats, x: float, y: float, dt: float) -> None:
    """Take into a state (11,) that its body has come to (x, y) within ``dt``."""
    state[0], state[1] = x, y
    state[3], state[4] = _nearest(path, int(state[3]), x, y)
    state[5] += state[4] * state[4]
    state[6] += dt
    dx, dy = x - waypoint[0], y - waypoint[1]
    state[10] = min(state[10], dx * dx + dy * dy)


@compiled(
    "float64(float64[::1], float64[:, ::1], float64[::1], float64[:, ::1], float64, float64,"
    " float64[:, ::1], float64[:, ::1], float64[:, ::1])"
)
def _turned(
    here_rad: Floats,
    here_m: Floats,
    next_rad: Floats,
    next_m: Floats,
    offset_rad: float,
    step_s: float,
    forward: Floats,
    points: Floats,
    shape: Floats,
) -> float:
    """Write the body between two steps in the world, and how its links move; its mean heading."""
    c, s = np.cos(offset_rad), np.sin(offset_rad)
    mean, links = 0.0, len(forward)
    for i in range(links):
        x, y = 0.5 * (here_m[i, 0] + next_m[i, 0]), 0.5 * (here_m[i, 1] + next_m[i, 1])
        points[i, 0], points[i, 1] = c * x - s * y, s * x + c * y
        x, y = (next_m[i, 0] - here_m[i, 0]) / step_s, (next_m[i, 1] - here_m[i, 1]) / step_s
        shape[i, 0], shape[i, 1] = c * x - s * y, s * x + c * y
        heading = offset_rad + 0.5 * (here_rad[i] + next_rad[i])
        forward[i, 0], forward[i, 1] = np.cos(heading), np.sin(heading)
        mean += heading / links
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
    "void(float64[:, ::1], float64[:, ::1], float64[:, ::1], float64[::1], float64[::1],"
    " float64[::1], float64, float64[:, ::1], float64[::1])"
)
def _slide(
    points: Floats,
    forward: Floats,
    shape: Floats,
    body: Floats,
    normal: Floats,
    linear: Floats,
    step_s: float,
    moving: Floats,
    velocity: Floats,
) -> None:
    """Balance friction, with inertia where nothing holds the body; write how body and links move.

    ``velocity`` (3,) and ``moving`` (L, 2) are those of the step before.
    """
    quadratic = np.zeros((3, 3))
    held = balance(points, forward, shape, body[0], body[1], normal, linear, quadratic, velocity)
    if not held:
        add_inertia(points, shape, moving, step_s, linear, quadratic)
        balance(points, forward, shape, body[0], body[1], normal, linear, quadratic, velocity)
    for i in range(len(points)):
        moving[i, 0] = shape[i, 0] + velocity[0] - velocity[2] * points[i, 1]
        moving[i, 1] = shape[i, 1] + velocity[1] + velocity[2] * points[i, 0]


@compiled(
    "void(float64[::1], int64, float64[::1], float64[:, ::1], float64[:, ::1], int64, float64,"
    " float64[::1])"
)
def _write_result(
    state: Floats,
    steps: int,
    headings: Floats,
    points: Floats,
    path: Floats,
    path_at: int,
    waypoint_at: float,
    row: Floats,
) -> None:
    """Write the columns of ``Rolled`` (10,) from the state (11,) after all steps."""
    x, y, phi, place = state[0], state[1], state[2], state[3]
    k = min(int(place) + _AHEAD, len(path) - 2)
    error = phi + headings.mean()
    error -= np.arctan2(path[k + 1, 1] - path[k, 1], path[k + 1, 0] - path[k, 0])
    head_x = x + np.cos(phi) * points[0, 0] - np.sin(phi) * points[0, 1]
    head_y = y + np.sin(phi) * points[0, 0] + np.cos(phi) * points[0, 1]
    row[0], row[1], row[2] = x, y, phi
    row[3], row[4] = np.sqrt(state[5] / steps), state[4]
    row[5] = _nearest(path, k, head_x, head_y)[1]
    row[6] = error - 2.0 * np.pi * np.floor(error / (2.0 * np.pi) + 0.5)
    row[7] = np.sqrt(state[10]) if place >= waypoint_at else 0.0
    row[8], row[9] = PATH_STEP_M * (place - path_at), state[6]


@compiled("UniTuple(int64, 2)(float64[:, ::1], int64)")
def _alike(pieces: Floats, piece: int) -> tuple[int, int]:
    """Which earlier piece begins like a piece for longest, and for how many samples; -1 is none.

    Of several that do for as long it is the first: what that shares with others is known of it.
    """
    best, longest = -1, -1
    for other in range(piece):
        same = 0
        while same < pieces.shape[1] and pieces[other, same] == pieces[piece, same]:
            same += 1
        if same > longest:
            best, longest = other, same
    return best, longest


@compiled(
    f"void({readonly_array(layout='C')}, float64[:, ::1], int64, float64, float64, float64[::1],"
    f" {FIELD}, {readonly_array()}, {readonly_array()}, float64[::1], int64[::1], float64[::1],"
    " float64[:, ::1], int64, float64[::1], float64, float64[::1], float64[:, :, ::1],"
    " float64[:, :, :, ::1],"
    " float64[:, ::1])"
)
def _roll(
    samples: Floats,
    pieces: Floats,
    before: int,
    head: float,
    step: float,
    start: Floats,
    z_m: Floats,
    x0: float,
    y0: float,
    spacing: float,
    half_m: Floats,
    weight: Floats,
    edges: Floats,
    group: Ints,
    body: Floats,
    path: Floats,
    path_at: int,
    waypoint: Floats,
    cruise: float,
    drift: Floats,
    states: Floats,
    movings: Floats,
    out: Floats,
) -> None:
    """Roll out pieces (P, n) from number ``before`` on; ``out`` (C, 10) are columns of ``Rolled``.

    Args:
        samples: as in ``Rollout.begin``, and so on.
        pieces: those before, too.
        before: how many have been rolled out before.
        head: place on the track.
        step: of the head.
        start: (3,) place of the body, and turn of the track.
        z_m: the ground.
        x0: its corner.
        y0: likewise.
        spacing: of its samples.
        half_m: (L,) half lengths of the links.
        weight: (L,)
        edges: of the groups of links.
        group: (L,) of each link.
        body: (3,) friction along and across; speed limit of the joints.
        path: (m, 2) points.
        path_at: place on it.
        waypoint: (3,) the next waypoint, and its place on the path.
        cruise: wanted segments a second.
        drift: (3,) added to each step.
        states: (P, steps + 1, 11) of each piece before each step, and at its end: the body's place
            (2) and turn, place on the path, distance from it, sum of its squares, time, velocity
            (3), and the least square of its distance from the waypoint.
        movings: (P, steps + 1, L, 2) velocities of the links; kept as ``states`` are.
        out: written.

    """
    known, new, links, steps = len(samples), pieces.shape[1], len(group), states.shape[1] - 1
    track, total = np.empty(known + new), np.zeros(known + new + 1)
    here_g, next_g = np.empty(len(edges) - 1), np.empty(len(edges) - 1)
    here_h, next_h = np.empty(links), np.empty(links)
    here_p, next_p, points = np.empty((links, 2)), np.empty((links, 2)), np.empty((links, 2))
    shape, moving, normal = np.empty((links, 2)), np.empty((links, 2)), weight.copy()
    forward, velocity, linear = np.empty((links, 2)), np.empty(3), np.empty(3)
    level = z_m.min() == z_m.max()
    track[:known] = samples
    for c in range(before, len(pieces)):
        track[known:] = pieces[c]
        for k in range(known + new):
            total[k + 1] = total[k] + track[k]
        at, begin = head, 0
        like, same = _alike(pieces, c)
        if like < 0:
            states[c, 0, :3], states[c, 0, 3], states[c, 0, 4:] = start, path_at, 0.0
            states[c, 0, 10] = np.inf
            movings[c, 0] = 0.0
        else:
            while begin < steps and at + step <= known + same:
                at, begin = at + step, begin + 1
            states[c, begin], movings[c, begin] = states[like, begin], movings[like, begin]
        state = states[c, begin]
        x, y, phi = state[0], state[1], state[2]
        velocity[:], moving[:] = state[7:10], movings[c, begin]
        _lay(total, track, at, edges, group, half_m, weight, here_h, here_p, here_g)
        for n in range(begin, steps):
            at += step
            _lay(total, track, at, edges, group, half_m, weight, next_h, next_p, next_g)
            dt = step / _pulse_rate(here_g, next_g, step, cruise, body[2])
            mean = _turned(here_h, here_p, next_h, next_p, phi, dt, forward, points, shape)
            linear[:] = 0.0
            if not level:
                _pull(z_m, x0, y0, spacing, x, y, points, weight, normal, linear)
            _slide(points, forward, shape, body, normal, linear, dt, moving, velocity)
            ahead, left = step * np.cos(mean), step * np.sin(mean)
            x += velocity[0] * dt + ahead * drift[0] - left * drift[1]
            y += velocity[1] * dt + left * drift[0] + ahead * drift[1]
            phi += velocity[2] * dt + step * drift[2]
            here_h, next_h, here_p, next_p = next_h, here_h, next_p, here_p
            here_g, next_g = next_g, here_g
            states[c, n + 1], movings[c, n + 1] = state, moving
            state = states[c, n + 1]
            _note(state, path, waypoint, x, y, dt)
            state[2], state[7:10] = phi, velocity
        _write_result(*(state, steps, here_h, here_p, path, path_at, waypoint[2], out[c - before]))
