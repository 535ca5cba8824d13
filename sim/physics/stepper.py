"""The steps of a plant without Python between them: drive, friction and MuJoCo's step, compiled.

``mj_step1`` and ``mj_step2`` are called by address; drive and friction enter between the two as
generalised forces. Of a chain on nothing but its ground ``mj_step1`` is called by parts, around
contacts of our own (``sim.physics.belly_contacts``): the same bits for less. Friction acts at the
present contacts under the load of the last step, which the contacts of a link share by depth. A
link slides at the rate at which it *moved* in the last step. Its generalised velocity is not that
rate: Euler's step moves the head along its velocity and leaves out the turning of the links within
the step, which reads as 1 mm/s of phantom motion per millisecond of step, and as a loss of 6 % of
speed under isotropic friction at 2 ms.

Where a robot's file has friction of the gears, MuJoCo holds the joints by as much as torque and
load of the last step make it (``dof_frictionloss``: BAM's own simulation does the same).
"""

from typing import Any

import mujoco
import numpy as np
from numba import carray, njit
from numba.extending import register_jitable
from numpy.typing import NDArray

from snakewalk.config.arrays import Floats
from snakewalk.sim.physics.addresses import call, call_with, pointer
from snakewalk.sim.physics.belly_contacts import (
    NO_CONTACTS,
    BellyContacts,
    links_near,
    write_contacts,
)
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
    ellipse_force,
    make_lanes,
    rub,
    stop_share,
)
from snakewalk.sim.physics.layout import step_layout
from snakewalk.sim.physics.mechanics import (
    FOOT,
    GROUND,
    LEAST_DEPTH_M,
    Mechanics,
    PhysicsError,
)
from snakewalk.sim.physics.tangent_planes import PLANES, lay_planes
from snakewalk.sim.physics.water import add_water, immersed
from snakewalk.sim.plant import ServoDrive, shaft_torque
from snakewalk.sim.servo.motor import friction_n_m

register_jitable(error_model="numpy", inline="always")(ellipse_force)

register_jitable(error_model="numpy")(make_lanes)

register_jitable(error_model="numpy")(rub)

register_jitable(error_model="numpy")(write_contacts)

register_jitable(error_model="numpy")(stop_share)

register_jitable(error_model="numpy")(shaft_torque)

register_jitable(error_model="numpy")(immersed)

register_jitable(error_model="numpy")(add_water)


_STEP1, _STEP2, _MODEL, _DATA, _NCON, _CONTACTS, _FORCES = range(7)
_SIZE, _DIST_AT, _PLACE_AT, _NORMAL_AT, _GEOM_AT, _ROW_AT = range(7, 13)
_KINEMATICS, _TIME, _ARENA_USED = range(13, 16)
_CHECK_POS, _CHECK_VEL, _COM, _MASS, _FACTOR, _COLLISION = range(16, 22)
_CONSTRAINT, _PROJECT, _VELOCITY, _ADD_CONTACT = range(22, 26)
"""Places in ``where``: addresses of functions and of fields of ``mjData``; the second row is of a
contact, in bytes; the last two are ``layout.STEP1_PARTS``."""
LEAST_FRICTION_N_M = 1e-9
"""A joint without any would have no constraint, and the others' would count otherwise."""


def _move(
    v: Floats,
    w: Floats,
    before: Floats,
    qvel: Floats,
    chain: tuple[Floats, ...],
    parents: NDArray[np.int32],
    step_s: float,
) -> None:
    """Rate at which each link's centre moved in the last step, and its spin, from the head on."""
    centre, rotation, _, axis = chain
    rate = 1.0 / step_s
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


def _collect(
    wrench: Floats, qfrc: Floats, chain: tuple[Floats, ...], parents: NDArray[np.int32]
) -> None:
    """Add the links' wrenches (force, torque about the world's origin) to ``qfrc``, ends first."""
    centre, rotation, anchor, axis = chain
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


