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
from snakewalk.controller.mechanics.rigid_motion import (
    FORWARD_X,
    FORWARD_Y,
    LANES,
    MOVING_X,
    MOVING_Y,
    NORMAL,
    OTHERS,
    POINT_X,
    POINT_Y,
    SHAPE_X,
    SHAPE_Y,
    add_inertia,
    balance,
    link_table,
)
from snakewalk.drivers.compiling import compiled, inlined, readonly_array

STEP_SEGMENTS = 4.0
"""Of a step (ours): ends lie 1 cm along the way and 3 to 5 mm aside of those by steps of 0.5."""
_BACK, _FORTH = 5, 40
"""Points of the path among which a place is looked for after a step."""
_AHEAD = 30
"""Points of the path from the centre to where its direction is compared."""
_STATE = 11
"""Numbers of a body between two steps."""
_HALF, _WEIGHT, _HERE, _HERE_X, _HERE_Y = range(OTHERS, OTHERS + 5 * LANES, LANES)
"""Rows of a rollout's table of links: half length and weight; heading and centre about that of
mass, in the track's frame."""
_NEXT, _NEXT_X, _NEXT_Y, _COS, _SIN = range(OTHERS + 5 * LANES, OTHERS + 10 * LANES, LANES)
"""The same after the step; a cosine and a sine."""
_ROWS = OTHERS + 10 * LANES


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


OFF_PATH, END_OFF, HEAD_OFF, HEADING, PASSED, ALONG, TIME = range(3, 10)
"""Columns of what became of a piece."""
_COLUMNS = 10
PATH_STEP_M = 0.01
_BEYOND_M = 4.0


@dataclass(frozen=True, slots=True)
class TabulatedPath:
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
    ) -> "TabulatedPath":
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

    columns: Floats
    """(C, 10) place (2) of the centre and turn, and what the properties from there on say."""

    @property
    def centre_m(self) -> Floats:
        """(C, 2) at the end."""
        return self.columns[:, :2]

    @property
    def offset_rad(self) -> Floats:
        """(C,) at the end."""
        return self.columns[:, 2]

    @property
    def off_path_m(self) -> Floats:
        """(C,) root mean square distance of the centre from the path."""
        return self.columns[:, OFF_PATH]

    @property
    def end_off_m(self) -> Floats:
        """(C,) signed distance of the centre from the path at the end, positive to its left."""
        return self.columns[:, END_OFF]

    @property
    def head_off_m(self) -> Floats:
        """(C,) that of the head link."""
        return self.columns[:, HEAD_OFF]

    @property
    def heading_rad(self) -> Floats:
        """(C,) mean heading at the end less the path's direction a little ahead of the centre."""
        return self.columns[:, HEADING]

    @property
    def passed_m(self) -> Floats:
        """(C,) least distance of the centre from the next waypoint; 0 where it is not passed."""
        return self.columns[:, PASSED]

    @property
    def along_m(self) -> Floats:
        """(C,) progress on the path."""
        return self.columns[:, ALONG]

    @property
    def time_s(self) -> Floats:
        """(C,) that the joints need for it."""
        return self.columns[:, TIME]


class Followed:
    """How a body that moves otherwise follows a path: measured as rollouts are."""

    def __init__(self, path: TabulatedPath, path_at: int) -> None:
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
        out, path = np.empty((1, _COLUMNS)), self._path
        body = float(headings_rad.mean()), float(points_m[0, 0]), float(points_m[0, 1])
        given = path.points_m, self._from, path.waypoint_at
        _write_result(self._state, self._steps, *body, *given, out[0])
        return Rolled(out)


