"""The compiled loops of rollouts; ``controller.mechanics.rollout`` explains the model."""

import numpy as np

from snakewalk.config.arrays import Floats, Ints
from snakewalk.controller.mechanics.ground_step import FIELD, plane
from snakewalk.controller.mechanics.link_table import (
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
)
from snakewalk.controller.mechanics.rigid_motion import add_inertia, balance
from snakewalk.drivers.compiling import compiled, inlined, readonly_array

_POINTS_BACK = 5
_POINTS_AHEAD = 40
"""Points of the path among which a place is looked for after a step."""
_DIRECTION_POINTS = 30
"""Points of the path from the centre to where its direction is compared."""
STATE = 11
"""Numbers of a body between two steps."""
HALF, WEIGHT, _HERE, _HERE_X, _HERE_Y = range(OTHERS, OTHERS + 5 * LANES, LANES)
"""Rows of a rollout's table of links: half length and weight; heading and centre about that of
mass, in the track's frame."""
_NEXT, _NEXT_X, _NEXT_Y, _COS, _SIN = range(OTHERS + 5 * LANES, OTHERS + 10 * LANES, LANES)
"""The same after the step; a cosine and a sine."""
ROWS = OTHERS + 10 * LANES
OFF_PATH, END_OFF, HEAD_OFF, HEADING, PASSED, ALONG, TIME = range(3, 10)
"""Columns of the result of a piece."""
COLUMNS = 10
PATH_STEP_M = 0.01


@compiled("UniTuple(float64, 2)(float64[:, ::1], int64, float64, float64)", makes_arrays=False)
def _nearest_index(path: Floats, start_index: int, x: float, y: float) -> tuple[float, float]:
    """Index on the path near ``start_index``, and the signed distance, positive to its left."""
    last = len(path) - 2
    best = start_index
    least = np.inf
    for k in range(max(start_index - _POINTS_BACK, 0), min(start_index + _POINTS_AHEAD, last) + 1):
        dx, dy = x - path[k, 0], y - path[k, 1]
        square = dx * dx + dy * dy
        if square < least:
            least = square
            best = k
    tx, ty = path[best + 1, 0] - path[best, 0], path[best + 1, 1] - path[best, 1]
    dx, dy = x - path[best, 0], y - path[best, 1]
    side = tx * dy - ty * dx
    return float(best), (1.0 if side >= 0.0 else -1.0) * np.sqrt(least)


@compiled(
    "void(float64[::1], float64[:, ::1], float64[::1], float64, float64, float64)",
    makes_arrays=False,
)
def note_place(
    state: Floats, path: Floats, waypoint: Floats, x: float, y: float, dt: float
) -> None:
    """Record in a state (11,) that its body is at (x, y) after ``dt``."""
    state[0], state[1] = x, y
    state[3], state[4] = _nearest_index(path, int(state[3]), x, y)
    state[5] += state[4] * state[4]
    state[6] += dt
    dx, dy = x - waypoint[0], y - waypoint[1]
    state[10] = min(state[10], dx * dx + dy * dy)


