"""The balance of friction by Newton's method on forces, for any law of friction.

``rigid_motion.balance`` calls it for every law but the ellipse without a coefficient backward.
"""

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.friction_law import ELLIPSE, SCALES, WHEELS, gauges
from snakewalk.controller.mechanics.link_table import (
    FORWARD_X,
    FORWARD_Y,
    GRIP,
    LANES,
    NORMAL,
    POINT_X,
    POINT_Y,
    SHAPE_X,
    SHAPE_Y,
)
from snakewalk.drivers.compiling import callable_in_loops, compiled, inlined, readonly_array

_STILL_SPEED_M_S = 1e-4  # smooths the kink of |v| at rest
_WHEEL_M_S = 1e-3
"""Speed that smooths the two kinks of a wheel at rest. A step of the simulator creeps faster."""
_SLIDES_M_S = 1e4
"""Speed beyond which friction does not hold a body."""
_STEPS = 50
callable_in_loops(gauges)


@inlined
def _of_link(
    law: int,
    along: float,
    across: float,
    ahead: float,
    aside: float,
    still: float,
) -> tuple[float, float, float, float, float, float, float]:
    """Power, resistance along and across, and its derivatives (2, 2), per load of a link."""
    share_a, share_c, gauge_a, gauge_c = gauges(law, along, across, ahead, aside)
    smooth = share_c * still
    gauge_a = np.sqrt(gauge_a * gauge_a + smooth * smooth)
    gauge_c = np.sqrt(gauge_c * gauge_c + smooth * smooth)
    aa, cc = along * share_a / gauge_a, across * share_c / gauge_c
    ac = ca = 0.0
    pull_a, pull_c = aa * ahead, cc * aside
    rub = gauge_a
    if law == WHEELS:
        rub = along * gauge_a + across * gauge_c
    # the square of a gauge grows by shares and velocities of both axes; of wheels, by its own
    by_a, by_c = share_a * share_a * ahead, share_c * share_c * aside
    aa -= pull_a * by_a / (gauge_a * gauge_a)
    cc -= pull_c * by_c / (gauge_c * gauge_c)
    if law != WHEELS:
        ac = -pull_a * by_c / (gauge_a * gauge_a)
        ca = -pull_c * by_a / (gauge_c * gauge_c)
    return rub, pull_a, pull_c, aa, ac, ca, cc


@compiled(
    f"UniTuple(float64, 2)(float64[::1], int64, int64, {GRIP}, float64, float64[::1],"
    f" {readonly_array(dimensions=2, layout='C')}, float64[::1], float64[::1], float64[:, ::1])",
    divides_by_zero=True,
    makes_arrays=False,
)
def _forces(
    table: Floats,
    rows: int,
    links: int,
    grip: tuple[float, float, float, float],
    still: float,
    linear: Floats,
    quadratic: Floats,
    w: Floats,
    missing: Floats,
    slope: Floats,
) -> tuple[float, float]:
    """Return the power, where the law has one, and a moment that counts like a force, m^-2.

    Args:
        table: as in ``balance``.
        rows: of the table.
        links: number of links.
        grip: as in ``balance``.
        still: speed below which the kink at rest is smooth.
        linear: as in ``balance``.
        quadratic: as in ``balance``.
        w: (3,) velocity.
        missing: (3,) out: friction's resistance less gravity, N per weight of a link, and moment.
        slope: (3, 3) out: its derivative by ``w``.

    """
    forward, across, back, code = grip
    law = int(code)
    x = w[0]
    y = w[1]
    turn = w[2]
    power = weights = levers = 0.0
    for i in range(3):
        missing[i] = -linear[i]
        power -= linear[i] * w[i]
        for j in range(3):
            slope[i, j] = quadratic[i, j]
            missing[i] += quadratic[i, j] * w[j]
            power += 0.5 * quadratic[i, j] * w[i] * w[j]
    for k in range(links):
        base = k // LANES * rows + k % LANES
        c, s = table[base + FORWARD_X], table[base + FORWARD_Y]
        px, py = table[base + POINT_X], table[base + POINT_Y]
        u, v = table[base + SHAPE_X] + x - turn * py, table[base + SHAPE_Y] + y + turn * px
        ahead = c * u + s * v
        aside = c * v - s * u
        a2, b2 = s * px - c * py, c * px + s * py
        normal = table[base + NORMAL]
        rub, pull_a, pull_c, aa, ac, ca, cc = _of_link(
            law, forward if ahead >= 0.0 else back, across, ahead, aside, still
        )
        pull_a, pull_c = normal * pull_a, normal * pull_c
        aa, ac, ca, cc = normal * aa, normal * ac, normal * ca, normal * cc
        power += normal * rub
        missing[0] += c * pull_a - s * pull_c
        missing[1] += s * pull_a + c * pull_c
        missing[2] += a2 * pull_a + b2 * pull_c
        ax, ay, az = c * aa - s * ac, s * aa + c * ac, a2 * aa + b2 * ac
        bx, by, bz = c * ca - s * cc, s * ca + c * cc, a2 * ca + b2 * cc
        slope[0, 0] += c * ax - s * bx
        slope[0, 1] += c * ay - s * by
        slope[0, 2] += c * az - s * bz
        slope[1, 0] += s * ax + c * bx
        slope[1, 1] += s * ay + c * by
        slope[1, 2] += s * az + c * bz
        slope[2, 0] += a2 * ax + b2 * bx
        slope[2, 1] += a2 * ay + b2 * by
        slope[2, 2] += a2 * az + b2 * bz
        weights += normal
        levers += normal * (px * px + py * py)
    return power, weights / max(levers, 1e-12)