def _line_up(
    contacts: tuple[Any, ...],
    chain: tuple[Floats, ...],
    work: tuple[Floats, ...],
    geoms: tuple[NDArray[np.int32], ...],
    load: Floats,
    still_n_s_m: Floats,
    lanes: tuple[Floats, NDArray[np.int64]],
) -> int:
    """Lay out the contacts of bellies with the ground for ``rub``; their number.

    An obstacle's and a foot's have MuJoCo's own friction, two links' none.
    """
    reals, integers, count, at = contacts
    size, at_dist, at_place, at_up, at_geom, _ = at
    geom_body, role, _ = geoms
    v, w, depth = work[0], work[1], work[3]
    centre, rotation = chain[0], chain[1]
    table, of_link = lanes
    found = 0
    depth[:] = 0.0
    for c in range(count):
        geom = 2 * size * c + at_geom
        if role[integers[geom]] != GROUND or role[integers[geom + 1]] == FOOT:
            continue
        i = int(geom_body[integers[geom + 1]]) - 1
        row = found // LANES * ROWS + found % LANES
        of_link[found] = i
        found += 1
        p, n = size * c + at_place, size * c + at_up
        deep = max(-reals[size * c + at_dist], LEAST_DEPTH_M)
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
        table[row + STILL] = still_n_s_m[i]
    for k in range(found):
        table[k // LANES * ROWS + k % LANES + DEPTH + LANES] = depth[of_link[k]]
    return found


def _add_friction(
    contacts: tuple[Any, ...],
    qfrc: Floats,
    qvel: Floats,
    chain: tuple[Floats, ...],
    work: tuple[Floats, ...],
    geoms: tuple[NDArray[np.int32], ...],
    law: tuple[float, ...],
    load: Floats,
    totals: Floats,
    mass_kg: Floats,
    water: Floats,
    spine: int,
    lanes: tuple[Floats, NDArray[np.int64]],
) -> None:
    """Ellipse at every contact of now under the load of the last step, collected into ``qfrc``."""
    v, w, wrench, _, before = work
    (table, of_link), parents, step_s = lanes, geoms[2], law[4]
    centre, rotation = chain[0], chain[1]
    still_n_s_m = stop_share(centre[1 : spine + 1], law[3]) / step_s * mass_kg
    mean_s = step_s / len(v)
    _move(v, w, before, qvel, chain, parents, step_s)
    count = _line_up(contacts, chain, work, geoms, load, still_n_s_m, lanes)
    rub(table, count, (law[0], law[1], law[2]))
    wrench[:] = 0.0
    for k in range(count):
        i, row = of_link[k], k // LANES * ROWS + k % LANES
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
    _collect(wrench, qfrc, chain, parents)


def _weigh(
    load: Floats,
    contacts: tuple[Any, ...],
    force_n: Floats,
    geoms: tuple[NDArray[np.int32], ...],
) -> None:
    """Sum the ground's contact forces on each link."""
    load[:] = 0.0
    _, integers, count, at = contacts
    geom_body, role, _ = geoms
    for c in range(count):
        row = integers[2 * at[0] * c + at[5]]
        if row >= 0 and role[integers[2 * at[0] * c + at[4]]] == GROUND:
            load[geom_body[integers[2 * at[0] * c + at[4] + 1]] - 1] += force_n[row]


def _step1(
    where: NDArray[np.int64],
    chain: tuple[Floats, ...],
    ground: tuple[Any, ...],
    bellies: tuple[Any, ...],
) -> None:
    """``mj_step1`` on planes that are laid anew; by parts where all contacts are of bellies."""
    words, geoms, shapes_m, reach_m2, work, axes, held, first, last = bellies
    places, balls, ball_m, z_m, corner, planes, plane_m, plane_quat = ground
    model, data, kinematics = where[_MODEL], where[_DATA], where[_KINEMATICS]
    by_parts, tangent = len(words) > 0, len(balls) > 0
    if by_parts:
        call(where[_CHECK_POS], model, data)
        call(where[_CHECK_VEL], model, data)
    if by_parts or tangent:
        call(kinematics, model, data)
    if tangent:
        lay_planes(places, balls, ball_m, z_m, corner, planes, plane_m, plane_quat)
    if not by_parts:
        call(where[_STEP1], model, data)
        return
    call(where[_COM], model, data)
    call(where[_MASS], model, data)
    call(where[_FACTOR], model, data)
    count = -1
    if not links_near(chain[0], reach_m2, work):
        ncon = carray(pointer(where[_NCON]), (1,), np.int32)
        ncon[0] = 0
        call_with(where[_ADD_CONTACT], model, data, words.ctypes.data)  # drops those of before
        held[0] = 0
        list_at = carray(pointer(where[_CONTACTS]), (1,), np.int64)[0]
        reals = carray(pointer(list_at), (words.size,), np.float64)
        at = where[_DIST_AT] // 8, where[_PLACE_AT] // 8, where[_NORMAL_AT] // 8, first, last
        belly, plane_at_m = (words, geoms, shapes_m), plane_m if tangent else places
        laid = plane_at_m, plane_quat, tangent
        count = write_contacts(reals, at, *belly, places, axes, *laid, held)
        ncon[0] = max(count, 0)
        carray(pointer(where[_ARENA_USED]), (1,), np.int64)[0] = max(count, 0) * where[_SIZE]
    if count < 0:
        held[:] = -1
        if tangent:
            call(kinematics, model, data)
        call(where[_COLLISION], model, data)
    call(where[_CONSTRAINT], model, data)
    call(where[_PROJECT], model, data)
    call(where[_VELOCITY], model, data)


def _has_friction(gear: Floats) -> bool:
    """Whether any gearbox has other friction than a viscous one."""
    terms = 0.0
    for j in range(gear.shape[1]):
        terms += gear[1, j] + gear[3, j] + gear[5, j] + gear[6, j] + gear[7, j] + gear[8, j]
        terms += gear[10, j] + gear[11, j]
    return terms > 0.0


def _steps(
    steps: int,
    where: NDArray[np.int64],
    state: tuple[Floats, Floats, Floats],
    chain: tuple[Floats, ...],
    work: tuple[Floats, ...],
    geoms: tuple[NDArray[np.int32], ...],
    ground: tuple[Any, ...],
    law: tuple[float, ...],
    gears: tuple[Floats, ...],
    drive: tuple[Floats, ...],
    load: Floats,
    totals: Floats,
    mass_kg: Floats,
    water: Floats,
    spine: int,
    bellies: tuple[Any, ...],
) -> None:
    """Advance: ``mj_step1``, drive, friction, ``mj_step2``, so often."""
    qpos, qvel, qfrc = state
    on, goal, gain, pwm_limit, supply, ohm, k_t, k_e, current_limit = drive[:9]
    current, torque, pwm, drawn_j, returned_j, heat_j, work_j = drive[9:]
    gear, friction, bias, constraint = gears
    joints = len(goal)
    speed, ground_n_m = np.empty(joints), np.empty(joints)
    has_friction = _has_friction(gear)
    lanes, step_s = make_lanes(2 * joints), law[4]
    step2, model, data = where[_STEP2], where[_MODEL], where[_DATA]
    at = (
        where[_SIZE] // 8,
        where[_DIST_AT] // 8,
        where[_PLACE_AT] // 8,
        where[_NORMAL_AT] // 8,
        where[_GEOM_AT] // 4,
        where[_ROW_AT] // 4,
    )
    ncon = carray(pointer(where[_NCON]), (1,), np.int32)
    contact_list = carray(pointer(where[_CONTACTS]), (1,), np.int64)
    force_list = carray(pointer(where[_FORCES]), (1,), np.int64)
    for _ in range(steps):
        _step1(where, chain, ground, bellies)
        qfrc[:] = 0.0
        for j in range(joints):
            speed[j] = qvel[6 + j]
            pwm[j], current[j], torque[j] = shaft_torque(
                qpos[7 + j],
                qvel[6 + j],
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
            ground_n_m[j] = -qfrc[6 + j]
        count = ncon[0]
        address = pointer(contact_list[0])
        contacts = (
            carray(address, (count * at[0],), np.float64),
            carray(address, (count * at[0] * 2,), np.int32),
            count,
            at,
        )
        if count > len(lanes[1]):
            lanes = make_lanes(count)
        _add_friction(
            *(contacts, qfrc, qvel, chain, work, geoms, law, load, totals, mass_kg, water, spine),
            lanes,
        )
        for j in range(joints):
            ground_n_m[j] += qfrc[6 + j]
        call(step2, model, data)
        force_n = carray(pointer(force_list[0]), (1 << 30,), np.float64)
        for j in range(joints):
            # a force does its work at the mean of the speeds before and after Euler's step
            middle = 0.5 * (speed[j] + qvel[6 + j])
            heat_w = ohm[j] * current[j] * current[j]
            input_w = heat_w + k_e[j] * speed[j] * current[j]
            drawn_j[j] += max(input_w, 0.0) * step_s
            returned_j[j] -= min(input_w, 0.0) * step_s
            heat_j[j] += heat_w * step_s
            work_j[j] += torque[j] * middle * step_s
            totals[2] += gear[2, j] * speed[j] * middle * step_s
            if has_friction:
                held_n_m = 0.0
                if friction[6 + j] > 0.0:  # MuJoCo's first constraints are these, in their order
                    held_n_m = force_n[j]
                    totals[2] -= held_n_m * middle * step_s
                outside_n_m = ground_n_m[j] - bias[6 + j] + constraint[6 + j] - held_n_m
                most_n_m = friction_n_m(gear[:, j], qvel[6 + j], torque[j], outside_n_m)
                friction[6 + j] = max(most_n_m, LEAST_FRICTION_N_M)
        _weigh(load, contacts, force_n, geoms)


def _run(
    steps: int,
    where: NDArray[np.int64],
    arrays: NDArray[np.int64],
    sizes: NDArray[np.int64],
    constants: Floats,
) -> float:
    """Advance, with all arrays by their addresses: handing over forty would take 7 us a call."""
    joints, bodies, geom_count, ball_count = sizes[0], sizes[1], sizes[2], sizes[3]
    links = joints + 1
    at = carray(pointer(arrays[0]), (joints + 7,), np.float64)
    rate = carray(pointer(arrays[1]), (joints + 6,), np.float64)
    force = carray(pointer(arrays[2]), (joints + 6,), np.float64)
    chain = (
        carray(pointer(arrays[3]), (bodies, 3), np.float64),
        carray(pointer(arrays[4]), (bodies, 9), np.float64),
        carray(pointer(arrays[5]), (links, 3), np.float64),
        carray(pointer(arrays[6]), (links, 3), np.float64),
    )
    work = (
        carray(pointer(arrays[7]), (links, 3), np.float64),
        carray(pointer(arrays[8]), (links, 3), np.float64),
        carray(pointer(arrays[9]), (links, 6), np.float64),
        carray(pointer(arrays[10]), (links,), np.float64),
        carray(pointer(arrays[11]), (links, 3), np.float64),
    )
    load = carray(pointer(arrays[12]), (links,), np.float64)
    totals = carray(pointer(arrays[13]), (3,), np.float64)
    geoms = (
        carray(pointer(arrays[14]), (geom_count,), np.int32),
        carray(pointer(arrays[15]), (geom_count,), np.int32),
        carray(pointer(arrays[39]), (bodies,), np.int32),
    )
    ground = (
        carray(pointer(arrays[16]), (geom_count, 3), np.float64),
        carray(pointer(arrays[17]), (ball_count,), np.int32),
        carray(pointer(arrays[40]), (ball_count,), np.float64),
        carray(pointer(arrays[18]), (sizes[4], sizes[5]), np.float64),
        (constants[5], constants[6], constants[7]),
        carray(pointer(arrays[19]), (ball_count, PLANES), np.int32),
        carray(pointer(arrays[20]), (geom_count, 3), np.float64),
        carray(pointer(arrays[21]), (geom_count, 4), np.float64),
    )
    drive = (
        carray(pointer(arrays[22]), (joints,), np.float64),
        carray(pointer(arrays[23]), (joints,), np.float64),
        carray(pointer(arrays[24]), (joints,), np.float64),
        carray(pointer(arrays[25]), (joints,), np.float64),
        carray(pointer(arrays[26]), (joints,), np.float64),
        carray(pointer(arrays[27]), (joints,), np.float64),
        carray(pointer(arrays[28]), (joints,), np.float64),
        carray(pointer(arrays[29]), (joints,), np.float64),
        carray(pointer(arrays[30]), (joints,), np.float64),
        carray(pointer(arrays[31]), (joints,), np.float64),
        carray(pointer(arrays[32]), (joints,), np.float64),
        carray(pointer(arrays[33]), (joints,), np.float64),
        carray(pointer(arrays[34]), (joints,), np.float64),
        carray(pointer(arrays[35]), (joints,), np.float64),
        carray(pointer(arrays[36]), (joints,), np.float64),
        carray(pointer(arrays[37]), (joints,), np.float64),
    )
    gears = (
        carray(pointer(arrays[38]), (12, joints), np.float64),
        carray(pointer(arrays[43]), (joints + 6,), np.float64),
        carray(pointer(arrays[44]), (joints + 6,), np.float64),
        carray(pointer(arrays[45]), (joints + 6,), np.float64),
    )
    mass_kg = carray(pointer(arrays[41]), (links,), np.float64)
    water = carray(pointer(arrays[42]), (links, 7), np.float64)
    law = (constants[0], constants[1], constants[2], constants[3], constants[4])
    state = (at, rate, force)
    contacts, words = sizes[7], sizes[8]
    held = carray(pointer(arrays[52]), (contacts,), np.int64)
    held[:] = -1  # others may have been at the memory since the last run
    bellies = (
        carray(pointer(arrays[46]), (contacts, words), np.int64),
        carray(pointer(arrays[47]), (contacts, 2), np.int32),
        carray(pointer(arrays[48]), (contacts, 3), np.float64),
        carray(pointer(arrays[49]), (bodies, bodies), np.float64),
        carray(pointer(arrays[50]), (3, bodies), np.float64),
        carray(pointer(arrays[51]), (geom_count, 9), np.float64),
        held,
        *(sizes[9], sizes[10]),
    )
    _steps(
        *(steps, where, state, chain, work, geoms, ground, law, gears, drive, load, totals),
        *(mass_kg, water, sizes[6], bellies),
    )
    return float(carray(pointer(where[_TIME]), (1,), np.float64)[0])


register_jitable(error_model="numpy", inline="always")(_move)

register_jitable(error_model="numpy", inline="always")(_collect)

register_jitable(error_model="numpy")(_line_up)

register_jitable(error_model="numpy")(_add_friction)

register_jitable(error_model="numpy", inline="always")(_weigh)

register_jitable(error_model="numpy")(_step1)

register_jitable(error_model="numpy")(_has_friction)

register_jitable(error_model="numpy")(_steps)

run_steps = njit(cache=True, error_model="numpy")(_run)


class CompiledSteps:
    """Drive, friction and MuJoCo's step in one compiled loop.

    Raises:
        PhysicsError: the memory layout of the installed MuJoCo cannot be verified.

    """

    def __init__(self, mechanics: Mechanics) -> None:
        layout = step_layout()
        if layout is None:
            raise PhysicsError(
                f"MuJoCo {mujoco.__version__}: its memory layout is not the one that the compiled "
                "steps read; install a version of pyproject.toml's range"
            )
        m = self._m = mechanics
        d = m.data
        base = d._address
        self._where = np.array(
            [
                layout.step1_address,
                layout.step2_address,
                m.model._address,
                base,
                base + layout.ncon,
                base + layout.contact,
                base + layout.efc_force,
                layout.contact_size,
                layout.contact_dist,
                layout.contact_pos,
                layout.contact_normal,
                layout.contact_geom,
                layout.contact_row,
                layout.kinematics_address,
                base + layout.time,
                base + layout.parena,
                *layout.parts,
            ],
            dtype=np.int64,
        )
        links = m.joint_count + 1
        found = BellyContacts.of(m, layout) if layout.parts else None
        bellies = self._bellies = found or NO_CONTACTS
        self._work = np.zeros((3, m.model.nbody))
        self._held = np.zeros(len(bellies.words), np.int64)
        self._arrays = (
            *(d.qpos, d.qvel, d.qfrc_applied),
            *(d.xipos, d.xmat, d.xanchor, d.xaxis),
            *(np.zeros((links, 3)), np.zeros((links, 3)), np.zeros((links, 6)), np.zeros(links)),
            *(m.before_m, m.load_n, m.totals, m.model.geom_bodyid, m.contact_role),
            *(d.geom_xpos, m.planes.balls, m.planes.z_m, m.planes.planes),
            *(m.model.geom_pos, m.model.geom_quat),
        )
        sizes = (
            m.joint_count,
            m.model.nbody,
            m.model.ngeom,
            len(m.planes.balls),
            *m.planes.z_m.shape,
            m.spine_links,
            *bellies.words.shape,
            *bellies.hessian,
        )
        self._sizes = np.array(sizes, dtype=np.int64)
        self._mu = m.mu
        self._constants = np.array([*m.mu, m.radius_m, m.step_s, *m.planes.corner_m])
        self._drive: ServoDrive | None = None
        self._addresses = np.zeros(0, dtype=np.int64)

    def run(self, steps: int, drive: ServoDrive) -> float:
        """Advance ``steps`` steps; MuJoCo's time then."""
        if drive is not self._drive:
            self._drive = drive
            m = self._m
            motors = (*drive.columns(), m.gears)
            links = m.model.body_parentid, m.planes.radius_m, m.link_mass_kg, m.water
            joints = m.model.dof_frictionloss, m.data.qfrc_bias, m.data.qfrc_constraint
            bellies = self._bellies
            contacts = (
                *(bellies.words, bellies.geoms, bellies.shapes_m, bellies.reach_m2, self._work),
                *(m.data.geom_xmat, self._held),
            )
            arrays = (*self._arrays, *motors, *links, *joints, *contacts)
            self._addresses = np.array([each.ctypes.data for each in arrays], dtype=np.int64)
        mu = self._m.mu
        if mu is not self._mu:
            self._mu, self._constants[:3] = mu, mu
        return float(run_steps(steps, self._where, self._addresses, self._sizes, self._constants))
