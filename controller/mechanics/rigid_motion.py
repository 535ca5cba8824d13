"""The rigid velocity (vx, vy, omega) of a planar body whose shape changes on dry friction.

Without inertia the ground's forces and moment sum to zero. With the Coulomb ellipse this is the
minimum of the dissipated power, which is convex, so Newton's method finds it. On a slope gravity's
power, linear in the velocity, is subtracted; a minimum is missing if the slope exceeds friction.

The other laws (``config.friction_law``), and an ellipse with a coefficient backward, go through
``force_balance``. ``wheels`` has such a power as well. ``scales`` has none: Newton's method finds
where the forces vanish, and falls back to a fixed point iteration.
"""

from typing import NamedTuple

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.constants import GRAVITY_M_S2
from snakewalk.config.friction_law import ELLIPSE
from snakewalk.config.world import FrictionConfig
from snakewalk.controller.mechanics.force_balance import balance_forces
from snakewalk.controller.mechanics.link_table import (
    FORWARD_X,
    FORWARD_Y,
    GRIP,
    LANES,
    MOVING_X,
    MOVING_Y,
    NORMAL,
    OTHERS,
    POINT_X,
    POINT_Y,
    SHAPE_X,
    SHAPE_Y,
    link_table,
)
from snakewalk.drivers.compiling import compiled, readonly_array

_STILL_SPEED_M_S = 1e-4  # smooths the kink of |v| at rest
_STEPS = 50
_POWER_TOLERANCE = 1e-8
"""Share of the power from which on what Newton's next step leaves is beyond notice: it squares."""
_NO_QUADRATIC = np.zeros((3, 3))

_SLIDES = 9 * LANES
"""Where the rows of ``_power`` begin: 14 that it reads, 11 that it writes."""


class NoBalanceError(ArithmeticError):
    """The slope's load exceeds friction: without inertia, the velocity is infinite."""


class Inertia(NamedTuple):
    """Motion of a body with inertia before a step."""

    before_m_s: Floats
    """(L, 2) velocities of the links at the start of the step, in the body frame."""
    step_s: float


def rigid_velocity(
    points_m: Floats,
    headings_rad: Floats,
    shape_m_s: Floats,
    friction: FrictionConfig,
    guess: Floats | None = None,
    *,
    tangential: Floats | None = None,
    normal: Floats | None = None,
    inertia: Inertia | None = None,
) -> Floats:
    """Velocity (vx, vy, omega) of a body frame at its origin that balances friction.

    With inertia it is the velocity at the end of a step (implicit Euler). The power gains half the
    squared change of the links' velocity, times ``1 / (g step)`` per weight. A body beyond the
    friction limit then accelerates at a finite rate.

    Args:
        points_m: (L, 2) link centres in the body frame.
        headings_rad: (L,) link headings in the body frame.
        shape_m_s: (L, 2) velocities of the links relative to the body frame.
        friction: of the ground.
        guess: start of the iteration, the last solution in a sequence.
        tangential: (L, 2) gravity along the ground on each link, in the body frame, in weights of a
            link: ``sin(slope)`` down the slope. None is level ground.
        normal: (L,) load of each link on the ground, in weights of a link: ``cos(slope)``.
        inertia: motion before the step; None of a body without inertia.

    Returns:
        (3,) m/s, m/s, rad/s.

    Raises:
        NoBalanceError: the slope's load exceeds friction, and the body has no inertia.

    """
    velocity = np.zeros(3) if guess is None else np.array(guess, dtype=float)
    linear = np.zeros(3) if tangential is None else _wrench(points_m, tangential)
    before_m_s, step_s = inertia or (None, None)
    table = _table(points_m, headings_rad, shape_m_s, normal, before_m_s)
    if not _minimise(table, len(points_m), friction, linear, velocity, step_s) and not inertia:
        raise NoBalanceError
    return velocity


