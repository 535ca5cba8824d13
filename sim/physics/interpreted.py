"""The steps of a plant in numpy: where numba is absent, and to check the compiled ones against.

Friction acts at the contacts of now under the load of the last step, which the contacts of a link
share by depth. A link slides at the rate at which it *moved* in the last step. Its generalised
velocity is not that rate: Euler's step moves the head along its velocity and leaves out the turning
of the links within the step, which reads as 1 mm/s of phantom motion per millisecond of step, and
as a loss of 6 % of speed under isotropic friction at 2 ms.
"""

import mujoco
import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.sim.physics.friction import ellipse_forces, stop_drag
from snakewalk.sim.physics.mechanics import LEAST_DEPTH_M, Mechanics, velocities
from snakewalk.sim.physics.servo_drive import drive_shafts
from snakewalk.sim.physics.water import add_water
from snakewalk.sim.plant import ServoDrive


class InterpretedSteps:
    """Drive, friction and MuJoCo's step, one Python pass a step."""

    def __init__(self, mechanics: Mechanics) -> None:
        self._m = mechanics

    def run(self, steps: int, drive: ServoDrive) -> None:
        """Advance ``steps`` steps."""
        m = self._m
        for _ in range(steps):
            mujoco.mj_step1(m.model, m.data)
            force = friction_forces(m)
            rate = m.data.qvel[6:]
            force[6:] += drive_shafts(drive, m.data.qpos[7:], rate) - m.gear_drag_n_m_s * rate
            m.data.qfrc_applied[:] = force
            mujoco.mj_step2(m.model, m.data)
            m.measure_loads()


def friction_forces(m: Mechanics) -> Floats:
    """Generalised forces (6 + J,) of ground friction; adds to ``m.totals``."""
    d = m.data
    out = np.zeros(m.model.nv)
    contacts = d.contact
    link = m.model.geom_bodyid[contacts.geom[:, 1]] - 1
    ours = link >= 0  # the others are an obstacle's: they have MuJoCo's own friction
    link = link[ours]
    depth = np.maximum(-contacts.dist[ours], LEAST_DEPTH_M)
    load = m.load_n[link]
    share = depth / np.bincount(link, depth, len(m.load_n))[link]
    normal_n = load * share
    place, up = contacts.pos[ours], contacts.frame[ours, :3]
    centre = d.xipos[1:]
    velocity, (_, spin) = (centre - m.before_m) / m.step_s, velocities(d)
    m.before_m[:] = centre
    arm = place - centre[link]
    sliding = velocity[link] + np.cross(spin[link], arm)
    forward = d.xmat[1:].reshape(-1, 3, 3)[link, :, 0]
    along = forward - up * (up * forward).sum(axis=1, keepdims=True)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-9)
    across = np.cross(up, along)
    v_along, v_across = (sliding * along).sum(axis=1), (sliding * across).sum(axis=1)
    still = stop_drag(centre, m.link_mass_kg, m.radius_m, m.step_s)
    f_along, f_across = ellipse_forces(
        normal_n, v_along, v_across, m.mu_along, m.mu_across, still, load
    )
    m.totals[0] -= float(f_along @ v_along + f_across @ v_across) * m.step_s
    m.totals[1] += float((np.abs(v_across) * share).sum()) * m.step_s / len(centre)
    force = f_along[:, None] * along + f_across[:, None] * across
    wrench = np.zeros((len(centre), 6))
    np.add.at(wrench, link, np.hstack([force, np.cross(place, force)]))
    if m.water[3] > 0.0:
        m.totals[0] += add_water(wrench, centre, d.xmat[1:], velocity, spin, m.water, m.step_s)
    behind = wrench[::-1].cumsum(axis=0)[::-1]
    f, t = behind[1:, :3], behind[1:, 3:]
    out[6:] = (d.xaxis[1:] * (t - np.cross(d.xanchor[1:], f))).sum(axis=1)
    out[:3] = behind[0, :3]
    out[3:6] = (behind[0, 3:] - np.cross(centre[0], behind[0, :3])) @ d.xmat[1].reshape(3, 3)
    return out