@compiled(
    "void(float64[:, ::1], float64[::1], float64[::1])", divides_by_zero=True, makes_arrays=False
)
def _solve_any(slope: Floats, missing: Floats, step: Floats) -> None:
    """Solve for a step (3,) by cofactors: ``scales`` has no symmetric derivative."""
    a, b, c = slope[0, 0], slope[0, 1], slope[0, 2]
    d, e, f = slope[1, 0], slope[1, 1], slope[1, 2]
    g, h, i = slope[2, 0], slope[2, 1], slope[2, 2]
    x, y, z = missing[0], missing[1], missing[2]
    ei, fg, dh = e * i - f * h, f * g - d * i, d * h - e * g
    scale = 1.0 / (a * ei + b * fg + c * dh)
    step[0] = scale * (ei * x + (c * h - b * i) * y + (b * f - c * e) * z)
    step[1] = scale * (fg * x + (a * i - c * g) * y + (c * d - a * f) * z)
    step[2] = scale * (dh * x + (b * g - a * h) * y + (a * e - b * d) * z)


@inlined
def _square(missing: Floats, lever: float) -> float:
    return float(missing[0] ** 2 + missing[1] ** 2 + lever * missing[2] ** 2)


_ITERATION = (
    f"boolean(float64[::1], int64, int64, {GRIP}, float64, float64, float64[::1],"
    f" {readonly_array(dimensions=2, layout='C')}, float64[::1], float64[:, ::1])"
)
"""Type of the two iterations."""


@compiled(_ITERATION, makes_arrays=False)
def _least_power(
    table: Floats,
    rows: int,
    links: int,
    grip: tuple[float, float, float, float],
    still: float,
    close: float,
    linear: Floats,
    quadratic: Floats,
    w: Floats,
    work: Floats,
) -> bool:
    """Newton's method on the power, from ``w`` in place; whether what is missing is ``close``."""
    missing = work[0]
    step = work[1]
    trial = work[2]
    slope = work[3:]
    given = table, rows, links, grip, still, linear, quadratic
    power, lever = _forces(*given, w, missing, slope)
    for _ in range(_STEPS):
        if _square(missing, lever) < close or not abs(w[0]) + abs(w[1]) < _SLIDES_M_S:
            break
        for i in range(3):
            slope[i, i] += 1e-9
        _solve_any(slope, missing, step)
        fall = missing[0] * step[0] + missing[1] * step[1] + missing[2] * step[2]
        before = power
        scale = 2.0
        power = before + 1.0
        while power > before - 1e-4 * scale * fall and scale > 1e-9:
            scale *= 0.5
            for i in range(3):
                trial[i] = w[i] - scale * step[i]
            power, lever = _forces(*given, trial, missing, slope)
        if power >= before:
            break
        for i in range(3):
            w[i] = trial[i]
    return bool(_square(missing, lever) < close and abs(w[0]) + abs(w[1]) < _SLIDES_M_S)


