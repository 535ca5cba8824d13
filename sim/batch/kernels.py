# mypy: disable-error-code="valid-type, misc, no-untyped-call, untyped-decorator"
"""Warp kernels of a step: motors and ground friction before it, energies and loads after it.

They compute ``sim.physics.step_forces`` in single precision for many worlds; ``make warp`` compares
both. W is the number of worlds, L of links, J of joints; the contacts of all worlds are in one
list.
"""

import warp as wp

from snakewalk.config.friction_law import ELLIPSE, SCALES
from snakewalk.sim.physics.friction import BENT_STOP_SHARE, STOP_SHARE
from snakewalk.sim.physics.mechanics import FOOT, GROUND, LEAST_DEPTH_M

_GROUND = wp.constant(GROUND)
_FOOT = wp.constant(FOOT)
_ELLIPSE = wp.constant(ELLIPSE)
_SCALES = wp.constant(SCALES)
_LEAST_DEPTH_M = wp.constant(LEAST_DEPTH_M)
_STOP_SHARE = wp.constant(STOP_SHARE)
_BENT_STOP_SHARE = wp.constant(BENT_STOP_SHARE)


@wp.kernel(enable_backward=False)
def turn_motors(
    qpos: wp.array2d[float],
    qvel: wp.array2d[float],
    torque_on: wp.array2d[float],
    goal: wp.array2d[float],
    gain: wp.array2d[float],
    pwm_limit: wp.array2d[float],
    supply: wp.array2d[float],
    current_limit: wp.array2d[float],
    motor: wp.array2d[float],
    speed: wp.array2d[float],
    current: wp.array2d[float],
    torque: wp.array2d[float],
    pwm: wp.array2d[float],
    force: wp.array2d[float],
) -> None:
    """Torque of each motor (W, J), as ``sim.plant.shaft_torque``, and drag of its gears.

    ``motor`` (4, J): resistance, torque constant, back-EMF constant, drag.
    """
    w, j = wp.tid()
    rate = qvel[w, 6 + j]
    share = wp.float32(0.0)
    ampere = wp.float32(0.0)
    if torque_on[w, j] > 0.0:
        limit = pwm_limit[w, j]
        share = wp.clamp(gain[w, j] * (goal[w, j] - qpos[w, 7 + j]), -limit, limit)
        ampere = (share * supply[w, j] - motor[2, j] * rate) / motor[0, j]
        ampere = wp.clamp(ampere, -current_limit[w, j], current_limit[w, j])
    speed[w, j] = rate
    pwm[w, j] = share
    current[w, j] = ampere
    torque[w, j] = motor[1, j] * ampere
    force[w, 6 + j] = torque[w, j] - motor[3, j] * rate


@wp.kernel(enable_backward=False)
def move_links(
    centre: wp.array2d[wp.vec3],
    rotation: wp.array2d[wp.mat33],
    axis: wp.array2d[wp.vec3],
    qvel: wp.array2d[float],
    parents: wp.array[int],
    spine: int,
    radius_m: float,
    step_s: float,
    before: wp.array2d[wp.vec3],
    velocity: wp.array2d[wp.vec3],
    spin: wp.array2d[wp.vec3],
    depth: wp.array2d[float],
    push: wp.array2d[wp.vec3],
    twist: wp.array2d[wp.vec3],
    still: wp.array[float],
) -> None:
    """Rate of the links' motion in the last step of each world (W,); clears its sums."""
    w = wp.tid()
    turn = wp.vec3(qvel[w, 3], qvel[w, 4], qvel[w, 5])
    links = before.shape[1]
    mean_x = wp.float32(0.0)
    mean_y = wp.float32(0.0)
    for i in range(links):
        place = centre[w, i + 1]
        velocity[w, i] = (place - before[w, i]) / step_s
        before[w, i] = place
        if i == 0:
            spin[w, i] = rotation[w, 1] * turn
        else:
            spin[w, i] = spin[w, parents[i + 1] - 1] + axis[w, i] * qvel[w, 5 + i]
        depth[w, i] = 0.0
        push[w, i] = wp.vec3(0.0, 0.0, 0.0)
        twist[w, i] = wp.vec3(0.0, 0.0, 0.0)
        if i < spine:
            mean_x += place[0] / float(spine)
            mean_y += place[1] / float(spine)
    xx = wp.float32(0.0)
    xy = wp.float32(0.0)
    yy = wp.float32(0.0)
    for i in range(spine):
        dx = centre[w, i + 1][0] - mean_x
        dy = centre[w, i + 1][1] - mean_y
        xx += dx * dx
        xy += dx * dy
        yy += dy * dy
    off_axis = (0.5 * (xx + yy) - wp.sqrt(0.25 * (xx - yy) * (xx - yy) + xy * xy)) / float(spine)
    square = radius_m * radius_m
    lightness = 1.0 + square / (0.5 * square + wp.max(off_axis, 0.0))
    still[w] = wp.min(_STOP_SHARE / lightness, _BENT_STOP_SHARE) / step_s