def _table(
    points_m: Floats,
    headings_rad: Floats,
    shape_m_s: Floats,
    normal: Floats | None,
    before_m_s: Floats | None = None,
) -> Floats:
    links = len(points_m)
    table = link_table(links)
    groups = table.reshape(-1, OTHERS)
    columns: tuple[tuple[int, Floats], ...] = (
        (POINT_X, points_m[:, 0]),
        (POINT_Y, points_m[:, 1]),
        (FORWARD_X, np.cos(headings_rad)),
        (FORWARD_Y, np.sin(headings_rad)),
        (SHAPE_X, shape_m_s[:, 0]),
        (SHAPE_Y, shape_m_s[:, 1]),
        (NORMAL, np.ones(links) if normal is None else normal),
    )
    if before_m_s is not None:
        columns += ((MOVING_X, before_m_s[:, 0]), (MOVING_Y, before_m_s[:, 1]))
    for row, values in columns:
        padded = np.zeros(len(groups) * LANES)
        padded[:links] = values
        groups[:, row : row + LANES] = padded.reshape(-1, LANES)
    return table


def _minimise(
    table: Floats,
    links: int,
    friction: FrictionConfig,
    linear: Floats,
    velocity: Floats,
    step_s: float | None = None,
) -> bool:
    """``balance`` of a whole table; with a step, of a body with inertia."""
    quadratic = _NO_QUADRATIC
    if step_s is not None:
        quadratic = np.empty((3, 3))
        add_inertia(table, OTHERS, links, step_s, linear, quadratic)
    return balance(
        table,
        OTHERS,
        links,
        friction.grip,
        linear,
        quadratic,
        velocity,
        np.empty((9, 3)),
    )


@compiled(
    "void(float64[::1], int64, int64, float64, float64[::1], float64[:, ::1])", makes_arrays=False
)
def add_inertia(
    table: Floats, rows: int, links: int, step_s: float, linear: Floats, quadratic: Floats
) -> None:
    """Add the inertia of a step to the power per weight of a link; see ``Inertia``.

    Args:
        table: from ``link_table``; centres, change of shape and previous movement are read.
        rows: of the table.
        links: number of links.
        step_s: duration.
        linear: (3,) gains the part that is linear in (vx, vy, omega).
        quadratic: (3, 3) out: coefficients of their products.

    """
    mass = 1.0 / (GRAVITY_M_S2 * step_s)
    quadratic[:] = 0.0
    for k in range(links):
        base = k // LANES * rows + k % LANES
        x, y = table[base + POINT_X], table[base + POINT_Y]
        px = mass * (table[base + MOVING_X] - table[base + SHAPE_X])
        py = mass * (table[base + MOVING_Y] - table[base + SHAPE_Y])
        linear[0] += px
        linear[1] += py
        linear[2] += x * py - y * px
        quadratic[0, 0] += mass
        quadratic[1, 1] += mass
        quadratic[2, 2] += mass * (x * x + y * y)
        quadratic[0, 2] -= mass * y
        quadratic[1, 2] += mass * x
    quadratic[2, 0], quadratic[2, 1] = quadratic[0, 2], quadratic[1, 2]


def _wrench(points_m: Floats, force: Floats) -> Floats:
    """Sum (3,) of forces (L, 2) and of their moments about the origin."""
    (px, py), (x, y) = force.T, points_m.T
    return np.array([px.sum(), py.sum(), x @ py - y @ px])


