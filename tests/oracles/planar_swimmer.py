"""A swimmer in the plane from first principles, to hold the simulator's water against.

Shares no code with it. The shape is prescribed; the water alone changes the whole body's momentum,
whose state is (x, y of the centre of mass, heading of the head, and the three momenta). Drag is
summed over ``SLICES`` slices of each link.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Floats = NDArray[np.float64]
SLICES = 12


def swim(
    links: int,
    link_m: float,
    mass_kg: float,
    spin_kg_m2: float,
    drag_kg_m2: tuple[float, float],
    shape: Callable[[float], tuple[Floats, Floats]],
    time_s: Floats,
) -> Floats:
    """(T, 2) centre of mass from rest, head along x.

    Args:
        links: number of links.
        link_m: length of each.
        mass_kg: of each.
        spin_kg_m2: moment of inertia of each about its middle.
        drag_kg_m2: across and along, force a metre a squared speed.
        shape: joint angles and rates at a time; heading i is the head's less the first i angles.
        time_s: increasing.

    """
    total = links * mass_kg
    slices = (np.arange(SLICES) + 0.5) / SLICES - 0.5

    def pose(t: float, heading: float) -> tuple[Floats, Floats, Floats, Floats]:
        bend, rate = shape(t)
        th = heading - np.concatenate([[0.0], np.cumsum(bend)])
        om = -np.concatenate([[0.0], np.cumsum(rate)])  # with the head's own rate left out
        e = np.stack([np.cos(th), np.sin(th)], axis=1)
        step = -0.5 * link_m * (e[:-1] + e[1:])
        r = np.concatenate([[[0.0, 0.0]], np.cumsum(step, axis=0)])
        left = np.stack([-e[:, 1], e[:, 0]], axis=1)
        turn = om[:, None] * left
        v = np.concatenate(
            [[[0.0, 0.0]], np.cumsum(-0.5 * link_m * (turn[:-1] + turn[1:]), axis=0)]
        )
        return e, r - r.mean(axis=0), v - v.mean(axis=0), om

    def change(t: float, state: Floats) -> Floats:
        e, r, v, om = pose(t, state[2])
        inertia = mass_kg * (r**2).sum() + links * spin_kg_m2
        own = mass_kg * (r[:, 0] * v[:, 1] - r[:, 1] * v[:, 0]).sum() + spin_kg_m2 * om.sum()
        turning = (state[5] - own) / inertia
        velocity = state[3:5] / total
        left = np.stack([-e[:, 1], e[:, 0]], axis=1)
        at = r[:, None] + link_m * slices[:, None] * e[:, None]
        flow = velocity + v[:, None] + (om[:, None] * slices * link_m)[..., None] * left[:, None]
        flow = flow + turning * np.stack([-at[..., 1], at[..., 0]], axis=-1)
        across = (flow * left[:, None]).sum(axis=-1)
        along = (flow * e[:, None]).sum(axis=-1)
        piece = link_m / SLICES
        f = -piece * (
            (drag_kg_m2[0] * across * np.abs(across))[..., None] * left[:, None]
            + (drag_kg_m2[1] * along * np.abs(along))[..., None] * e[:, None]
        )
        torque = (at[..., 0] * f[..., 1] - at[..., 1] * f[..., 0]).sum()
        return np.array([*velocity, turning, *f.sum(axis=(0, 1)), torque])

    start = np.zeros(6)
    _, r, v, om = pose(0.0, 0.0)
    start[5] = mass_kg * (r[:, 0] * v[:, 1] - r[:, 1] * v[:, 0]).sum() + spin_kg_m2 * om.sum()
    found = solve_ivp(change, (0.0, time_s[-1]), start, t_eval=time_s, rtol=1e-6, atol=1e-9)
    return np.asarray(found.y[:2].T)