@wp.kernel(enable_backward=False)
def add_depths(
    contacts: wp.array[int],
    worlds: wp.array[int],
    geoms: wp.array[wp.vec2i],
    dist: wp.array[float],
    roles: wp.array[int],
    bodies: wp.array[int],
    depth: wp.array2d[float],
) -> None:
    """Add the depth of each belly's ground contact to that of its link."""
    c = wp.tid()
    if c >= contacts[0]:
        return
    geom = geoms[c]
    if roles[geom[0]] != _GROUND or roles[geom[1]] == _FOOT:
        return
    wp.atomic_add(depth, worlds[c], bodies[geom[1]] - 1, wp.max(-dist[c], _LEAST_DEPTH_M))


@wp.func
def gauges(
    law: int, mu_along: float, mu_across: float, along_m_s: float, across_m_s: float
) -> wp.vec4:
    """``config.friction_law.gauges``, because Warp compiles no functions of others."""
    if law == _ELLIPSE:
        a = mu_along * along_m_s
        b = mu_across * across_m_s
        gauge = wp.sqrt(a * a + b * b)
        return wp.vec4(mu_along, mu_across, gauge, gauge)
    if law == _SCALES:
        speed = wp.sqrt(along_m_s * along_m_s + across_m_s * across_m_s)
        return wp.vec4(1.0, 1.0, speed, speed)
    return wp.vec4(1.0, 1.0, wp.abs(along_m_s), wp.abs(across_m_s))


@wp.kernel(enable_backward=False)
def rub(
    contacts: wp.array[int],
    worlds: wp.array[int],
    geoms: wp.array[wp.vec2i],
    dist: wp.array[float],
    place: wp.array[wp.vec3],
    frame: wp.array[wp.mat33],
    roles: wp.array[int],
    bodies: wp.array[int],
    centre: wp.array2d[wp.vec3],
    rotation: wp.array2d[wp.mat33],
    velocity: wp.array2d[wp.vec3],
    spin: wp.array2d[wp.vec3],
    depth: wp.array2d[float],
    load: wp.array2d[float],
    mass_kg: wp.array[float],
    still: wp.array[float],
    mu: wp.array2d[float],
    step_s: float,
    push: wp.array2d[wp.vec3],
    twist: wp.array2d[wp.vec3],
    totals: wp.array2d[wp.float64],
) -> None:
    """Friction of each belly's ground contact: ``sim.physics.friction`` in single precision.

    ``mu`` (W, 4): ``FrictionConfig.grip``. ``push`` and ``twist`` (W, L) sum forces, and
    torques about the world's origin.
    """
    c = wp.tid()
    if c >= contacts[0]:
        return
    geom = geoms[c]
    if roles[geom[0]] != _GROUND or roles[geom[1]] == _FOOT:
        return
    w = worlds[c]
    i = bodies[geom[1]] - 1
    p = place[c]
    n = wp.vec3(frame[c][0, 0], frame[c][0, 1], frame[c][0, 2])
    slide = velocity[w, i] + wp.cross(spin[w, i], p - centre[w, i + 1])
    turned = rotation[w, i + 1]
    forward = wp.vec3(turned[0, 0], turned[1, 0], turned[2, 0])
    flat = forward - wp.dot(forward, n) * n
    along = flat / wp.max(wp.length(flat), 1.0e-9)
    across = wp.cross(n, along)
    along_m_s = wp.dot(slide, along)
    across_m_s = wp.dot(slide, across)
    share = wp.max(-dist[c], _LEAST_DEPTH_M) / depth[w, i]
    carried = load[w, i]
    mu_along = mu[w, 0]
    if along_m_s < 0.0:
        mu_along = mu[w, 2]
    mu_across = mu[w, 1]
    grip = gauges(int(mu[w, 3]), mu_along, mu_across, along_m_s, across_m_s)
    least = carried / (still[w] * mass_kg[i])
    slow_along = wp.max(grip[2], mu_along * grip[0] * least)
    slow_across = wp.max(grip[3], mu_across * grip[1] * least)
    normal_n = share * carried
    if normal_n <= 0.0 or slow_along <= 0.0 or slow_across <= 0.0:
        return
    along_n = -normal_n * mu_along * grip[0] * along_m_s / slow_along
    across_n = -normal_n * mu_across * grip[1] * across_m_s / slow_across
    force = along_n * along + across_n * across
    wp.atomic_add(push, w, i, force)
    wp.atomic_add(twist, w, i, wp.cross(p, force))
    loss_w = along_n * along_m_s + across_n * across_m_s
    wp.atomic_add(totals, w, 0, wp.float64(-loss_w * step_s))
    slip_m = wp.abs(across_m_s) * share * step_s / float(mass_kg.shape[0])
    wp.atomic_add(totals, w, 1, wp.float64(slip_m))


