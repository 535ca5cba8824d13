"""The three rigid velocities of a planar body whose shape changes on Coulomb friction.

Without inertia the ground's forces and moment sum to zero; with the Coulomb ellipse that is the
minimum of the dissipated power, which is convex in (vx, vy, omega), so Newton's method finds it.
On a slope gravity's power, linear in them, is taken off: still convex, but without a minimum where
the slope is more than friction holds.
"""

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.constants import GRAVITY_M_S2
from snakewalk.config.world import FrictionConfig
from snakewalk.drivers.compiling import compiled
from snakewalk.drivers.least_squares import solve_positive_definite

_STILL_M_S = 1e-4  # smooths the kink of |v| at rest
_STEPS = 50
_ROUNDING = 1e-14
_NONE = np.zeros((3, 3))


class NoBalanceError(ArithmeticError):
    """The slope's load is more than friction holds: without inertia, an infinite velocity."""


def rigid_velocity(
    points_m: Floats,
    headings_rad: Floats,
    shape_m_s: Floats,
    friction: FrictionConfig,
    guess: Floats | None = None,
    *,
    tangential: Floats | None = None,
    normal: Floats | None = None,
) -> Floats:
    """Velocity (vx, vy, omega) of a body frame at its origin that balances friction.

    Args:
        points_m: (L, 2) link centres in the body frame.
        headings_rad: (L,) link headings in the body frame.
        shape_m_s: (L, 2) velocities of the links relative to the body frame.
        friction: the ellipse; every link carries the same weight.
        guess: start of the iteration, the last solution in a sequence.
        tangential: (L, 2) part of gravity along the ground on each link, in the body frame, in
            weights of a link: ``sin(slope)`` down the slope. None is level ground.
        normal: (L,) load of each link on the ground, in weights of a link: ``cos(slope)``.

    Returns:
        (3,) m/s, m/s, rad/s.

    Raises:
        NoBalanceError: the slope's load is more than friction can hold; the body slides.

    """
    velocity = np.zeros(3) if guess is None else np.array(guess, dtype=float)
    linear = np.zeros(3) if tangential is None else _wrench(points_m, tangential)
    if not _solved(points_m, headings_rad, shape_m_s, friction, normal, linear, _NONE, velocity):
        raise NoBalanceError
    return velocity


def inertial_velocity(
    points_m: Floats,
    headings_rad: Floats,
    shape_m_s: Floats,
    friction: FrictionConfig,
    before_m_s: Floats,
    step_s: float,
    guess: Floats | None = None,
    *,
    tangential: Floats | None = None,
    normal: Floats | None = None,
) -> Floats:
    """``rigid_velocity`` of a body with inertia, at the end of a step (implicit Euler).

    The power gains half the links' change of velocity squared, ``1 / (g step)`` per weight, so that
    a body that nothing holds slides ever faster instead of at once infinitely fast.

    Args:
        points_m: as in ``rigid_velocity``.
        headings_rad: likewise.
        shape_m_s: likewise.
        friction: likewise.
        before_m_s: (L, 2) velocities of the links at the start of the step, in the body frame.
        step_s: of time.
        guess: as in ``rigid_velocity``.
        tangential: likewise.
        normal: likewise.

    Returns:
        (3,) m/s, m/s, rad/s.

    """
    velocity = np.zeros(3) if guess is None else np.array(guess, dtype=float)
    linear, quadratic = np.zeros(3), np.empty((3, 3))
    add_inertia(points_m, shape_m_s, before_m_s, step_s, linear, quadratic)
    if tangential is not None:
        linear += _wrench(points_m, tangential)
    _solved(points_m, headings_rad, shape_m_s, friction, normal, linear, quadratic, velocity)
    return velocity


@compiled(
    "void(float64[:, :], float64[:, :], float64[:, :], float64, float64[::1], float64[:, ::1])"
)
def add_inertia(
    points_m: Floats,
    shape_m_s: Floats,
    before_m_s: Floats,
    step_s: float,
    linear: Floats,
    quadratic: Floats,
) -> None:
    """Inertia of a step in the power per weight of a link; as in ``inertial_velocity``.

    Args:
        points_m: (L, 2)
        shape_m_s: (L, 2)
        before_m_s: (L, 2)
        step_s: of time.
        linear: (3,) gains the part that is linear in (vx, vy, omega).
        quadratic: (3, 3) becomes that of their products.

    """
    mass = 1.0 / (GRAVITY_M_S2 * step_s)
    quadratic[:] = 0.0
    for i in range(len(points_m)):
        x, y = points_m[i, 0], points_m[i, 1]
        px = mass * (before_m_s[i, 0] - shape_m_s[i, 0])
        py = mass * (before_m_s[i, 1] - shape_m_s[i, 1])
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


def _solved(
    points_m: Floats,
    headings_rad: Floats,
    shape_m_s: Floats,
    friction: FrictionConfig,
    normal: Floats | None,
    linear: Floats,
    quadratic: Floats,
    velocity: Floats,
) -> bool:
    """``balance`` of arrays of any layout."""
    return balance(
        np.ascontiguousarray(points_m, dtype=float),
        np.stack([np.cos(headings_rad), np.sin(headings_rad)], axis=-1),
        np.ascontiguousarray(shape_m_s, dtype=float),
        friction.along,
        friction.across,
        np.ones(len(points_m)) if normal is None else np.ascontiguousarray(normal, dtype=float),
        linear,
        quadratic,
        velocity,
    )