@inlined
def _sine_cosine(x: float) -> tuple[float, float]:
    """Sine and cosine of x, within 2^-52 for up to 10^5 turns.

    The polynomials of fdlibm (Sun Microsystems, 1993). The loop vectorises, and the bits do not
    depend on a machine's library.
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
    side = quarter - 2.0 * back
    sign = 1.0 - 2.0 * back
    return sign * ((1.0 - side) * s + side * c), sign * ((1.0 - side) * c - side * s)


@compiled("float64(float64[::1], float64[::1], float64)", makes_arrays=False)
def _area(total: Floats, track: Floats, position: float) -> float:
    """Integral of the track's angles from its start to ``position``."""
    k = min(max(int(position), 0), len(track) - 1)
    return float(total[k] + (position - k) * track[k])


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
    """Write the links' headings and centres about the centre of mass, in the track's frame.

    They go into the rows after a step; ``groups`` gets the headings of the groups of links.
    """
    ahead = _area(total, track, head - edges[0])
    for g in range(len(groups)):
        behind = _area(total, track, head - edges[g + 1])
        groups[g] = (ahead - behind) / (edges[g + 1] - edges[g])
        ahead = behind
    links = len(group)
    for i in range(links):
        table[i // LANES * ROWS + _NEXT + i % LANES] = groups[group[i]]
    for g in range(len(table) // ROWS):
        link = table[g * ROWS : (g + 1) * ROWS]
        for j in range(LANES):
            sine, cosine = _sine_cosine(link[_NEXT + j])
            link[_COS + j], link[_SIN + j] = link[HALF + j] * cosine, link[HALF + j] * sine
    x = y = sum_x = sum_y = total_mass = 0.0
    for i in range(links):
        base = i // LANES * ROWS + i % LANES
        c = table[base + _COS]
        s = table[base + _SIN]
        weight = table[base + WEIGHT]
        x, y = x - c, y - s
        table[base + _NEXT_X], table[base + _NEXT_Y] = x, y
        sum_x = sum_x + weight * x
        sum_y = sum_y + weight * y
        total_mass = total_mass + weight
        x, y = x - c, y - s
    centre_x, centre_y = sum_x / total_mass, sum_y / total_mass
    for g in range(len(table) // ROWS):
        link = table[g * ROWS : (g + 1) * ROWS]
        for j in range(LANES):
            link[_NEXT_X + j] -= centre_x
            link[_NEXT_Y + j] -= centre_y


@compiled("void(float64[::1], float64[::1], boolean)", makes_arrays=False)
def _store_state(table: Floats, moving: Floats, out: bool) -> None:
    for g in range(len(table) // ROWS):
        link = table[g * ROWS : (g + 1) * ROWS]
        kept = moving[2 * g * LANES :]
        for j in range(2 * LANES):
            if out:
                kept[j] = link[MOVING_X + j]
            else:
                link[MOVING_X + j] = kept[j]


@compiled("void(float64[::1])", makes_arrays=False)
def _stand_there(table: Floats) -> None:
    """Make the state after a step the state before the next."""
    for g in range(len(table) // ROWS):
        link = table[g * ROWS : (g + 1) * ROWS]
        for j in range(3 * LANES):
            link[_HERE + j] = link[_NEXT + j]


@compiled(
    "float64(float64[::1], int64, float64, float64)", divides_by_zero=True, makes_arrays=False
)
def _write_turned_body(table: Floats, links: int, offset_rad: float, step_s: float) -> float:
    """Write the body between two steps, and its links' velocities; return its mean heading."""
    s, c = _sine_cosine(offset_rad)
    for g in range(len(table) // ROWS):
        link = table[g * ROWS : (g + 1) * ROWS]
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
        base = i // LANES * ROWS + i % LANES
        mean += table[base + _HERE] + table[base + _NEXT]
    return float(offset_rad + 0.5 * mean / links)


@compiled("float64(float64[::1], float64[::1], float64, float64, float64)", makes_arrays=False)
def _pulse_rate(
    here_rad: Floats, next_rad: Floats, step: float, cruise: float, limit_rad_s: float
) -> float:
    """Segments per second between two sets of group headings, within the joints' speed."""
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
    """Write each link's load; add the slope's force and moment on all, in mean link weights."""
    for i in range(links):
        base = i // LANES * ROWS + i % LANES
        px, py = table[base + POINT_X], table[base + POINT_Y]
        _, gx, gy = plane(z_m, x0, y0, spacing, x + px, y + py)
        normal = table[base + WEIGHT] / np.sqrt(1.0 + gx * gx + gy * gy)
        fx, fy = -gx * normal, -gy * normal
        table[base + NORMAL] = normal
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
    """Balance friction, with inertia beyond the friction limit; write body and link velocities.

    ``velocity`` (3,) and the velocities in the table are those of the previous step; ``work`` is
    (12, 3).
    """
    quadratic = work[9:]
    quadratic[:] = 0.0
    grip = body[0], body[1], body[2], body[3]
    if not balance(table, ROWS, links, grip, linear, quadratic, velocity, work[:9]):
        add_inertia(table, ROWS, links, step_s, linear, quadratic)
        balance(table, ROWS, links, grip, linear, quadratic, velocity, work[:9])
    x = velocity[0]
    y = velocity[1]
    turn = velocity[2]
    for g in range(len(table) // ROWS):
        link = table[g * ROWS : (g + 1) * ROWS]
        for j in range(LANES):
            link[MOVING_X + j] = link[SHAPE_X + j] + x - turn * link[POINT_Y + j]
            link[MOVING_Y + j] = link[SHAPE_Y + j] + y + turn * link[POINT_X + j]


@compiled(
    "void(float64[::1], int64, float64, float64, float64, float64[:, ::1], int64, float64,"
    " float64[::1])",
    makes_arrays=False,
)
def write_result(
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

    ``heading`` is the links' mean; the head link is at (head_x, head_y) about the centre. Both are
    in the track's frame.
    """
    x = state[0]
    y = state[1]
    phi = state[2]
    place = state[3]
    k = min(int(place) + _DIRECTION_POINTS, len(path) - 2)
    error = phi + heading
    error -= np.arctan2(path[k + 1, 1] - path[k, 1], path[k + 1, 0] - path[k, 0])
    c, s = np.cos(phi), np.sin(phi)
    head_x, head_y = x + c * head_x - s * head_y, y + s * head_x + c * head_y
    row[0], row[1], row[2] = x, y, phi
    row[OFF_PATH], row[END_OFF] = np.sqrt(state[5] / steps), state[4]
    row[HEAD_OFF] = _nearest_index(path, k, head_x, head_y)[1]
    row[HEADING] = error - 2.0 * np.pi * np.floor(error / (2.0 * np.pi) + 0.5)
    row[PASSED] = np.sqrt(state[10]) if place >= waypoint_at else 0.0
    row[ALONG], row[TIME] = PATH_STEP_M * (place - path_at), state[6]


@compiled("UniTuple(int64, 2)(float64[:, ::1], int64)", makes_arrays=False)
def _longest_common_piece(pieces: Floats, piece: int) -> tuple[int, int]:
    """Return the earlier piece with the longest equal beginning (or -1), and its samples.

    If lengths are equal, the first is returned, because its common part is known.
    """
    best = -1
    longest = -1
    for other in range(piece):
        same = 0
        while same < pieces.shape[1] and pieces[other, same] == pieces[piece, same]:
            same += 1
        if same > longest:
            best = other
            longest = same
    return best, longest


@compiled(
    f"void({readonly_array(layout='C')}, float64[:, ::1], int64, float64, float64, float64[::1],"
    f" {FIELD}, boolean, float64[::1], float64[::1], int64[::1], float64[::1],"
    " float64[:, ::1], int64, float64[::1], float64, float64[::1], float64[:, :, ::1],"
    " float64[:, :, ::1], float64[:, ::1])"
)
def roll_pieces(
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
    """Roll out pieces (P, n) from number ``before``; ``out`` (C, 10) are columns of ``Rolled``.

    Args:
        samples: as in ``Rollout.begin``.
        pieces: including those before.
        before: number of pieces already rolled out.
        head: place on the track.
        step: of the head, segments.
        start: (3,) position of the body, and turn of the track.
        z_m: the ground.
        x0: its corner.
        y0: its corner.
        spacing: of its samples.
        level: whether all heights are equal.
        table: of the links: half lengths and weights are read, the rest is overwritten.
        edges: of the groups of links.
        group: (L,) of each link.
        body: (5,) ``FrictionConfig.grip``; speed limit of the joints.
        path: (m, 2) points.
        path_at: index on the path.
        waypoint: (3,) the next waypoint, and its index on the path.
        cruise: preferred segments per second.
        drift: (3,) added to each step.
        states: (P, steps + 1, 11) of each piece before each step, and at its end. The numbers are
        position (2) and
            turn, index on the path, distance from it, sum of squared distances, time, velocity (3),
            and smallest squared distance from the waypoint.
        movings: (P, steps + 1, m) velocities of the links, stored like ``states``.
        out: results.

    """
    history = len(samples)
    new = pieces.shape[1]
    links = len(group)
    steps = states.shape[1] - 1
    track = np.empty(history + new)
    total = np.zeros(history + new + 1)
    here_g, next_g = np.empty(len(edges) - 1), np.empty(len(edges) - 1)
    velocity = np.empty(3)
    linear = np.empty(3)
    work = np.empty((12, 3))
    for g in range(len(table) // ROWS):
        link = table[g * ROWS : (g + 1) * ROWS]
        for j in range(LANES):
            link[NORMAL + j] = link[WEIGHT + j]
    track[:history] = samples
    for c in range(before, len(pieces)):
        track[history:] = pieces[c]
        for k in range(history + new):
            total[k + 1] = total[k] + track[k]
        first_step = head
        begin = 0
        like, same = _longest_common_piece(pieces, c)
        if like < 0:
            states[c, 0, :3], states[c, 0, 3], states[c, 0, 4:] = start, path_at, 0.0
            states[c, 0, 10] = np.inf
            movings[c, 0] = 0.0
        else:
            while begin < steps and first_step + step <= history + same:
                first_step = first_step + step
                begin = begin + 1
            states[c, begin], movings[c, begin] = states[like, begin], movings[like, begin]
        state = states[c, begin]
        x = state[0]
        y = state[1]
        phi = state[2]
        velocity[:] = state[7:10]
        _store_state(table, movings[c, begin], False)
        _lay(total, track, first_step, edges, group, here_g, table)
        _stand_there(table)
        for n in range(begin, steps):
            first_step += step
            _lay(total, track, first_step, edges, group, next_g, table)
            dt = step / _pulse_rate(here_g, next_g, step, cruise, body[4])
            mean = _write_turned_body(table, links, phi, dt)
            linear[:] = 0.0
            if not level:
                _pull(z_m, x0, y0, spacing, x, y, table, links, linear)
            _slide(table, links, body, linear, dt, velocity, work)
            ahead = step * np.cos(mean)
            left = step * np.sin(mean)
            x += velocity[0] * dt + ahead * drift[0] - left * drift[1]
            y += velocity[1] * dt + left * drift[0] + ahead * drift[1]
            phi += velocity[2] * dt + step * drift[2]
            here_g, next_g = next_g, here_g
            _stand_there(table)
            states[c, n + 1] = state
            _store_state(table, movings[c, n + 1], True)
            state = states[c, n + 1]
            note_place(state, path, waypoint, x, y, dt)
            state[2], state[7:10] = phi, velocity
        heading = 0.0
        for i in range(links):
            heading += table[i // LANES * ROWS + _HERE + i % LANES]
        write_result(
            state,
            steps,
            heading / links,
            table[_HERE_X],
            table[_HERE_Y],
            path,
            path_at,
            waypoint[2],
            out[c - before],
        )