@wp.kernel(enable_backward=False)
def collect(
    centre: wp.array2d[wp.vec3],
    rotation: wp.array2d[wp.mat33],
    anchor: wp.array2d[wp.vec3],
    axis: wp.array2d[wp.vec3],
    parents: wp.array[int],
    push: wp.array2d[wp.vec3],
    twist: wp.array2d[wp.vec3],
    force: wp.array2d[float],
) -> None:
    """Add the forces on the links of each world (W,) to its generalised forces."""
    w = wp.tid()
    links = push.shape[1]
    for back in range(links - 1):
        i = links - 1 - back
        f = push[w, i]
        t = twist[w, i]
        force[w, 5 + i] = force[w, 5 + i] + wp.dot(axis[w, i], t - wp.cross(anchor[w, i], f))
        on = parents[i + 1] - 1
        push[w, on] = push[w, on] + f
        twist[w, on] = twist[w, on] + t
    f = push[w, 0]
    moment = wp.transpose(rotation[w, 1]) * (twist[w, 0] - wp.cross(centre[w, 1], f))
    for k in range(3):
        force[w, k] = f[k]
        force[w, 3 + k] = moment[k]


@wp.kernel(enable_backward=False)
def settle(
    qvel: wp.array2d[float],
    speed: wp.array2d[float],
    current: wp.array2d[float],
    torque: wp.array2d[float],
    motor: wp.array2d[float],
    step_s: float,
    energies: wp.array3d[wp.float64],
) -> None:
    """Add a step's energies of each motor (W, J): drawn, returned, heat, work."""
    w, j = wp.tid()
    ampere = current[w, j]
    heat_w = motor[0, j] * ampere * ampere
    input_w = heat_w + motor[2, j] * speed[w, j] * ampere
    middle = 0.5 * (speed[w, j] + qvel[w, 6 + j])
    drawn = energies[0, w, j] + wp.float64(wp.max(input_w, 0.0) * step_s)
    energies[0, w, j] = drawn
    energies[1, w, j] = energies[1, w, j] - wp.float64(wp.min(input_w, 0.0) * step_s)
    energies[2, w, j] = energies[2, w, j] + wp.float64(heat_w * step_s)
    energies[3, w, j] = energies[3, w, j] + wp.float64(torque[w, j] * middle * step_s)


@wp.kernel(enable_backward=False)
def weigh(
    contacts: wp.array[int],
    worlds: wp.array[int],
    geoms: wp.array[wp.vec2i],
    rows: wp.array2d[int],
    constraint_n: wp.array2d[float],
    roles: wp.array[int],
    bodies: wp.array[int],
    load: wp.array2d[float],
) -> None:
    """Add ground contact forces to the load of their links; ``load`` (W, L) was cleared."""
    c = wp.tid()
    if c >= contacts[0]:
        return
    geom = geoms[c]
    row = rows[c, 0]
    if row < 0 or roles[geom[0]] != _GROUND:
        return
    wp.atomic_add(load, worlds[c], bodies[geom[1]] - 1, constraint_n[worlds[c], row])
