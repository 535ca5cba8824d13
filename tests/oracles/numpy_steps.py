"""The steps of ``sim.physics.stepper`` once more in numpy: a check of the compiled ones."""

from typing import Any

import mujoco
import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.friction_law import LAWS
from snakewalk.sim.physics.friction import stop_share
from snakewalk.sim.physics.mechanics import FOOT, GROUND, LEAST_DEPTH_M, Mechanics, velocities
from snakewalk.sim.physics.plant import MujocoPlant
from snakewalk.sim.physics.water import add_water
from snakewalk.sim.plant import ServoDrive


def numpy_plant(*given: Any, **options: Any) -> MujocoPlant:
    """Make a ``MujocoPlant`` whose steps run in numpy."""
    plant = MujocoPlant(*given, **options)
    plant.steps = NumpySteps(plant.mechanics)
    return plant


class NumpySteps:
    """Drive, friction and MuJoCo's step, one Python pass a step."""

    def __init__(self, mechanics: Mechanics) -> None:
        self._m = mechanics

    def run(self, steps: int, drive: ServoDrive) -> float:
        """Advance ``steps`` steps; MuJoCo's time then."""
        m = self._m
        for _ in range(steps):
            m.planes.lay(m.data)
            mujoco.mj_step1(m.model, m.data)
            force = friction_forces(m)
            rate = m.data.qvel[6:]
            before = rate.copy()
            ground_n_m = force[6:].copy()
            force[6:] += drive_shafts(drive, m.data.qpos[7:], rate) - m.gears[2] * rate
            m.data.qfrc_applied[:] = force
            mujoco.mj_step2(m.model, m.data)
            add_energies(m, drive, before)
            hold_joints(m, drive, ground_n_m, before)
            m.measure_loads()
        return float(m.data.time)


def add_energies(m: Mechanics, drive: ServoDrive, before_rad_s: Floats) -> None:
    """Energies of a step's motors into the drive, and of the gears' drag into ``m.totals``."""
    middle, amps, step_s = 0.5 * (before_rad_s + m.data.qvel[6:]), drive.current_a, m.step_s
    input_w = amps * (drive.resistance_ohm * amps + drive.back_emf_v_s * before_rad_s)
    drive.drawn_j[:] += np.where(input_w > 0.0, input_w, 0.0) * step_s
    drive.returned_j[:] += np.where(input_w < 0.0, -input_w, 0.0) * step_s
    drive.heat_j[:] += drive.resistance_ohm * amps**2 * step_s
    drive.work_j[:] += drive.torque_n_m * middle * step_s
    m.totals[2] += float((m.gears[2] * before_rad_s) @ middle) * step_s


def hold_joints(m: Mechanics, drive: ServoDrive, ground_n_m: Floats, before_rad_s: Floats) -> None:
    """Set what the gears' friction may hold in the next step; its loss in this one is added."""
    gear, rate = m.gears, m.data.qvel[6:]
    if not np.delete(gear, (0, 2, 4, 9), axis=0).any():
        return
    held = np.zeros(len(rate))
    if m.model.dof_frictionloss[6:].all():
        held = m.data.efc_force[: len(rate)].copy()
        m.totals[2] -= float(held @ (0.5 * (before_rad_s + rate))) * m.step_s
    load = ground_n_m - m.data.qfrc_bias[6:] + m.data.qfrc_constraint[6:] - held
    motor = drive.torque_n_m
    slow = gear[3] + np.abs(gear[7] * load - gear[8] * motor)
    square = np.where(np.abs(load) < np.abs(motor), gear[11] * load**2, gear[10] * motor**2)
    slow = slow + np.where(load * motor < 0.0, square, 0.0)
    speed = np.exp(-((np.abs(rate) / gear[4]) ** gear[9]))
    friction = gear[1] + np.abs(gear[6] * load - gear[5] * motor) + slow * speed
    m.model.dof_frictionloss[6:] = np.maximum(friction, 1e-9)


