"""Forces of a step: motors, ground friction and water before it, energies and loads after it.

``apply_forces`` runs between ``mj_step1`` and ``mj_step2``, ``settle`` after them. Friction acts at
the present contacts under the load of the last step, shared by depth.
A link slides at the rate at which it *moved* in the last step, not at its generalised velocity.
Euler's step moves the head along its velocity and omits the turning of the links within the step.
That would give 1 mm/s of phantom motion per millisecond of step, and cost 6 % of speed under
isotropic friction at 2 ms.
If a robot's file has gear friction, MuJoCo holds each joint by the friction from torque and load of
the last step (``dof_frictionloss``: BAM's own simulation does the same).
"""

from numba.extending import register_jitable

from snakewalk.config.arrays import Floats
from snakewalk.config.friction_law import gauges
from snakewalk.drivers.compiling import callable_in_loops
from snakewalk.sim.physics.friction import (
    AXIS,
    DEPTH,
    FORCE,
    LANES,
    LOAD,
    LOSS,
    NORMAL,
    PLACE,
    ROWS,
    SIDEWAYS,
    SLIDE,
    STILL,
    friction_force,
    rub,
    stop_share,
)
from snakewalk.sim.physics.mechanics import FOOT, GROUND, LEAST_DEPTH_M
from snakewalk.sim.physics.step_state import Body, Contacts, Lanes, Shafts
from snakewalk.sim.physics.water import add_water, immersed
from snakewalk.sim.plant import shaft_torque
from snakewalk.sim.servo.backlash import (
    BACKLASH,
    GAP,
    KICK,
    KICKED,
    LEAST_ROTOR_KG_M2,
    SIDE,
    SPEED,
    WHEEL_SHARE,
    free_rotor,
)
from snakewalk.sim.servo.motor import friction_n_m

LEAST_FRICTION_N_M = 1e-9
"""MuJoCo leaves out the constraint of a joint without friction, and counts the others again."""


def apply_forces(body: Body, shafts: Shafts, contacts: Contacts, lanes: Lanes) -> None:
    """Write the forces of motors, ground and water into ``body.state.force``."""
    qpos, qvel, qfrc = body.state
    on, goal, gain, pwm_limit, supply, ohm, k_t, k_e, current_limit = shafts.motors[:9]
    current, torque, pwm = shafts.motors[9:12]
    gear = shafts.gears.terms
    speed = shafts.work[0]
    ground_n_m = shafts.work[1]
    rotor = shafts.gears.rotor
    qfrc[:] = 0.0
    for j in range(len(speed)):
        has_play = gear[BACKLASH, j] > 0.0
        speed[j] = rotor[SPEED, j] if has_play and rotor[SIDE, j] == 0.0 else qvel[6 + j]
        pwm[j], current[j], torque[j] = shaft_torque(
            qpos[7 + j],
            speed[j],
            on[j],
            goal[j],
            gain[j],
            pwm_limit[j],
            supply[j],
            ohm[j],
            k_t[j],
            k_e[j],
            current_limit[j],
        )
        qfrc[6 + j] = torque[j] - gear[2, j] * qvel[6 + j]
        if has_play:
            qfrc[6 + j] = _through_teeth(shafts, j, qfrc[6 + j], body.law.step_s)
        ground_n_m[j] = -qfrc[6 + j]
    _add_friction(body, contacts, lanes)
    for j in range(len(speed)):
        ground_n_m[j] += qfrc[6 + j]


def _move(body: Body) -> None:
    """Rate of each link's centre in the last step, and its spin, from the head."""
    centre, rotation, _, axis, parents = body.chain
    v, w, _, _, before, _, _, _ = body.links
    qvel = body.state.qvel
    rate = 1.0 / body.law.step_s
    for k in range(3):
        w[0, k] = 0.0
        for i in range(3):
            w[0, k] += rotation[1, 3 * k + i] * qvel[3 + i]
    for i in range(len(v)):
        for k in range(3):
            v[i, k] = (centre[i + 1, k] - before[i, k]) * rate
            before[i, k] = centre[i + 1, k]
            if i > 0:
                w[i, k] = w[parents[i + 1] - 1, k] + axis[i, k] * qvel[5 + i]


