"""Addresses and sizes for the compiled steps: one record with a name per field.

Passing forty arrays separately would need 7 us per call.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numba import carray
from numba.extending import register_jitable
from numpy.typing import NDArray

from snakewalk.config.arrays import Floats, Int32s
from snakewalk.sim.physics.addresses import pointer
from snakewalk.sim.physics.step_state import (
    Body,
    Chain,
    ContactFields,
    Gears,
    Geoms,
    Law,
    Links,
    Motors,
    Shafts,
    State,
)
from snakewalk.sim.physics.tangent_planes import PLANES

FUNCTIONS = (
    "mj_kinematics",
    "mj_step1",
    "mj_step2",
    "mju_quat2Mat",
    "mj_checkPos",
    "mj_checkVel",
    "mj_comPos",
    "mj_makeM",
    "mj_factorM",
    "mj_collision",
    "mj_makeConstraint",
    "mj_projectConstraint",
    "mj_fwdVelocity",
    "mj_addContact",
)
"""C functions that the steps call. A chain is one island, so the search for islands is left out.
Then the functions after ``WHOLE`` are the parts of ``mj_step1`` for a chain without actuators,
sensors and cameras, in their order, with ``mj_kinematics`` before ``mj_comPos``. The last one adds
a contact."""
WHOLE = 4
POINTERS = ("model", "data", "time", "ncon", "contact", "efc_force", "parena")
"""Addresses of MuJoCo's structures and of fields of ``mjData``."""
CONTACT = ("size", "dist", "place", "normal", "geom", "row", "hessian_begin", "hessian_end")
"""Size of an ``mjContact`` and offsets of its fields, in bytes; the last two in words of eight."""
SIZES = (
    "joints",
    "bodies",
    "geoms",
    "spine",
    "balls",
    "rows",
    "columns",
    "contacts",
    "words",
)
STATE = ("qpos", "qvel", "qfrc_applied", "xipos", "xmat", "xanchor", "xaxis")
LINKS = ("velocity", "spin", "wrench", "depth", "before", "load", "mass_kg", "water")
MODEL = ("body_parentid", "geom_bodyid", "contact_role", "geom_pos", "geom_quat")
GROUND = ("geom_xpos", "geom_xmat", "ball_geoms", "ball_m", "z_m", "planes")
GEARS = (
    "gears",
    "dof_frictionloss",
    "qfrc_bias",
    "qfrc_constraint",
    "rotor",
    "dof_armature",
)
BELLIES = (
    "belly_words",
    "belly_geoms",
    "belly_shapes_m",
    "reach_m2",
    "belly_work",
    "held",
    "plane_axes",
)
ARRAYS = (
    *STATE,
    *LINKS,
    *MODEL,
    *GROUND,
    *GEARS,
    *BELLIES,
    *Motors._fields,
    "totals",
    "work",
)
GRIP = ("along", "across", "back", "law")
"""``FrictionConfig.grip``."""
CONSTANTS = (*GRIP, "radius_m", "step_s", "x0_m", "y0_m", "spacing_m")

STEP_MEMORY = np.dtype(
    [
        *((f"{name}_at", np.int64) for name in (*FUNCTIONS, *POINTERS, *ARRAYS)),
        *((f"contact_{name}", np.int64) for name in CONTACT),
        *((f"count_{name}", np.int64) for name in SIZES),
        *((name, np.float64) for name in CONSTANTS),
    ]
)


def addresses(arrays: Mapping[str, NDArray[Any]]) -> dict[str, int]:
    """``STEP_MEMORY`` fields of some of ``ARRAYS``."""
    return {f"{name}_at": array.ctypes.data for name, array in arrays.items()}


def set_fields(memory: NDArray[np.void], fields: Mapping[str, float]) -> None:
    """Write fields of a ``STEP_MEMORY`` (1,)."""
    for name, value in fields.items():
        memory[name] = value


def reals_at(address: int, shape: Any) -> Floats:
    """View numbers at an address."""
    view: Floats = carray(pointer(address), shape, np.float64)
    return view


def integers_at(address: int, shape: Any) -> Int32s:
    """View 32-bit integers at an address."""
    view: Int32s = carray(pointer(address), shape, np.int32)
    return view