def friction_forces(m: Mechanics) -> Floats:
    """Generalised forces (6 + J,) of ground friction; adds to ``m.totals``."""
    d = m.data
    out = np.zeros(m.model.nv)
    contacts = d.contact
    # the others are an obstacle's, which have MuJoCo's own friction, or those of two links
    one, other = m.contact_role[contacts.geom].T
    ours = (one == GROUND) & (other != FOOT)
    link = m.model.geom_bodyid[contacts.geom[ours, 1]] - 1
    depth = np.maximum(-contacts.dist[ours], LEAST_DEPTH_M)
    load = m.load_n[link]
    share = depth / np.bincount(link, depth, len(m.load_n))[link]
    normal_n = load * share
    place, up = contacts.pos[ours], contacts.frame[ours, :3]
    centre = d.xipos[1:]
    velocity, (_, spin) = (centre - m.before_m) / m.step_s, velocities(m.model, d)
    m.before_m[:] = centre
    arm = place - centre[link]
    sliding = velocity[link] + np.cross(spin[link], arm)
    forward = d.xmat[1:].reshape(-1, 3, 3)[link, :, 0]
    along = forward - up * (up * forward).sum(axis=1, keepdims=True)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-9)
    across = np.cross(up, along)
    v_along, v_across = (sliding * along).sum(axis=1), (sliding * across).sum(axis=1)
    still = stop_share(centre[: m.spine_links], m.radius_m) * m.link_mass_kg[link] / m.step_s
    f_along, f_across = dry_forces(normal_n, v_along, v_across, m.mu, still, load)
    m.totals[0] -= float(f_along @ v_along + f_across @ v_across) * m.step_s
    m.totals[1] += float((np.abs(v_across) * share).sum()) * m.step_s / len(centre)
    force = f_along[:, None] * along + f_across[:, None] * across
    wrench = np.zeros((len(centre), 6))
    np.add.at(wrench, link, np.hstack([force, np.cross(place, force)]))
    if m.water[0, 3] > 0.0:
        m.totals[0] += add_water(wrench, centre, d.xmat[1:], velocity, spin, m.water, m.step_s)
    behind = wrench  # of each link and what hangs on it
    for i in range(len(wrench) - 1, 0, -1):
        behind[m.model.body_parentid[i + 1] - 1] += behind[i]
    f, t = behind[1:, :3], behind[1:, 3:]
    out[6:] = (d.xaxis[1:] * (t - np.cross(d.xanchor[1:], f))).sum(axis=1)
    out[:3] = behind[0, :3]
    out[3:6] = (behind[0, 3:] - np.cross(centre[0], behind[0, :3])) @ d.xmat[1].reshape(3, 3)
    return out


def dry_forces(
    normal_n: Floats,
    along_m_s: Floats,
    across_m_s: Floats,
    mu: tuple[float, float, float, float],
    still_n_s_m: float,
    link_normal_n: Floats,
) -> tuple[Floats, Floats]:
    """``friction_force`` of C contacts at once; all arrays (C,)."""
    mu_forward, mu_across, mu_back, law = mu
    mu_along = np.where(along_m_s >= 0.0, mu_forward, mu_back)
    floor = link_normal_n / still_n_s_m
    match LAWS[int(law)]:
        case "ellipse":
            along, across = mu_along**2, mu_across**2
            gauge = np.hypot(mu_along * along_m_s, mu_across * across_m_s)
            slow = gauge, gauge
        case "scales":
            along, across = mu_along, mu_across
            slow = np.hypot(along_m_s, across_m_s), np.hypot(along_m_s, across_m_s)
        case "wheels":
            along, across = mu_along, mu_across
            slow = np.abs(along_m_s), np.abs(across_m_s)
    slow_along, slow_across = (
        np.maximum(slow[0], along * floor),
        np.maximum(slow[1], across * floor),
    )
    slow_along[slow_along <= 0.0] = np.inf
    slow_across[slow_across <= 0.0] = np.inf
    return -normal_n * along * along_m_s / slow_along, -normal_n * across * across_m_s / slow_across


def drive_shafts(drive: ServoDrive, position_rad: Floats, velocity_rad_s: Floats) -> Floats:
    """``shaft_torque`` of J servos at once: fills the drive's outputs, returns torque (J,), N m."""
    on = drive.torque_on > 0.0
    pwm = np.clip(
        drive.p_gain_per_rad * (drive.goal_rad - position_rad), -drive.pwm_limit, drive.pwm_limit
    )
    volts = pwm * drive.supply_v - drive.back_emf_v_s * velocity_rad_s
    limit = drive.current_limit_a
    drive.pwm[:] = np.where(on, pwm, 0.0)
    drive.current_a[:] = np.where(on, np.clip(volts / drive.resistance_ohm, -limit, limit), 0.0)
    drive.torque_n_m[:] = drive.torque_constant_n_m_a * drive.current_a
    return drive.torque_n_m
