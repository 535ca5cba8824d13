"""The compiled steps of a plant: drive, friction and MuJoCo's step without Python.

``mj_step1`` and ``mj_step2`` are called by address, with ``step_forces`` between them. If only
bellies can touch the ground, ``mj_step1`` is called by parts, around contacts that
``sim.physics.belly_contacts`` writes: the same bits in less time.
MuJoCo's memory layout is not a public interface. If the check of ``sim.physics.layout`` fails,
``make_steps`` returns the slower ``PublicSteps``, with the same bits.
"""

from typing import Any, Protocol

import mujoco
import numpy as np
from numba import carray
from numba.extending import register_jitable
from numpy.typing import NDArray

from snakewalk.config.arrays import Floats
from snakewalk.drivers.compiling import compiled_when_called
from snakewalk.drivers.fallbacks import report_fallback
from snakewalk.sim.physics.addresses import call, call_with, pointer
from snakewalk.sim.physics.belly_contacts import (
    NO_CONTACTS,
    BellyContacts,
    links_near,
    write_contacts,
)
from snakewalk.sim.physics.friction import make_lanes
from snakewalk.sim.physics.layout import StepLayout, step_layout
from snakewalk.sim.physics.mechanics import Mechanics
from snakewalk.sim.physics.public_steps import PublicSteps
from snakewalk.sim.physics.step_forces import apply_forces, has_friction, settle
from snakewalk.sim.physics.step_memory import (
    GRIP,
    STEP_MEMORY,
    addresses,
    body_at,
    contact_fields_at,
    ground_at,
    integers_at,
    reals_at,
    set_fields,
    shafts_at,
)
from snakewalk.sim.physics.step_state import Contacts, Motors
from snakewalk.sim.physics.tangent_planes import lay_planes
from snakewalk.sim.plant import ServoDrive


class Steps(Protocol):
    """Drive, friction and ``mj_step``, a number of times."""

    def run(self, steps: int, drive: ServoDrive) -> float:
        """Advance ``steps`` steps; return MuJoCo's time."""
        ...


def make_steps(mechanics: Mechanics) -> Steps:
    """Return the compiled steps, or the public ones if the memory layout is unexpected."""
    layout = step_layout()
    if isinstance(layout, StepLayout):
        return CompiledSteps(mechanics, layout)
    report_fallback(
        "mujoco",
        f"MuJoCo {mujoco.__version__}: steps of the simulator use its public interface, which is "
        f"slower, because {layout}; install mujoco>=3.3,<5",
    )
    return PublicSteps(mechanics)


def _bellies_at(m: Any) -> tuple[Any, ...]:
    """Return arrays for ``write_contacts`` and ``links_near``."""
    contacts = m.count_contacts
    bodies = m.count_bodies
    return (
        carray(pointer(m.belly_words_at), (contacts, m.count_words), np.int64),
        integers_at(m.belly_geoms_at, (contacts, 2)),
        reals_at(m.belly_shapes_m_at, (contacts, 3)),
        reals_at(m.reach_m2_at, (bodies, bodies)),
        reals_at(m.belly_work_at, (3, bodies)),
        reals_at(m.geom_xmat_at, (m.count_geoms, 9)),
        carray(pointer(m.held_at), (contacts,), np.int64),
        reals_at(m.plane_axes_at, (9,)),
    )


def _find_contacts(m: Any, xipos: Floats, ground: tuple[Any, ...], bellies: tuple[Any, ...]) -> int:
    """Write the contacts of the bellies; return their number, -1 if MuJoCo must search."""
    words, geoms, shapes_m, reach_m2, work, axes, claimed_slots, plane_axes = bellies
    places, balls, _, _, _, _, plane_m, plane_quat = ground
    if links_near(xipos, reach_m2, work):
        return -1
    tangent = len(balls) > 0
    ncon = integers_at(m.ncon_at, (1,))
    ncon[0] = 0
    # drops the contacts of the previous step
    call_with(m.mj_addContact_at, m.model_at, m.data_at, words.ctypes.data)
    claimed_slots[0] = 0
    list_at = carray(pointer(m.contact_at), (1,), np.int64)[0]
    reals = reals_at(list_at, (words.size,))
    fields = contact_fields_at(m)
    contact_fields = (
        fields.dist,
        fields.place,
        fields.normal,
        m.contact_hessian_begin,
        m.contact_hessian_end,
    )
    turn = m.mju_quat2Mat_at if tangent else 0
    laid = plane_m if tangent else places, plane_quat, turn, plane_axes
    count = write_contacts(
        reals, contact_fields, words, geoms, shapes_m, places, axes, *laid, claimed_slots
    )
    ncon[0] = max(count, 0)
    carray(pointer(m.parena_at), (1,), np.int64)[0] = max(count, 0) * m.contact_size
    return count


def _step1(m: Any, xipos: Floats, ground: tuple[Any, ...], bellies: tuple[Any, ...]) -> None:
    """Lay the planes and call ``mj_step1``; by parts if all contacts are of bellies."""
    model = m.model_at
    data = m.data_at
    claimed_slots = bellies[6]
    by_parts = len(claimed_slots) > 0
    tangent = len(ground[1]) > 0
    if by_parts:
        call(m.mj_checkPos_at, model, data)
        call(m.mj_checkVel_at, model, data)
    if by_parts or tangent:
        call(m.mj_kinematics_at, model, data)
    if tangent:
        lay_planes(*ground)
    if not by_parts:
        call(m.mj_step1_at, model, data)
        return
    call(m.mj_comPos_at, model, data)
    call(m.mj_makeM_at, model, data)
    call(m.mj_factorM_at, model, data)
    if _find_contacts(m, xipos, ground, bellies) < 0:
        claimed_slots[:] = -1
        if tangent:
            call(m.mj_kinematics_at, model, data)
        call(m.mj_collision_at, model, data)
    call(m.mj_makeConstraint_at, model, data)
    call(m.mj_projectConstraint_at, model, data)
    call(m.mj_fwdVelocity_at, model, data)


