"""The three rigid velocities of a planar body whose shape changes on Coulomb friction.

Without inertia the ground's forces and moment sum to zero; with the Coulomb ellipse that is the
minimum of the dissipated power, which is convex in (vx, vy, omega), so Newton's method finds it.
"""

import numpy as np
from numpy.typing import NDArray

from config.world import FrictionConfig

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
    links = len(points_m)
    cos, sin = np.cos(headings_rad), np.sin(headings_rad)
    # rows: weighted along and across velocity of each link as a linear map of (vx, vy, omega)
    lever = np.stack([-points_m[:, 1], points_m[:, 0]])
    along = np.stack([cos, sin, cos * lever[0] + sin * lever[1]], axis=1) * friction.along
    across = np.stack([-sin, cos, -sin * lever[0] + cos * lever[1]], axis=1) * friction.across
    a0 = (cos * shape_m_s[:, 0] + sin * shape_m_s[:, 1]) * friction.along
    c0 = (-sin * shape_m_s[:, 0] + cos * shape_m_s[:, 1]) * friction.across
    rows, start = np.stack([along, across]), np.stack([a0, c0])
    still = _STILL_M_S * friction.across

    def power(at: Floats) -> float:
        v = rows @ at + start
        return float(np.sqrt((v * v).sum(axis=0) + still * still).sum())

    w = np.zeros(3) if guess is None else np.array(guess, dtype=float)
    best = power(w)
    for _ in range(_STEPS):
        v = rows @ w + start
        size = np.sqrt((v * v).sum(axis=0) + still * still)
        unit = v / size
        gradient = np.einsum("kl,kli->i", unit, rows)
        if np.abs(gradient).max() < 1e-9 * links * friction.across:
            break
        pull = np.einsum("kl,kli->li", unit, rows)
        hessian = np.einsum("kli,klj,l->ij", rows, rows, 1.0 / size)
        hessian -= np.einsum("li,lj,l->ij", pull, pull, 1.0 / size)
        step = np.linalg.solve(hessian + 1e-9 * np.eye(3), -gradient)
        scale, slope = 1.0, float(gradient @ step)
        while (now := power(w + scale * step)) > best + 1e-4 * scale * slope and scale > 1e-9:
            scale *= 0.5
        if now >= best:
            break
        w, best = w + scale * step, now
    return w