@compiled("void(float64[::1], int64, float64, float64)", makes_arrays=False)
def _write_weighted_rows(table: Floats, rows: int, along: float, across: float) -> None:
    """Write the rows that ``_power`` reads, weighted by load and friction.

    They contain the derivatives of each link's velocity along and across itself by (vx, vy, omega)
    and the contribution of the change of shape to both. They also contain the lower triangle of the
    product of the first rows with their transpose.
    """
    for group in range(len(table) // rows):
        link = table[group * rows : (group + 1) * rows]
        for j in range(LANES):
            c, s = link[FORWARD_X + j], link[FORWARD_Y + j]
            x, y = link[POINT_X + j], link[POINT_Y + j]
            u, v = link[SHAPE_X + j], link[SHAPE_Y + j]
            ahead = along * link[NORMAL + j]
            aside = across * link[NORMAL + j]
            a0, a1, a2 = c * ahead, s * ahead, (s * x - c * y) * ahead
            b0, b1, b2 = -s * aside, c * aside, (c * x + s * y) * aside
            link[_SLIDES + j], link[_SLIDES + 8 + j], link[_SLIDES + 16 + j] = a0, a1, a2
            link[_SLIDES + 24 + j], link[_SLIDES + 32 + j], link[_SLIDES + 40 + j] = b0, b1, b2
            link[_SLIDES + 48 + j] = (c * u + s * v) * ahead
            link[_SLIDES + 56 + j] = (c * v - s * u) * aside
            link[_SLIDES + 64 + j] = a0 * a0 + b0 * b0
            link[_SLIDES + 72 + j] = a1 * a0 + b1 * b0
            link[_SLIDES + 80 + j] = a1 * a1 + b1 * b1
            link[_SLIDES + 88 + j] = a2 * a0 + b2 * b0
            link[_SLIDES + 96 + j] = a2 * a1 + b2 * b1
            link[_SLIDES + 104 + j] = a2 * a2 + b2 * b2


@compiled(
    f"UniTuple(float64, 2)(float64[::1], int64, int64, float64, {readonly_array(layout='C')},"
    f" {readonly_array(dimensions=2, layout='C')}, float64[::1], float64[::1], float64[:, ::1])",
    divides_by_zero=True,
    makes_arrays=False,
)
def _power(
    table: Floats,
    rows: int,
    links: int,
    still: float,
    linear: Floats,
    quadratic: Floats,
    w: Floats,
    gradient: Floats,
    hessian: Floats,
) -> tuple[float, float]:
    """Return the dissipated power less gravity's, and the power without a change of shape.

    ``LANES`` links are computed at once and added in their order, so that the bits do not depend on
    the processor.

    Args:
        table: from ``_write_weighted_rows``.
        rows: of the table.
        links: number of links.
        still: ``_STILL_SPEED_M_S``, weighted.
        linear: as in ``balance``.
        quadratic: as in ``balance``.
        w: (3,) velocity.
        gradient: (3,) out.
        hessian: (3, 3) out: its lower triangle.

    """
    x = w[0]
    y = w[1]
    turn = w[2]
    square = still * still
    power = rigid = 0.0
    g0, g1, g2 = -linear[0], -linear[1], -linear[2]
    h00, h10, h11 = quadratic[0, 0], quadratic[1, 0], quadratic[1, 1]
    h20, h21, h22 = quadratic[2, 0], quadratic[2, 1], quadratic[2, 2]
    for group in range(len(table) // rows):
        link = table[group * rows + _SLIDES : group * rows + OTHERS]
        for j in range(LANES):
            a0, a1, a2 = link[j], link[8 + j], link[16 + j]
            b0, b1, b2 = link[24 + j], link[32 + j], link[40 + j]
            u, v = a0 * x + a1 * y + a2 * turn, b0 * x + b1 * y + b2 * turn
            link[112 + j] = np.sqrt(u * u + v * v)
            u, v = u + link[48 + j], v + link[56 + j]
            size = np.sqrt(u * u + v * v + square)
            link[120 + j] = size
            inverse = 1.0 / size
            u, v = u * inverse, v * inverse
            d0, d1, d2 = u * a0 + v * b0, u * a1 + v * b1, u * a2 + v * b2
            link[128 + j], link[136 + j], link[144 + j] = d0, d1, d2
            link[152 + j] = (link[64 + j] - d0 * d0) * inverse
            link[160 + j] = (link[72 + j] - d1 * d0) * inverse
            link[168 + j] = (link[80 + j] - d1 * d1) * inverse
            link[176 + j] = (link[88 + j] - d2 * d0) * inverse
            link[184 + j] = (link[96 + j] - d2 * d1) * inverse
            link[192 + j] = (link[104 + j] - d2 * d2) * inverse
        for j in range(min(LANES, links - group * LANES)):
            rigid = rigid + link[112 + j]
            power = power + link[120 + j]
            g0, g1, g2 = g0 + link[128 + j], g1 + link[136 + j], g2 + link[144 + j]
            h00, h10, h11 = h00 + link[152 + j], h10 + link[160 + j], h11 + link[168 + j]
            h20, h21, h22 = h20 + link[176 + j], h21 + link[184 + j], h22 + link[192 + j]
    hessian[0, 0], hessian[1, 0], hessian[1, 1] = h00, h10, h11
    hessian[2, 0], hessian[2, 1], hessian[2, 2] = h20, h21, h22
    gradient[0], gradient[1], gradient[2] = g0, g1, g2
    for i in range(3):
        power -= linear[i] * w[i]
        for j in range(3):
            gradient[i] += quadratic[i, j] * w[j]
            power += 0.5 * quadratic[i, j] * w[i] * w[j]
    return power, rigid


@compiled(
    "void(float64[:, ::1], float64[::1], float64[::1])", divides_by_zero=True, makes_arrays=False
)
def _solve(hessian: Floats, gradient: Floats, step: Floats) -> None:
    """Solve for Newton's step (3,) by Cholesky without roots; unrolled for speed."""
    d0 = 1.0 / hessian[0, 0]
    l10, l20 = hessian[1, 0] * d0, hessian[2, 0] * d0
    d1 = 1.0 / (hessian[1, 1] - l10 * hessian[1, 0])
    h21 = hessian[2, 1] - l20 * hessian[1, 0]
    l21 = h21 * d1
    d2 = 1.0 / (hessian[2, 2] - l20 * hessian[2, 0] - l21 * h21)
    y1 = gradient[1] - l10 * gradient[0]
    z = (gradient[2] - l20 * gradient[0] - l21 * y1) * d2
    y = y1 * d1 - l21 * z
    step[0], step[1], step[2] = gradient[0] * d0 - l10 * y - l20 * z, y, z


@compiled(
    f"boolean(float64[::1], int64, int64, {GRIP}, float64[::1], float64[:, ::1],"
    " float64[::1], float64[:, ::1])",
    makes_arrays=False,
)
def balance(  # noqa: C901  a compiled loop
    table: Floats,
    rows: int,
    links: int,
    grip: tuple[float, float, float, float],
    linear: Floats,
    quadratic: Floats,
    w: Floats,
    work: Floats,
) -> bool:
    """Balance friction by Newton's method from ``w`` (3,), in place; whether it is possible.

    ``table`` is from ``link_table``, with ``rows``; ``grip`` is ``FrictionConfig.grip``. ``linear``
    (3,) is gravity's power per (vx, vy, omega), ``quadratic`` (3, 3) that of inertia. ``work`` (9,
    3) is overwritten.
    """
    along, across, back, law = grip
    if law != ELLIPSE or back != along:
        return balance_forces(table, rows, links, grip, linear, quadratic, w, work)
    _write_weighted_rows(table, rows, along, across)
    still = _STILL_SPEED_M_S * across
    gradient = work[0]
    step = work[1]
    trial = work[2]
    hessian = work[3:6]
    may_slide = not quadratic.any() and (linear[0] != 0.0 or linear[1] != 0.0 or linear[2] != 0.0)
    best, _ = _power(table, rows, links, still, linear, quadratic, w, gradient, hessian)
    for _ in range(_STEPS):
        steepest = max(abs(gradient[0]), abs(gradient[1]), abs(gradient[2]))
        if steepest < 1e-9 * links * across:
            break
        for i in range(3):
            hessian[i, i] += 1e-9
        _solve(hessian, gradient, step)
        fall = gradient[0] * step[0] + gradient[1] * step[1] + gradient[2] * step[2]
        if fall < _POWER_TOLERANCE * abs(best):
            for i in range(3):
                w[i] -= step[i]
            break
        now = np.inf
        scale = 2.0
        while now > best - 1e-4 * scale * fall and scale > 1e-9:
            scale *= 0.5
            for i in range(3):
                trial[i] = w[i] - scale * step[i]
            now, rigid = _power(
                table, rows, links, still, linear, quadratic, trial, gradient, hessian
            )
        if now >= best:
            break
        for i in range(3):
            w[i] = trial[i]
        best = now
        gain = linear[0] * w[0] + linear[1] * w[1] + linear[2] * w[2]
        if may_slide and rigid < (1.0 - 1e-9) * gain:
            return False  # gravity exceeds friction at any speed in this direction
    return True


def planar_slide(
    headings_rad: Floats,
    points_m: Floats,
    step_s: Floats,
    heading_rad: float,
    friction: FrictionConfig,
    load: Floats | None = None,
) -> tuple[float, float, float]:
    """Return the slide of a body that passes through ``n`` shapes.

    Args:
        headings_rad: (n, L) of the links, about the body's.
        points_m: (n, L, 2) their centres about the body's, in its frame.
        step_s: (n - 1,) between the shapes.
        heading_rad: initial heading of the body.
        friction: of the ground.
        load: (n, L, 3) gravity on each link in weights of a link, x and y along the ground in the
            world and z into it. None: a level floor, on which every link carries the same weight.

    Returns:
        Displacement x, y of the body's centre, m, and its final heading. Where friction no longer
        holds the body, it slides with inertia.

    """
    shapes, links = headings_rad.shape
    if load is None:
        load = np.zeros((shapes, links, 3))
        load[:, :, 2] = 1.0
    return _slide_through(
        headings_rad, points_m, step_s, heading_rad, friction.grip, load, link_table(links)
    )


@compiled("void(float64[::1], int64, float64[::1])", makes_arrays=False)
def _note_movement(table: Floats, links: int, velocity: Floats) -> None:
    for k in range(links):
        base = k // LANES * OTHERS + k % LANES
        x, y = table[base + POINT_X], table[base + POINT_Y]
        table[base + MOVING_X] = table[base + SHAPE_X] + velocity[0] - velocity[2] * y
        table[base + MOVING_Y] = table[base + SHAPE_Y] + velocity[1] + velocity[2] * x


@compiled(
    f"UniTuple(float64, 3)(float64[:, ::1], float64[:, :, ::1], float64[::1], float64, {GRIP},"
    " float64[:, :, ::1], float64[::1])"
)
def _slide_through(
    headings: Floats,
    points: Floats,
    step_s: Floats,
    heading: float,
    grip: tuple[float, float, float, float],
    load: Floats,
    table: Floats,
) -> tuple[float, float, float]:
    """``planar_slide`` with a ``link_table``, which is overwritten."""
    links = headings.shape[1]
    linear = np.zeros(3)
    velocity = np.zeros(3)
    quadratic = np.zeros((3, 3))
    work = np.empty((9, 3))
    x_m = 0.0
    y_m = 0.0
    for n in range(len(step_s)):
        dt, c, s = step_s[n], np.cos(heading), np.sin(heading)
        linear[:] = 0.0
        for k in range(links):
            base = k // LANES * OTHERS + k % LANES
            point, there = points[n, k], points[n + 1, k]
            x, y = 0.5 * (point[0] + there[0]), 0.5 * (point[1] + there[1])
            east, north = c * x - s * y, s * x + c * y
            table[base + POINT_X], table[base + POINT_Y] = east, north
            x, y = (there[0] - point[0]) / dt, (there[1] - point[1]) / dt
            table[base + SHAPE_X], table[base + SHAPE_Y] = c * x - s * y, s * x + c * y
            angle = heading + 0.5 * (headings[n, k] + headings[n + 1, k])
            table[base + FORWARD_X], table[base + FORWARD_Y] = np.cos(angle), np.sin(angle)
            pull = load[n, k]
            table[base + NORMAL] = pull[2]
            linear[0] += pull[0]
            linear[1] += pull[1]
            linear[2] += east * pull[1] - north * pull[0]
        quadratic[:] = 0.0
        if not balance(table, OTHERS, links, grip, linear, quadratic, velocity, work):
            add_inertia(table, OTHERS, links, dt, linear, quadratic)
            balance(table, OTHERS, links, grip, linear, quadratic, velocity, work)
        _note_movement(table, links, velocity)
        x_m, y_m = x_m + velocity[0] * dt, y_m + velocity[1] * dt
        heading += velocity[2] * dt
    return x_m, y_m, heading