class Rollout:
    """Rolls out pieces of track for one robot on one ground; ``None`` is a level floor."""

    def __init__(
        self,
        robot: RobotConfig,
        friction: FrictionConfig,
        ground: HeightField | None,
        points: int,
    ) -> None:
        self._level = True
        self.change_ground(ground or HeightField(np.zeros((2, 2)), 1.0, 0.0, 0.0))
        retarget = Retarget(robot, points)
        self._table = link_table(robot.link_count, _ROWS)
        groups = self._table.reshape(-1, _ROWS)
        for row, values in ((_HALF, half_lengths_m(robot)), (_WEIGHT, link_weights(robot))):
            for k, value in enumerate(values):
                groups[k // LANES, row + k % LANES] = value
        self._links = self._table, retarget.edges, retarget.group_of_link
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
        self._level = bool(np.ptp(ground.z_m) == 0.0)

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
        path: TabulatedPath,
        path_at: int,
        cruise_segments_s: float,
        drift: Drift,
        room_of: "RolloutTree | None" = None,
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
            room_of: a tree that is not used any more; its memory is taken over.

        """
        given = (
            *(np.array([*start.centre_m, start.offset_rad]), *self._field, self._level),
            *self._links,
            *(self._body, path.points_m, path_at),
            *(np.array([*path.waypoint_m, path.waypoint_at]), cruise_segments_s),
            np.array([drift.ahead_m, drift.left_m, drift.turn_rad]),
        )
        return RolloutTree(samples_rad, head, len(self._table) // _ROWS, given, room_of)


class RolloutTree:
    """Rollouts from one pose on one track: what pieces have in common is rolled out once."""

    def __init__(
        self,
        samples_rad: Floats,
        head: float,
        groups: int,
        given: tuple[Any, ...],
        room_of: "RolloutTree | None" = None,
    ) -> None:
        """Of ``Rollout.begin``; ``groups`` of links; ``given`` are arguments of ``_roll``."""
        self._samples, self._head, self._given = samples_rad, head, given
        self._count = 0
        if room_of is None:
            self._pieces = np.empty((0, 0))
            self._states = np.empty((0, 0, _STATE))
            self._moving = np.empty((0, 0, 2 * groups * LANES))
        else:
            self._pieces, self._states = room_of._pieces, room_of._states
            self._moving = room_of._moving

    def roll(self, pieces_rad: Floats, pulse: float | None = None) -> Rolled:
        """Roll a body out over each piece.

        Args:
            pieces_rad: (C, n) that would be appended.
            pulse: segments that the head travels; None is to the end of the pieces.

        """
        count, length = pieces_rad.shape
        if pulse is None:
            pulse = len(self._samples) + length - self._head
        steps = max(1, round(pulse / STEP_SEGMENTS))
        before = self._make_room(count, length, steps)
        self._pieces[before : self._count] = pieces_rad
        out = np.empty((count, _COLUMNS))
        _roll(
            *(self._samples, self._pieces[: self._count], before, self._head, pulse / steps),
            *(*self._given, self._states, self._moving, out),
        )
        return Rolled(out)

    def _make_room(self, count: int, length: int, steps: int) -> int:
        """Make room for so many more pieces; the place of the first."""
        fits = (length, steps + 1) == (self._pieces.shape[1], self._states.shape[1])
        if not fits:
            self._count = 0
        before = self._count
        self._count += count
        if not fits or self._count > len(self._pieces):
            room = 2 * self._count
            pieces, states = np.empty((room, length)), np.empty((room, steps + 1, _STATE))
            moving = np.empty((room, steps + 1, self._moving.shape[2]))
            if before > 0:
                pieces[:before], states[:before] = self._pieces[:before], self._states[:before]
                moving[:before] = self._moving[:before]
            self._pieces, self._states, self._moving = pieces, states, moving
        return before


@inlined
def _sine_cosine(x: float) -> tuple[float, float]:
    """Sine and cosine of x, within 2^-52 for up to 10^5 turns.

    The polynomials of fdlibm (Sun Microsystems, 1993). A loop over them is made for several numbers
    at once, and their bits do not depend on the library of a machine.
    """
    k = np.floor(x * 0.6366197723675814 + 0.5)  # quarters of a turn
    r = ((x - k * 1.57079632673412561417) - k * 6.07710050630396597660e-11) - (
        k * 2.02226624879595063154e-21
    )
    z = r * r
    s = 2.75573137070700676789e-06 + z * (
        -2.50507602534068634195e-08 + z * 1.58969099521155010221e-10
    )
    s = 8.33333333332248946124e-03 + z * (-1.98412698298579493134e-04 + z * s)
    s = r + r * z * (-1.66666666666666324348e-01 + z * s)
    c = -2.75573143513906633035e-07 + z * (
        2.08757232129817482790e-09 + z * -1.13596475577881948265e-11
    )
    c = -1.38888888888741095749e-03 + z * (2.48015872894767294178e-05 + z * c)
    c = 1.0 - 0.5 * z + z * z * (4.16666666666666019037e-02 + z * c)
    quarter = k - 4.0 * np.floor(0.25 * k)
    back = np.floor(0.5 * quarter)
    side, sign = quarter - 2.0 * back, 1.0 - 2.0 * back
    return sign * ((1.0 - side) * s + side * c), sign * ((1.0 - side) * c - side * s)


@compiled("float64(float64[::1], float64[::1], float64)", makes_arrays=False)
def _area(total: Floats, track: Floats, at: float) -> float:
    """Integral of the track's angles from its start to a place."""
    k = min(max(int(at), 0), len(track) - 1)
    return float(total[k] + (at - k) * track[k])


@compiled(
    "void(float64[::1], float64[::1], float64, float64[::1], int64[::1], float64[::1],"
    " float64[::1])",
    makes_arrays=False,
)
def _lay(
    total: Floats,
    track: Floats,
    head: float,
    edges: Floats,
    group: Ints,
    groups: Floats,
    table: Floats,
) -> None:
    """Write headings of the links and their centres about that of mass, in the track's frame.

    They are the table's of after a step; ``groups`` gets the headings of the groups of links.
    """
    ahead = _area(total, track, head - edges[0])
    for g in range(len(groups)):
        behind = _area(total, track, head - edges[g + 1])
        groups[g] = (ahead - behind) / (edges[g + 1] - edges[g])
        ahead = behind
    links = len(group)
    for i in range(links):
        table[i // LANES * _ROWS + _NEXT + i % LANES] = groups[group[i]]
    for g in range(len(table) // _ROWS):
        link = table[g * _ROWS : (g + 1) * _ROWS]
        for j in range(LANES):
            sine, cosine = _sine_cosine(link[_NEXT + j])
            link[_COS + j], link[_SIN + j] = link[_HALF + j] * cosine, link[_HALF + j] * sine
    x = y = sum_x = sum_y = whole = 0.0
    for i in range(links):
        at = i // LANES * _ROWS + i % LANES
        c, s, weight = table[at + _COS], table[at + _SIN], table[at + _WEIGHT]
        x, y = x - c, y - s
        table[at + _NEXT_X], table[at + _NEXT_Y] = x, y
        sum_x, sum_y, whole = sum_x + weight * x, sum_y + weight * y, whole + weight
        x, y = x - c, y - s
    centre_x, centre_y = sum_x / whole, sum_y / whole
    for g in range(len(table) // _ROWS):
        link = table[g * _ROWS : (g + 1) * _ROWS]
        for j in range(LANES):
            link[_NEXT_X + j] -= centre_x
            link[_NEXT_Y + j] -= centre_y


@compiled("void(float64[::1], float64[::1], boolean)", makes_arrays=False)
def _keep(table: Floats, moving: Floats, out: bool) -> None:
    """Copy how the links move out of a table, or into it."""
    for g in range(len(table) // _ROWS):
        link, kept = table[g * _ROWS : (g + 1) * _ROWS], moving[2 * g * LANES :]
        for j in range(2 * LANES):
            if out:
                kept[j] = link[MOVING_X + j]
            else:
                link[MOVING_X + j] = kept[j]


@compiled("void(float64[::1])", makes_arrays=False)
def _stand_there(table: Floats) -> None:
    """Make of the body after the step the one before the next."""
    for g in range(len(table) // _ROWS):
        link = table[g * _ROWS : (g + 1) * _ROWS]
        for j in range(3 * LANES):
            link[_HERE + j] = link[_NEXT + j]


@compiled("UniTuple(float64, 2)(float64[:, ::1], int64, float64, float64)", makes_arrays=False)
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
    "void(float64[::1], float64[:, ::1], float64[::1], float64, float64, float64)",
    makes_arrays=False,
)
def _note(state: Floats, path: Floats, waypoint: Floats, x: float, y: float, dt: float) -> None:
    """Take into a state (11,) that its body has come to (x, y) within ``dt``."""
    state[0], state[1] = x, y
    state[3], state[4] = _nearest(path, int(state[3]), x, y)
    state[5] += state[4] * state[4]
    state[6] += dt
    dx, dy = x - waypoint[0], y - waypoint[1]
    state[10] = min(state[10], dx * dx + dy * dy)


@compiled(
    "float64(float64[::1], int64, float64, float64)", divides_by_zero=True, makes_arrays=False
)
def _turned(table: Floats, links: int, offset_rad: float, step_s: float) -> float:
    """Write the body between two steps in the world, and how its links move; its mean heading."""
    s, c = _sine_cosine(offset_rad)
    for g in range(len(table) // _ROWS):
        link = table[g * _ROWS : (g + 1) * _ROWS]
        for j in range(LANES):
            here_x, here_y = link[_HERE_X + j], link[_HERE_Y + j]
            next_x, next_y = link[_NEXT_X + j], link[_NEXT_Y + j]
            x, y = 0.5 * (here_x + next_x), 0.5 * (here_y + next_y)
            link[POINT_X + j], link[POINT_Y + j] = c * x - s * y, s * x + c * y
            x, y = (next_x - here_x) / step_s, (next_y - here_y) / step_s
            link[SHAPE_X + j], link[SHAPE_Y + j] = c * x - s * y, s * x + c * y
            heading = offset_rad + 0.5 * (link[_HERE + j] + link[_NEXT + j])
            sine, cosine = _sine_cosine(heading)
            link[FORWARD_X + j], link[FORWARD_Y + j] = cosine, sine
    mean = 0.0
    for i in range(links):
        at = i // LANES * _ROWS + i % LANES
        mean += table[at + _HERE] + table[at + _NEXT]
    return float(offset_rad + 0.5 * mean / links)


@compiled("float64(float64[::1], float64[::1], float64, float64, float64)", makes_arrays=False)
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


@compiled(f"void({FIELD}, float64, float64, float64[::1], int64, float64[::1])", makes_arrays=False)
def _pull(
    z_m: Floats,
    x0: float,
    y0: float,
    spacing: float,
    x: float,
    y: float,
    table: Floats,
    links: int,
    linear: Floats,
) -> None:
    """Write each link's load, and add the slope's force and moment on all, in mean link weights."""
    for i in range(links):
        at = i // LANES * _ROWS + i % LANES
        px, py = table[at + POINT_X], table[at + POINT_Y]
        _, gx, gy = plane(z_m, x0, y0, spacing, x + px, y + py)
        normal = table[at + _WEIGHT] / np.sqrt(1.0 + gx * gx + gy * gy)
        fx, fy = -gx * normal, -gy * normal
        table[at + NORMAL] = normal
        linear[0] += fx
        linear[1] += fy
        linear[2] += px * fy - py * fx


@compiled(
    "void(float64[::1], int64, float64[::1], float64[::1], float64, float64[::1], float64[:, ::1])",
    makes_arrays=False,
)
def _slide(
    table: Floats,
    links: int,
    body: Floats,
    linear: Floats,
    step_s: float,
    velocity: Floats,
    work: Floats,
) -> None:
    """Balance friction, with inertia where nothing holds the body; write how body and links move.

    ``velocity`` (3,) and what moves in the table are those of the step before; ``work`` (9, 3).
    """
    quadratic = work[6:]
    quadratic[:] = 0.0
    along, across = body[0], body[1]
    if not balance(table, _ROWS, links, along, across, linear, quadratic, velocity, work[:6]):
        add_inertia(table, _ROWS, links, step_s, linear, quadratic)
        balance(table, _ROWS, links, along, across, linear, quadratic, velocity, work[:6])
    x, y, turn = velocity[0], velocity[1], velocity[2]
    for g in range(len(table) // _ROWS):
        link = table[g * _ROWS : (g + 1) * _ROWS]
        for j in range(LANES):
            link[MOVING_X + j] = link[SHAPE_X + j] + x - turn * link[POINT_Y + j]
            link[MOVING_Y + j] = link[SHAPE_Y + j] + y + turn * link[POINT_X + j]


@compiled(
    "void(float64[::1], int64, float64, float64, float64, float64[:, ::1], int64, float64,"
    " float64[::1])",
    makes_arrays=False,
)
def _write_result(
    state: Floats,
    steps: int,
    heading: float,
    head_x: float,
    head_y: float,
    path: Floats,
    path_at: int,
    waypoint_at: float,
    row: Floats,
) -> None:
    """Write the columns of ``Rolled`` (10,) from the state (11,) after all steps.

    ``heading`` is the links' mean, and the head link is at (head_x, head_y) about the centre, both
    in the track's frame.
    """
    x, y, phi, place = state[0], state[1], state[2], state[3]
    k = min(int(place) + _AHEAD, len(path) - 2)
    error = phi + heading
    error -= np.arctan2(path[k + 1, 1] - path[k, 1], path[k + 1, 0] - path[k, 0])
    c, s = np.cos(phi), np.sin(phi)
    head_x, head_y = x + c * head_x - s * head_y, y + s * head_x + c * head_y
    row[0], row[1], row[2] = x, y, phi
    row[OFF_PATH], row[END_OFF] = np.sqrt(state[5] / steps), state[4]
    row[HEAD_OFF] = _nearest(path, k, head_x, head_y)[1]
    row[HEADING] = error - 2.0 * np.pi * np.floor(error / (2.0 * np.pi) + 0.5)
    row[PASSED] = np.sqrt(state[10]) if place >= waypoint_at else 0.0
    row[ALONG], row[TIME] = PATH_STEP_M * (place - path_at), state[6]


@compiled("UniTuple(int64, 2)(float64[:, ::1], int64)", makes_arrays=False)
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
    f" {FIELD}, boolean, float64[::1], float64[::1], int64[::1], float64[::1],"
    " float64[:, ::1], int64, float64[::1], float64, float64[::1], float64[:, :, ::1],"
    " float64[:, :, ::1], float64[:, ::1])"
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
    level: bool,
    table: Floats,
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
        level: whether it is all of one height.
        table: of the links: half lengths and weights are read, all else is overwritten.
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
        movings: (P, steps + 1, m) velocities of the links; kept as ``states`` are.
        out: written.

    """
    known, new, links, steps = len(samples), pieces.shape[1], len(group), states.shape[1] - 1
    track, total = np.empty(known + new), np.zeros(known + new + 1)
    here_g, next_g = np.empty(len(edges) - 1), np.empty(len(edges) - 1)
    velocity, linear, work = np.empty(3), np.empty(3), np.empty((9, 3))
    for g in range(len(table) // _ROWS):
        link = table[g * _ROWS : (g + 1) * _ROWS]
        for j in range(LANES):
            link[NORMAL + j] = link[_WEIGHT + j]
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
        velocity[:] = state[7:10]
        _keep(table, movings[c, begin], False)
        _lay(total, track, at, edges, group, here_g, table)
        _stand_there(table)
        for n in range(begin, steps):
            at += step
            _lay(total, track, at, edges, group, next_g, table)
            dt = step / _pulse_rate(here_g, next_g, step, cruise, body[2])
            mean = _turned(table, links, phi, dt)
            linear[:] = 0.0
            if not level:
                _pull(z_m, x0, y0, spacing, x, y, table, links, linear)
            _slide(table, links, body, linear, dt, velocity, work)
            ahead, left = step * np.cos(mean), step * np.sin(mean)
            x += velocity[0] * dt + ahead * drift[0] - left * drift[1]
            y += velocity[1] * dt + left * drift[0] + ahead * drift[1]
            phi += velocity[2] * dt + step * drift[2]
            here_g, next_g = next_g, here_g
            _stand_there(table)
            states[c, n + 1] = state
            _keep(table, movings[c, n + 1], True)
            state = states[c, n + 1]
            _note(state, path, waypoint, x, y, dt)
            state[2], state[7:10] = phi, velocity
        heading = 0.0
        for i in range(links):
            heading += table[i // LANES * _ROWS + _HERE + i % LANES]
        _write_result(
            *(state, steps, heading / links, table[_HERE_X], table[_HERE_Y]),
            *(path, path_at, waypoint[2], out[c - before]),
        )