@compiled(_ITERATION, makes_arrays=False)
def _least_missing(  # noqa: C901  a compiled loop
    table: Floats,
    rows: int,
    links: int,
    grip: tuple[float, float, float, float],
    still: float,
    close: float,
    linear: Floats,
    quadratic: Floats,
    w: Floats,
    work: Floats,
) -> bool:
    """Levenberg's and Marquardt's method on the missing forces, for a law without a power."""
    missing = work[0]
    step = work[1]
    trial = work[2]
    slope = work[3:6]
    normal = work[6:9]
    given = table, rows, links, grip, still, linear, quadratic
    _, lever = _forces(*given, w, missing, slope)
    rest = _square(missing, lever)
    damping = 0.0
    for _ in range(_STEPS):
        if rest < close or not abs(w[0]) + abs(w[1]) < _SLIDES_M_S:
            break
        if damping == 0.0:
            for i in range(3):
                slope[i, i] += 1e-9
            _solve_any(slope, missing, step)
        else:
            for i in range(3):
                for j in range(3):
                    normal[i, j] = lever * slope[2, i] * slope[2, j]
                    normal[i, j] += slope[0, i] * slope[0, j] + slope[1, i] * slope[1, j]
                normal[i, i] += damping * normal[i, i] + 1e-12
                trial[i] = slope[0, i] * missing[0] + slope[1, i] * missing[1]
                trial[i] += lever * slope[2, i] * missing[2]
            _solve_any(normal, trial, step)
        for i in range(3):
            trial[i] = w[i] - step[i]
        _forces(*given, trial, missing, slope)
        now = _square(missing, lever)
        if now < 0.999 * rest:
            rest = now
            damping = 0.1 * damping if damping > 1e-3 else 0.0
            for i in range(3):
                w[i] = trial[i]
        else:
            damping = max(10.0 * damping, 1e-2)
            _forces(*given, w, missing, slope)
            if damping > 1e9:
                break
    return bool(rest < close and abs(w[0]) + abs(w[1]) < _SLIDES_M_S)


@compiled(
    f"boolean(float64[::1], int64, int64, {GRIP}, float64[::1],"
    f" {readonly_array(dimensions=2, layout='C')}, float64[::1], float64[:, ::1])",
    makes_arrays=False,
)
def balance_forces(
    table: Floats,
    rows: int,
    links: int,
    grip: tuple[float, float, float, float],
    linear: Floats,
    quadratic: Floats,
    w: Floats,
    work: Floats,
) -> bool:
    """``balance`` of any law; ``w`` is unchanged if friction does not hold the body."""
    law = int(grip[3])
    w0, w1, w2 = w[0], w[1], w[2]
    close = 0.0
    for k in range(links):
        close += table[k // LANES * rows + k % LANES + NORMAL]
    close = (1e-6 * close * grip[1]) ** 2
    loads = linear, quadratic, w, work
    if law == WHEELS:  # a wide kink first: far from a narrow one, Newton's steps are much too long
        _least_power(table, rows, links, grip, 30.0 * _WHEEL_M_S, close, *loads)
        is_held = _least_power(table, rows, links, grip, _WHEEL_M_S, 1e4 * close, *loads)
    elif law == SCALES:
        is_held = _least_missing(table, rows, links, grip, _STILL_SPEED_M_S, close, *loads)
        if not is_held:  # the ellipse, which has one balance, is a better start
            start = grip[0], grip[1], grip[2], float(ELLIPSE)
            w[0], w[1], w[2] = w0, w1, w2
            _least_power(table, rows, links, start, _STILL_SPEED_M_S, close, *loads)
            for wide in (1000.0, 100.0, 10.0, 1.0):
                is_held = _least_missing(
                    table, rows, links, grip, wide * _STILL_SPEED_M_S, close, *loads
                )
    else:
        is_held = _least_power(table, rows, links, grip, _STILL_SPEED_M_S, close, *loads)
    if not is_held:
        w[0], w[1], w[2] = w0, w1, w2
    return is_held