def _collect(body: Body) -> None:
    """Add the links' wrenches to the generalised forces, ends of the chain first."""
    wrench = body.links.wrench
    qfrc = body.state.force
    centre, rotation, anchor, axis, parents = body.chain
    for i in range(len(wrench) - 1, 0, -1):
        f, t, a, e = wrench[i, :3], wrench[i, 3:], anchor[i], axis[i]
        qfrc[5 + i] += (
            e[0] * (t[0] - a[1] * f[2] + a[2] * f[1])
            + e[1] * (t[1] - a[2] * f[0] + a[0] * f[2])
            + e[2] * (t[2] - a[0] * f[1] + a[1] * f[0])
        )
        for k in range(6):
            wrench[parents[i + 1] - 1, k] += wrench[i, k]
    f, t, a = wrench[0, :3], wrench[0, 3:], centre[1]
    m0 = t[0] - a[1] * f[2] + a[2] * f[1]
    m1 = t[1] - a[2] * f[0] + a[0] * f[2]
    m2 = t[2] - a[0] * f[1] + a[1] * f[0]
    for k in range(3):
        qfrc[k] += f[k]
        qfrc[3 + k] += rotation[1, k] * m0 + rotation[1, 3 + k] * m1 + rotation[1, 6 + k] * m2


def _line_up(body: Body, contacts: Contacts, still_n_s: float, lanes: Lanes) -> int:
    """Arrange the contacts of bellies with the ground for ``rub``; return their number.

    Contacts with an obstacle and of a foot have MuJoCo's own friction, those of two links none.
    """
    reals, integers, count, contact_fields = contacts
    geom_body, role = body.geoms
    v, w, _, depth, _, load, mass_kg, _ = body.links
    centre, rotation, _, _, _ = body.chain
    table, of_link = lanes
    line_count = 0
    depth[:] = 0.0
    for c in range(count):
        geom = 2 * contact_fields.size * c + contact_fields.geom
        if role[integers[geom]] != GROUND or role[integers[geom + 1]] == FOOT:
            continue
        i = int(geom_body[integers[geom + 1]]) - 1
        row = line_count // LANES * ROWS + line_count % LANES
        of_link[line_count] = i
        line_count += 1
        p, n = (
            contact_fields.size * c + contact_fields.place,
            contact_fields.size * c + contact_fields.normal,
        )
        deep = max(-reals[contact_fields.size * c + contact_fields.dist], LEAST_DEPTH_M)
        depth[i] += deep
        p0, p1, p2 = reals[p], reals[p + 1], reals[p + 2]
        r0, r1, r2 = p0 - centre[i + 1, 0], p1 - centre[i + 1, 1], p2 - centre[i + 1, 2]
        w0, w1, w2 = w[i, 0], w[i, 1], w[i, 2]
        table[row + PLACE], table[row + PLACE + LANES], table[row + PLACE + 2 * LANES] = p0, p1, p2
        table[row + SLIDE] = v[i, 0] + w1 * r2 - w2 * r1
        table[row + SLIDE + LANES] = v[i, 1] + w2 * r0 - w0 * r2
        table[row + SLIDE + 2 * LANES] = v[i, 2] + w0 * r1 - w1 * r0
        table[row + NORMAL] = reals[n]
        table[row + NORMAL + LANES] = reals[n + 1]
        table[row + NORMAL + 2 * LANES] = reals[n + 2]
        table[row + AXIS] = rotation[i + 1, 0]
        table[row + AXIS + LANES] = rotation[i + 1, 3]
        table[row + AXIS + 2 * LANES] = rotation[i + 1, 6]
        table[row + DEPTH], table[row + LOAD] = deep, load[i]
        table[row + STILL] = still_n_s * mass_kg[i]
    for k in range(line_count):
        table[k // LANES * ROWS + k % LANES + DEPTH + LANES] = depth[of_link[k]]
    return line_count


def _add_friction(body: Body, contacts: Contacts, lanes: Lanes) -> None:
    law = body.law
    totals = body.totals
    v, w, wrench, _, _, _, _, water = body.links
    (table, of_link), step_s = lanes, law.step_s
    centre, rotation, _, _, _ = body.chain
    still_n_s = stop_share(centre[1 : law.spine + 1], law.radius_m) / step_s
    mean_s = step_s / len(wrench)
    _move(body)
    count = _line_up(body, contacts, still_n_s, lanes)
    rub(table, count, law.mu)
    wrench[:] = 0.0
    for k in range(count):
        i = of_link[k]
        row = k // LANES * ROWS + k % LANES
        f0, f1, f2 = table[row + FORCE], table[row + FORCE + LANES], table[row + FORCE + 2 * LANES]
        p0, p1, p2 = table[row + PLACE], table[row + PLACE + LANES], table[row + PLACE + 2 * LANES]
        totals[0] -= table[row + LOSS] * step_s
        totals[1] += table[row + SIDEWAYS] * mean_s
        wrench[i, 0] += f0
        wrench[i, 1] += f1
        wrench[i, 2] += f2
        wrench[i, 3] += p1 * f2 - p2 * f1
        wrench[i, 4] += p2 * f0 - p0 * f2
        wrench[i, 5] += p0 * f1 - p1 * f0
    if water[0, 3] > 0.0:
        totals[0] += add_water(wrench, centre[1:], rotation[1:], v, w, water, step_s)
    _collect(body)


def _through_teeth(shafts: Shafts, j: int, pressed_n_m: float, step_s: float) -> float:
    """Torque on a joint with backlash, ``pressed_n_m`` while a tooth touches.

    The rotor in the gap is stepped here. Its momentum reaches the joint in the step after the gap
    has closed, when MuJoCo already counts its inertia.
    """
    gear = shafts.gears.terms[:, j]
    rotor = shafts.gears.rotor[:, j]
    inertia = (1.0 - WHEEL_SHARE) * gear[0] + LEAST_ROTOR_KG_M2
    if rotor[SIDE] != 0.0:
        kick_n_m = float(inertia * rotor[KICK] / step_s)
        rotor[KICK] = 0.0
        return pressed_n_m + kick_n_m
    motors = shafts.motors
    damping = motors.on[j] * motors.k_t[j] * motors.k_e[j] / motors.ohm[j]
    push = motors.torque[j] + damping * rotor[SPEED]
    rotor[SPEED] = free_rotor(gear, step_s, inertia, rotor[SPEED], push, damping + gear[2])
    return 0.0


def _settle_teeth(shafts: Shafts, j: int, rate: float, step_s: float, friction_n_m: float) -> None:
    """Open or close the gap of a joint after a step, at its new ``rate``, rad/s.

    ``friction_n_m`` is the gears' friction torque on the joint in the step.
    """
    gear = shafts.gears.terms[:, j]
    rotor = shafts.gears.rotor[:, j]
    half = 0.5 * gear[BACKLASH]
    inertia = (1.0 - WHEEL_SHARE) * gear[0] + LEAST_ROTOR_KG_M2
    before = shafts.work[0, j]
    if rotor[SIDE] != 0.0:
        tooth_n_m = shafts.motors.torque[j] - gear[2] * before + friction_n_m
        tooth_n_m -= inertia * (rate - before - rotor[KICKED]) / step_s
        rotor[SPEED], rotor[KICKED] = rate, 0.0
        if rotor[SIDE] * tooth_n_m >= 0.0:
            return
        rotor[SIDE] = 0.0
    else:
        rotor[GAP] += step_s * (rotor[SPEED] - rate)
        if abs(rotor[GAP]) < half:
            return
        rotor[SIDE] = 1.0 if rotor[GAP] > 0.0 else -1.0
        rotor[GAP] = rotor[SIDE] * half
        rotor[KICK] = rotor[KICKED] = rotor[SPEED] - rate
    shafts.gears.armature[6 + j] = gear[0] if rotor[SIDE] != 0.0 else WHEEL_SHARE * gear[0]


def has_friction(gear: Floats) -> bool:
    """Whether any gearbox has more than viscous friction."""
    terms = 0.0
    for j in range(gear.shape[1]):
        terms += gear[1, j] + gear[3, j] + gear[5, j] + gear[6, j] + gear[7, j] + gear[8, j]
        terms += gear[10, j] + gear[11, j]
    return terms > 0.0


def settle(body: Body, shafts: Shafts, contacts: Contacts, force_n: Floats, rubs: bool) -> None:
    """Add a step's energies, set the friction of the gears, and sum the loads of the links.

    Args:
        body: after ``mj_step2``.
        shafts: its joints.
        contacts: as in ``apply_forces``.
        force_n: MuJoCo's constraint forces, (rows,) or more.
        rubs: ``has_friction`` of the gears.

    """
    totals = body.totals
    step_s = body.law.step_s
    ohm = shafts.motors.ohm
    k_e = shafts.motors.k_e
    current, torque, _, drawn_j, returned_j, heat_j, work_j = shafts.motors[9:]
    qvel = body.state.qvel
    speed = shafts.work[0]
    ground_n_m = shafts.work[1]
    gear, friction, bias, constraint, rotor, _ = shafts.gears
    for j in range(len(speed)):
        has_play = gear[BACKLASH, j] > 0.0
        free = has_play and rotor[SIDE, j] == 0.0
        rate = rotor[SPEED, j] if free else qvel[6 + j]
        # a force works at the mean of the speeds before and after Euler's step
        middle = 0.5 * (speed[j] + rate)
        heat_w = ohm[j] * current[j] * current[j]
        input_w = heat_w + k_e[j] * speed[j] * current[j]
        drawn_j[j] += max(input_w, 0.0) * step_s
        returned_j[j] -= min(input_w, 0.0) * step_s
        heat_j[j] += heat_w * step_s
        work_j[j] += torque[j] * middle * step_s
        totals[2] += gear[2, j] * speed[j] * middle * step_s
        held_n_m = 0.0
        if rubs:
            if friction[6 + j] > 0.0:  # these are MuJoCo's first constraints, in their order
                held_n_m = force_n[j]
                totals[2] -= held_n_m * middle * step_s
            outside_n_m = ground_n_m[j] - bias[6 + j] + constraint[6 + j] - held_n_m
            most_n_m = friction_n_m(gear[:, j], qvel[6 + j], torque[j], outside_n_m)
            friction[6 + j] = max(most_n_m, LEAST_FRICTION_N_M)
        if has_play:
            _settle_teeth(shafts, j, qvel[6 + j], step_s, held_n_m)
            if rubs and rotor[SIDE, j] == 0.0:
                friction[6 + j] = LEAST_FRICTION_N_M  # the gears hold the rotor alone
    _weigh(body, contacts, force_n)


def _weigh(body: Body, contacts: Contacts, force_n: Floats) -> None:
    load = body.links.load
    load[:] = 0.0
    _, integers, count, contact_fields = contacts
    geom_body, role = body.geoms
    for c in range(count):
        row = integers[2 * contact_fields.size * c + contact_fields.row]
        if row >= 0 and role[integers[2 * contact_fields.size * c + contact_fields.geom]] == GROUND:
            load[
                geom_body[integers[2 * contact_fields.size * c + contact_fields.geom + 1]] - 1
            ] += force_n[row]


callable_in_loops(gauges)

for _function in (
    friction_force,
    rub,
    stop_share,
    shaft_torque,
    immersed,
    add_water,
    _move,
    _collect,
    _line_up,
    _add_friction,
    _weigh,
    has_friction,
    _through_teeth,
    _settle_teeth,
    apply_forces,
    settle,
):
    register_jitable(error_model="numpy")(_function)
