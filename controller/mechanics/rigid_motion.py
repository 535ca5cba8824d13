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
        np.ascontiguousarray(headings_rad, dtype=float),
        np.ascontiguousarray(shape_m_s, dtype=float),
        friction.along,
        friction.across,
        np.ones(len(points_m)) if normal is None else np.ascontiguousarray(normal, dtype=float),
        linear,
        quadratic,
        velocity,
    )


@compiled(
    "float64(float64[:, ::1], float64[:, ::1], float64, float64[::1], float64[:, ::1],"
    " float64[::1])"
)
def _power(
    rows: Floats, start: Floats, still: float, linear: Floats, quadratic: Floats, w: Floats
) -> float:
    """Power that all links dissipate, less gravity's; arguments as in ``balance``."""
    power = 0.0
    for i in range(3):
        power -= linear[i] * w[i]
        for j in range(3):
            power += 0.5 * quadratic[i, j] * w[i] * w[j]
    for k in range(len(start)):
        u, v = start[k, 0], start[k, 1]
        for i in range(3):
            u += rows[2 * k, i] * w[i]
            v += rows[2 * k + 1, i] * w[i]
        power += np.sqrt(u * u + v * v + still * still)
    return power


@compiled("boolean(float64[:, ::1], float64[::1], float64[::1])")
def _is_unbounded(rows: Floats, linear: Floats, w: Floats) -> bool:
    """Whether gravity outdoes friction ever faster in the direction ``w``: no minimum."""
    power = 0.0
    for k in range(len(rows) // 2):
        u, v = 0.0, 0.0
        for i in range(3):
            u += rows[2 * k, i] * w[i]
            v += rows[2 * k + 1, i] * w[i]
        power += np.sqrt(u * u + v * v)
    gain = linear[0] * w[0] + linear[1] * w[1] + linear[2] * w[2]
    return bool(power < (1.0 - 1e-9) * gain)


@compiled(
    "boolean(float64[:, ::1], float64[::1], float64[:, ::1], float64, float64, float64[::1],"
    " float64[::1], float64[:, ::1], float64[::1])"
)
def balance(
    points_m: Floats,
    headings_rad: Floats,
    shape_m_s: Floats,
    along: float,
    across: float,
    normal: Floats,
    linear: Floats,
    quadratic: Floats,
    w: Floats,
) -> bool:
    """Newton's method on the power, from ``w`` (3,) on, which is written; whether it has a minimum.

    ``linear`` (3,) is gravity's power per (vx, vy, omega), ``quadratic`` (3, 3) that of inertia.
    """
    links = len(points_m)
    # weighted along and across velocity of each link as a linear map of (vx, vy, omega)
    rows, start = np.empty((2 * links, 3)), np.empty((links, 2))
    for k in range(links):
        c, s = np.cos(headings_rad[k]), np.sin(headings_rad[k])
        x, y = points_m[k, 0], points_m[k, 1]
        along_k, across_k = along * normal[k], across * normal[k]
        rows[2 * k, 0], rows[2 * k, 1], rows[2 * k, 2] = (
            c * along_k,
            s * along_k,
            (s * x - c * y) * along_k,
        )
        rows[2 * k + 1, 0], rows[2 * k + 1, 1] = -s * across_k, c * across_k
        rows[2 * k + 1, 2] = (c * x + s * y) * across_k
        u, v = shape_m_s[k, 0], shape_m_s[k, 1]
        start[k, 0], start[k, 1] = (c * u + s * v) * along_k, (c * v - s * u) * across_k
    still = _STILL_M_S * across
    gradient, step, direction, trial = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    hessian = np.empty((3, 3))
    may_slide = not quadratic.any() and (linear[0] != 0.0 or linear[1] != 0.0 or linear[2] != 0.0)
    best = _power(rows, start, still, linear, quadratic, w)
    for _ in range(_STEPS):
        for i in range(3):
            gradient[i] = (
                quadratic[i, 0] * w[0] + quadratic[i, 1] * w[1] + quadratic[i, 2] * w[2] - linear[i]
            )
        hessian[:] = quadratic
        for k in range(links):
            u, v = start[k, 0], start[k, 1]
            for i in range(3):
                u += rows[2 * k, i] * w[i]
                v += rows[2 * k + 1, i] * w[i]
            size = np.sqrt(u * u + v * v + still * still)
            for i in range(3):
                direction[i] = (u * rows[2 * k, i] + v * rows[2 * k + 1, i]) / size
                gradient[i] += direction[i]
            for i in range(3):
                for j in range(i + 1):
                    stiff = rows[2 * k, i] * rows[2 * k, j]
                    stiff += rows[2 * k + 1, i] * rows[2 * k + 1, j]
                    hessian[i, j] += (stiff - direction[i] * direction[j]) / size
        steepest = max(abs(gradient[0]), abs(gradient[1]), abs(gradient[2]))
        if steepest < 1e-9 * links * across:
            break
        for i in range(3):
            hessian[i, i] += 1e-9
        solve_positive_definite(hessian, -gradient, step)
        slope = gradient[0] * step[0] + gradient[1] * step[1] + gradient[2] * step[2]
        scale = 1.0
        trial[:] = w + step
        now = _power(rows, start, still, linear, quadratic, trial)
        while now > best + 1e-4 * scale * slope and scale > 1e-9:
            scale *= 0.5
            trial[:] = w + scale * step
            now = _power(rows, start, still, linear, quadratic, trial)
        if now >= best:
            break
        w[:] = trial
        best = now
        if may_slide and _is_unbounded(rows, linear, w):
            return False
    return True
