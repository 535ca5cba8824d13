"""The three rigid velocities of a planar body whose shape changes on Coulomb friction.

Without inertia the ground's forces and moment sum to zero; with the Coulomb ellipse that is the
minimum of the dissipated power, which is convex in (vx, vy, omega), so Newton's method finds it.
"""

import numpy as np
from numpy.typing import NDArray

from config.world import FrictionConfig
from drivers.compiling import compiled

Floats = NDArray[np.float64]
_STILL_M_S = 1e-4  # smooths the kink of |v| at rest
_STEPS = 50


def rigid_velocity(
    points_m: Floats,
    headings_rad: Floats,
    shape_m_s: Floats,
    friction: FrictionConfig,
    guess: Floats | None = None,
) -> Floats:
    """Velocity (vx, vy, omega) of a body frame at its origin that balances friction.

    Args:
        points_m: (L, 2) link centres in the body frame.
        headings_rad: (L,) link headings in the body frame.
        shape_m_s: (L, 2) velocities of the links relative to the body frame.
        friction: the ellipse; every link carries the same weight.
        guess: start of the iteration, the last solution in a sequence.

    Returns:
        (3,) m/s, m/s, rad/s.

    """
    velocity = np.zeros(3) if guess is None else np.array(guess, dtype=float)
    _balance(
        np.ascontiguousarray(points_m, dtype=float),
        np.ascontiguousarray(headings_rad, dtype=float),
        np.ascontiguousarray(shape_m_s, dtype=float),
        friction.along,
        friction.across,
        velocity,
    )
    return velocity


@compiled("float64(float64[:, ::1], float64[:, ::1], float64, float64[::1])")
def _power(rows: Floats, start: Floats, still: float, w: Floats) -> float:
    """Dissipated by all links; ``rows`` and ``start`` as ``_balance`` fills them."""
    power = 0.0
    for k in range(len(start)):
        u, v = start[k, 0], start[k, 1]
        for i in range(3):
            u += rows[2 * k, i] * w[i]
            v += rows[2 * k + 1, i] * w[i]
        power += np.sqrt(u * u + v * v + still * still)
    return power


@compiled("void(float64[:, ::1], float64[::1], float64[::1])")
def _solve(a: Floats, b: Floats, x: Floats) -> None:
    """Positive definite ``a`` (3, 3) x = b, by Cholesky; ``a`` is used up."""
    for i in range(3):
        for j in range(i + 1):
            for k in range(j):
                a[i, j] -= a[i, k] * a[j, k]
            a[i, j] = np.sqrt(a[i, i]) if i == j else a[i, j] / a[j, j]
    for i in range(3):
        x[i] = b[i]
        for k in range(i):
            x[i] -= a[i, k] * x[k]
        x[i] /= a[i, i]
    for i in range(2, -1, -1):
        for k in range(i + 1, 3):
            x[i] -= a[k, i] * x[k]
        x[i] /= a[i, i]


@compiled("void(float64[:, ::1], float64[::1], float64[:, ::1], float64, float64, float64[::1])")
def _balance(
    points_m: Floats,
    headings_rad: Floats,
    shape_m_s: Floats,
    along: float,
    across: float,
    w: Floats,
) -> None:
    """Newton's method on the power, from ``w`` (3,) on, which is written."""
    links = len(points_m)
    # weighted along and across velocity of each link as a linear map of (vx, vy, omega)
    rows, start = np.empty((2 * links, 3)), np.empty((links, 2))
    for k in range(links):
        c, s = np.cos(headings_rad[k]), np.sin(headings_rad[k])
        x, y = points_m[k, 0], points_m[k, 1]
        rows[2 * k, 0], rows[2 * k, 1], rows[2 * k, 2] = (
            c * along,
            s * along,
            (s * x - c * y) * along,
        )
        rows[2 * k + 1, 0], rows[2 * k + 1, 1] = -s * across, c * across
        rows[2 * k + 1, 2] = (c * x + s * y) * across
        u, v = shape_m_s[k, 0], shape_m_s[k, 1]
        start[k, 0], start[k, 1] = (c * u + s * v) * along, (c * v - s * u) * across
    still = _STILL_M_S * across
    gradient, step, pull, trial = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    hessian = np.empty((3, 3))
    best = _power(rows, start, still, w)
    for _ in range(_STEPS):
        gradient[:] = 0.0
        hessian[:] = 0.0
        for k in range(links):
            u, v = start[k, 0], start[k, 1]
            for i in range(3):
                u += rows[2 * k, i] * w[i]
                v += rows[2 * k + 1, i] * w[i]
            size = np.sqrt(u * u + v * v + still * still)
            for i in range(3):
                pull[i] = (u * rows[2 * k, i] + v * rows[2 * k + 1, i]) / size
                gradient[i] += pull[i]
            for i in range(3):
                for j in range(i + 1):
                    stiff = rows[2 * k, i] * rows[2 * k, j]
                    stiff += rows[2 * k + 1, i] * rows[2 * k + 1, j]
                    hessian[i, j] += (stiff - pull[i] * pull[j]) / size
        steepest = max(abs(gradient[0]), abs(gradient[1]), abs(gradient[2]))
        if steepest < 1e-9 * links * across:
            break
        for i in range(3):
            hessian[i, i] += 1e-9
        _solve(hessian, -gradient, step)
        slope = gradient[0] * step[0] + gradient[1] * step[1] + gradient[2] * step[2]
        scale = 1.0
        trial[:] = w + step
        now = _power(rows, start, still, trial)
        while now > best + 1e-4 * scale * slope and scale > 1e-9:
            scale *= 0.5
            trial[:] = w + scale * step
            now = _power(rows, start, still, trial)
        if now >= best:
            break
        w[:] = trial
        best = now