def _run(steps: int, memory: NDArray[np.void]) -> float:
    """Advance ``steps`` steps with ``memory`` (1,) of ``STEP_MEMORY``; return MuJoCo's time."""
    m = memory[0]
    body = body_at(m)
    shafts = shafts_at(m)
    ground = ground_at(m)
    bellies = _bellies_at(m)
    bellies[6][:] = -1  # other data may have used the memory since the last run
    rubs = has_friction(shafts.gears.terms)
    lanes = make_lanes(2 * m.count_joints)
    contact_fields = contact_fields_at(m)
    ncon = integers_at(m.ncon_at, (1,))
    contact_list = carray(pointer(m.contact_at), (1,), np.int64)
    force_list = carray(pointer(m.efc_force_at), (1,), np.int64)
    for _ in range(steps):
        _step1(m, body.chain.centre, ground, bellies)
        count = ncon[0]
        first = contact_list[0]
        contacts = Contacts(
            reals_at(first, (count * contact_fields.size,)),
            integers_at(first, (count * contact_fields.size * 2,)),
            count,
            contact_fields,
        )
        if count > len(lanes[1]):
            lanes = make_lanes(count)
        apply_forces(body, shafts, contacts, lanes)
        call(m.mj_step2_at, m.model_at, m.data_at)
        settle(body, shafts, contacts, reals_at(force_list[0], (1 << 30,)), rubs)
    return float(reals_at(m.time_at, (1,))[0])


for _function in (make_lanes, write_contacts, _bellies_at, _find_contacts, _step1):
    register_jitable(error_model="numpy")(_function)

run_steps = compiled_when_called(_run)


class CompiledSteps:
    """Drive, friction and MuJoCo's step in one compiled loop."""

    def __init__(self, mechanics: Mechanics, layout: StepLayout) -> None:
        self._mechanics = mechanics
        belly_contacts = BellyContacts.of(mechanics, layout) if layout.has_parts else None
        bellies = belly_contacts or NO_CONTACTS
        m = mechanics.model
        d = mechanics.data
        planes = mechanics.planes
        links = mechanics.joint_count + 1
        self._arrays: dict[str, NDArray[Any]] = {
            **{name: getattr(d, name) for name in ("qpos", "qvel", "qfrc_applied")},
            **{name: getattr(d, name) for name in ("xipos", "xmat", "xanchor", "xaxis")},
            **{name: getattr(d, name) for name in ("geom_xpos", "geom_xmat")},
            **{name: getattr(d, name) for name in ("qfrc_bias", "qfrc_constraint")},
            **{name: getattr(m, name) for name in ("body_parentid", "geom_bodyid")},
            **{name: getattr(m, name) for name in ("geom_pos", "geom_quat", "dof_frictionloss")},
            **{name: np.zeros((links, 3)) for name in ("velocity", "spin")},
            **{"wrench": np.zeros((links, 6)), "depth": np.zeros(links)},
            **{"before": mechanics.before_m, "load": mechanics.load_n},
            **{"mass_kg": mechanics.link_mass_kg, "water": mechanics.water},
            **{"contact_role": mechanics.contact_role, "gears": mechanics.gears},
            **{"rotor": mechanics.rotor, "dof_armature": m.dof_armature},
            **{"totals": mechanics.totals, "work": np.zeros((2, links - 1))},
            **{"ball_geoms": planes.balls, "ball_m": planes.radius_m},
            **{"z_m": planes.z_m, "planes": planes.planes},
            **{"belly_words": bellies.words, "belly_geoms": bellies.geoms},
            **{"belly_shapes_m": bellies.shapes_m, "reach_m2": bellies.reach_m2},
            **{"belly_work": np.zeros((3, m.nbody))},
            **{"held": np.zeros(len(bellies.words), np.int64), "plane_axes": np.zeros(9)},
        }
        self._memory = np.zeros(1, STEP_MEMORY)
        fields = {**layout.fields(m, d), **addresses(self._arrays), **_sizes(mechanics, bellies)}
        set_fields(self._memory, fields)
        self._mu: tuple[float, ...] = ()
        self._drive: ServoDrive | None = None

    def run(self, steps: int, drive: ServoDrive) -> float:
        """Advance ``steps`` steps; return MuJoCo's time."""
        if drive is not self._drive:
            self._drive = drive
            set_fields(self._memory, addresses(Motors(*drive.columns())._asdict()))
        mu = self._mechanics.mu
        if mu is not self._mu:
            self._mu = mu
            set_fields(self._memory, dict(zip(GRIP, mu, strict=True)))
        return float(run_steps(steps, self._memory))


def _sizes(mechanics: Mechanics, bellies: BellyContacts) -> dict[str, float]:
    """Return the counts and constants of a ``STEP_MEMORY``."""
    planes = mechanics.planes
    model = mechanics.model
    x0_m, y0_m, spacing_m = planes.corner_m
    return {
        "count_joints": mechanics.joint_count,
        "count_bodies": model.nbody,
        "count_geoms": model.ngeom,
        "count_spine": mechanics.spine_links,
        "count_balls": len(planes.balls),
        "count_rows": planes.z_m.shape[0],
        "count_columns": planes.z_m.shape[1],
        "count_contacts": bellies.words.shape[0],
        "count_words": bellies.words.shape[1],
        "radius_m": mechanics.radius_m,
        "step_s": mechanics.step_s,
        "x0_m": x0_m,
        "y0_m": y0_m,
        "spacing_m": spacing_m,
    }