def _chain(m: Any) -> Chain:
    bodies = m.count_bodies
    links = m.count_joints + 1
    return Chain(
        reals_at(m.xipos_at, (bodies, 3)),
        reals_at(m.xmat_at, (bodies, 9)),
        reals_at(m.xanchor_at, (links, 3)),
        reals_at(m.xaxis_at, (links, 3)),
        integers_at(m.body_parentid_at, (bodies,)),
    )


def _links(m: Any) -> Links:
    links = m.count_joints + 1
    return Links(
        reals_at(m.velocity_at, (links, 3)),
        reals_at(m.spin_at, (links, 3)),
        reals_at(m.wrench_at, (links, 6)),
        reals_at(m.depth_at, (links,)),
        reals_at(m.before_at, (links, 3)),
        reals_at(m.load_at, (links,)),
        reals_at(m.mass_kg_at, (links,)),
        reals_at(m.water_at, (links, 9)),
    )


def _motors(m: Any) -> Motors:
    joints = (m.count_joints,)
    return Motors(
        reals_at(m.on_at, joints),
        reals_at(m.goal_at, joints),
        reals_at(m.gain_at, joints),
        reals_at(m.pwm_limit_at, joints),
        reals_at(m.supply_at, joints),
        reals_at(m.ohm_at, joints),
        reals_at(m.k_t_at, joints),
        reals_at(m.k_e_at, joints),
        reals_at(m.current_limit_at, joints),
        reals_at(m.current_at, joints),
        reals_at(m.torque_at, joints),
        reals_at(m.pwm_at, joints),
        reals_at(m.drawn_j_at, joints),
        reals_at(m.returned_j_at, joints),
        reals_at(m.heat_j_at, joints),
        reals_at(m.work_j_at, joints),
    )


def body_at(m: Any) -> Body:
    """Return the arrays of a body (compiled code only)."""
    freedoms = m.count_joints + 6
    geoms = m.count_geoms
    return Body(
        State(
            reals_at(m.qpos_at, (freedoms + 1,)),
            reals_at(m.qvel_at, (freedoms,)),
            reals_at(m.qfrc_applied_at, (freedoms,)),
        ),
        _chain(m),
        _links(m),
        Geoms(integers_at(m.geom_bodyid_at, (geoms,)), integers_at(m.contact_role_at, (geoms,))),
        Law((m.along, m.across, m.back, m.law), m.radius_m, m.step_s, m.count_spine),
        reals_at(m.totals_at, (3,)),
    )


def shafts_at(m: Any) -> Shafts:
    """Return the arrays of motors and gears (compiled code only)."""
    joints = m.count_joints
    freedoms = m.count_joints + 6
    gears = Gears(
        reals_at(m.gears_at, (13, joints)),
        reals_at(m.dof_frictionloss_at, (freedoms,)),
        reals_at(m.qfrc_bias_at, (freedoms,)),
        reals_at(m.qfrc_constraint_at, (freedoms,)),
        reals_at(m.rotor_at, (5, joints)),
        reals_at(m.dof_armature_at, (freedoms,)),
    )
    return Shafts(_motors(m), gears, reals_at(m.work_at, (2, joints)))


def ground_at(m: Any) -> tuple[Any, ...]:
    """Return the arguments of ``tangent_planes.lay_planes`` (compiled code only)."""
    geoms = m.count_geoms
    balls = m.count_balls
    return (
        reals_at(m.geom_xpos_at, (geoms, 3)),
        integers_at(m.ball_geoms_at, (balls,)),
        reals_at(m.ball_m_at, (balls,)),
        reals_at(m.z_m_at, (m.count_rows, m.count_columns)),
        (m.x0_m, m.y0_m, m.spacing_m),
        integers_at(m.planes_at, (balls, PLANES)),
        reals_at(m.geom_pos_at, (geoms, 3)),
        reals_at(m.geom_quat_at, (geoms, 4)),
    )


def contact_fields_at(m: Any) -> ContactFields:
    """Return the offsets of a contact's fields (compiled code only)."""
    return ContactFields(
        m.contact_size // 8,
        m.contact_dist // 8,
        m.contact_place // 8,
        m.contact_normal // 8,
        m.contact_geom // 4,
        m.contact_row // 4,
    )


for _function in (reals_at, integers_at, _chain, _links, _motors, body_at, shafts_at, ground_at):
    register_jitable(_function)

register_jitable(contact_fields_at)