@compiled(
    "UniTuple(float64, 2)(float64[:, ::1], float64, float64[::1], float64[:, ::1], float64[::1],"
    " float64[::1], float64[:, ::1])"
)
def _power(
    slides: Floats,
    still: float,
    linear: Floats,
    quadratic: Floats,
    w: Floats,
    gradient: Floats,
    hessian: Floats,
) -> tuple[float, float]:
    """Power that all links dissipate, less gravity's; and what they would if the shape stood still.

    Args:
        slides: (L, 14) of each link, weighted: how its velocity along and across itself grow with
            (vx, vy, omega), three numbers each; what the change of the shape makes of the two; and
            the lower triangle of the product of what comes first with its transpose.
        still: as ``_STILL_M_S``, weighted.
        linear: as in ``balance``.
        quadratic: likewise.
        w: (3,) where.
        gradient: (3,) written.
        hessian: (3, 3) its lower triangle is written.

    """
    x, y, turn = w[0], w[1], w[2]
    power = rigid = 0.0
    g0, g1, g2 = -linear[0], -linear[1], -linear[2]
    h00, h10, h11 = quadratic[0, 0], quadratic[1, 0], quadratic[1, 1]
    h20, h21, h22 = quadratic[2, 0], quadratic[2, 1], quadratic[2, 2]
    for k in range(len(slides)):
        link = slides[k]
        u = link[0] * x + link[1] * y + link[2] * turn
        v = link[3] * x + link[4] * y + link[5] * turn
        rigid += np.sqrt(u * u + v * v)
        u, v = u + link[6], v + link[7]
        size = np.sqrt(u * u + v * v + still * still)
        power += size
        inverse = 1.0 / size
        u, v = u * inverse, v * inverse
        d0 = u * link[0] + v * link[3]
        d1 = u * link[1] + v * link[4]
        d2 = u * link[2] + v * link[5]
        g0, g1, g2 = g0 + d0, g1 + d1, g2 + d2
        h00 += (link[8] - d0 * d0) * inverse
        h10 += (link[9] - d1 * d0) * inverse
        h11 += (link[10] - d1 * d1) * inverse
        h20 += (link[11] - d2 * d0) * inverse
        h21 += (link[12] - d2 * d1) * inverse
        h22 += (link[13] - d2 * d2) * inverse
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
    "boolean(float64[:, ::1], float64[:, ::1], float64[:, ::1], float64, float64, float64[::1],"
    " float64[::1], float64[:, ::1], float64[::1])"
)
def balance(
    points_m: Floats,
    forward: Floats,
    shape_m_s: Floats,
    along: float,
    across: float,
    normal: Floats,
    linear: Floats,
    quadratic: Floats,
    w: Floats,
) -> bool:
    """Newton's method on the power, from ``w`` (3,) on, which is written; whether it has a minimum.

    ``forward`` (L, 2) are unit vectors along the links; ``linear`` (3,) is gravity's power per (vx,
    vy, omega), ``quadratic`` (3, 3) that of inertia.
    """
    links = len(points_m)
    slides = np.empty((links, 14))
    for k in range(links):
        link = slides[k]
        c, s = forward[k, 0], forward[k, 1]
        x, y = points_m[k, 0], points_m[k, 1]
        u, v = shape_m_s[k, 0], shape_m_s[k, 1]
        along_k, across_k = along * normal[k], across * normal[k]
        link[0], link[1], link[2] = c * along_k, s * along_k, (s * x - c * y) * along_k
        link[3], link[4], link[5] = -s * across_k, c * across_k, (c * x + s * y) * across_k
        link[6], link[7] = (c * u + s * v) * along_k, (c * v - s * u) * across_k
        at = 8
        for i in range(3):
            for j in range(i + 1):
                link[at] = link[i] * link[j] + link[3 + i] * link[3 + j]
                at += 1
    still = _STILL_M_S * across
    work = np.empty((6, 3))
    gradient, step, trial, hessian = work[0], work[1], work[2], work[3:]
    may_slide = not quadratic.any() and (linear[0] != 0.0 or linear[1] != 0.0 or linear[2] != 0.0)
    best, _ = _power(slides, still, linear, quadratic, w, gradient, hessian)
    for _ in range(_STEPS):
        steepest = max(abs(gradient[0]), abs(gradient[1]), abs(gradient[2]))
        if steepest < 1e-9 * links * across:
            break
        for i in range(3):
            hessian[i, i] += 1e-9
        solve_positive_definite(hessian, gradient, step)
        fall = gradient[0] * step[0] + gradient[1] * step[1] + gradient[2] * step[2]
        if fall < _ROUNDING * abs(best):  # no power could tell whether a step is a better one
            w[:] = w - step
            break
        now, scale = np.inf, 2.0
        while now > best - 1e-4 * scale * fall and scale > 1e-9:
            scale *= 0.5
            for i in range(3):
                trial[i] = w[i] - scale * step[i]
            now, rigid = _power(slides, still, linear, quadratic, trial, gradient, hessian)
        if now >= best:
            break
        w[:] = trial
        best = now
        gain = linear[0] * w[0] + linear[1] * w[1] + linear[2] * w[2]
        if may_slide and rigid < (1.0 - 1e-9) * gain:
            return False  # gravity outdoes friction ever faster in this direction
    return True
