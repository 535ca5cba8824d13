"""A planar snake from first principles, to hold the simulator against: shares no code with it.

The shape is prescribed; what is left are three rigid degrees of freedom. No joint torque is needed:
the ground alone changes the whole body's momentum,

    d/dt P = sum F_i,      d/dt L = sum (r_i - c) x F_i      (c: centre of mass)

and the velocities follow from the momenta, since with the shape q(t) known ``P = M c'`` and
``L = J(q) theta' + h(q, q')``: J the moment of inertia of the body stiffened in its shape, h the
angular momentum of the change of shape as seen from the head.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class PlanarBody:
    """A chain of equal links, head first, each on points of the floor that share its weight."""

    links: int
    link_m: float
    mass_kg: float
    spin_kg_m2: float
    mu_along: float
    mu_across: float
    gravity_m_s2: float = 9.81
    points_m: tuple[float, ...] = (0.0,)
    """Of a link, forward of its centre."""
    mu_back: float | None = None
    """Of sliding backward; None: ``mu_along``."""
    law: str = "ellipse"
    """``scales``: Hu, Nirody, Scott, Shelley, PNAS 2009, Eq. 2: the coefficients weigh the
    components of the sliding *direction*. ``wheels``: Coulomb, on the axle and in rolling.
    ``ellipse``: Goyal, Ruina, Papadopoulos, Wear 1991: the limit surface that dissipates most."""
    creep_m_s: float = 2e-5
    """Sliding below which Coulomb's jump is a slope; the answer is that of the limit 0."""


@dataclass(frozen=True)
class PlanarRun:
    """What the body did, at the times asked for."""

    centre_m: Floats
    """(T, 2) centre of mass."""
    heading_rad: Floats
    """(T,) of the head."""
    ground_j: float
    """Energy taken by the floor in all."""


def _resistance(
    body: PlanarBody, mu_along: Floats, forth: Floats, aside: Floats
) -> tuple[Floats, Floats]:
    """Resistance along and across per load, by the publication of each law."""
    if body.law == "scales":
        speed = np.sqrt(forth**2 + aside**2 + body.creep_m_s**2)
        return mu_along * (forth / speed), body.mu_across * (aside / speed)
    if body.law == "wheels":
        creep = body.creep_m_s
        rolling, axle = np.sqrt(forth**2 + creep**2), np.sqrt(aside**2 + creep**2)
        return mu_along * forth / rolling, body.mu_across * aside / axle
    creep = body.mu_across * body.creep_m_s
    gauge = np.sqrt((mu_along * forth) ** 2 + (body.mu_across * aside) ** 2 + creep**2)
    return mu_along**2 * forth / gauge, body.mu_across**2 * aside / gauge


def simulate(
    body: PlanarBody, shape: Callable[[float], tuple[Floats, Floats]], time_s: Floats
) -> PlanarRun:
    """Integrate from rest, centre of mass at 0, head along x.

    ``shape(t)`` gives the joint angles and rates; positive turns the links behind to the right,
    so that heading ``i`` is that of the head less the first ``i`` angles.
    """
    mass = body.links * body.mass_kg
    offset = np.array(body.points_m)[:, None]
    weight = body.mass_kg * body.gravity_m_s2 / len(offset)
    mu_back = body.mu_along if body.mu_back is None else body.mu_back

    def frame(t: float) -> tuple[Floats, Floats, Floats, Floats]:
        """Headings, their rates, centres about the centre of mass and their rates, head's frame."""
        q, rate = shape(t)
        a = -np.concatenate([[0.0], np.cumsum(q)])
        w = -np.concatenate([[0.0], np.cumsum(rate)])
        along = np.stack([np.cos(a), np.sin(a)])
        swing = w * np.stack([-np.sin(a), np.cos(a)])
        place, move = np.zeros_like(along), np.zeros_like(along)
        place[:, 1:] = -0.5 * body.link_m * np.cumsum(along[:, 1:] + along[:, :-1], axis=1)
        move[:, 1:] = -0.5 * body.link_m * np.cumsum(swing[:, 1:] + swing[:, :-1], axis=1)
        return (
            a,
            w,
            place - place.mean(axis=1, keepdims=True),
            move - move.mean(axis=1, keepdims=True),
        )

    def slope(t: float, y: Floats) -> Floats:
        theta, momentum, spin = y[2], y[3:5], y[5]
        a, w, place, move = frame(t)
        stiff = body.mass_kg * (place**2).sum() + body.links * body.spin_kg_m2
        change = body.mass_kg * (place[0] * move[1] - place[1] * move[0]).sum()
        change += body.spin_kg_m2 * w.sum()
        turn = (spin - change) / stiff
        c, s = np.cos(theta), np.sin(theta)
        rotate = np.array([[c, -s], [s, c]])
        arm = rotate @ place
        velocity = (momentum / mass)[:, None] + rotate @ move
        velocity += turn * np.stack([-arm[1], arm[0]])
        ahead = np.stack([np.cos(a + theta), np.sin(a + theta)])
        left = np.stack([-ahead[1], ahead[0]])
        forth, aside = (velocity * ahead).sum(axis=0), (velocity * left).sum(axis=0)
        aside = aside + (turn + w) * offset  # (points, links)
        mu_along = np.where(forth > 0.0, body.mu_along, mu_back)
        along, across = (
            -weight * each
            for each in _resistance(body, mu_along * np.ones_like(aside), forth, aside)
        )
        pull = along.sum(axis=0) * ahead + across.sum(axis=0) * left
        torque = (arm[0] * pull[1] - arm[1] * pull[0]).sum() + (offset * across).sum()
        taken = -(along * forth + across * aside).sum()
        return np.array([*momentum / mass, turn, *pull.sum(axis=1), torque, taken])

    start = np.zeros(7)
    done = solve_ivp(
        slope,
        (time_s[0], time_s[-1]),
        start,
        method="LSODA",
        t_eval=time_s,
        rtol=1e-5,
        atol=1e-7,
        max_step=0.05,
    )
    assert done.success, done.message
    return PlanarRun(done.y[:2].T, done.y[2], float(done.y[6, -1]))
