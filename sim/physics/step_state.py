"""Arrays that the forces of a step read and write, by name, for compiled code."""

from typing import NamedTuple

from snakewalk.config.arrays import Floats, Int32s, Ints

Lanes = tuple[Floats, Ints]
"""Type of the lanes that ``friction.make_lanes`` returns."""


class State(NamedTuple):
    """Generalised coordinates (7 + J,), velocities and applied forces (6 + J,)."""

    qpos: Floats
    qvel: Floats
    force: Floats


class Chain(NamedTuple):
    """Poses of the B bodies: row 0 is the world, row 1 + i is link i."""

    centre: Floats
    """(B, 3) centres of mass of the bodies."""
    rotation: Floats
    """(B, 9) rotation matrices of the bodies, row by row."""
    anchor: Floats
    """(L, 3) points on the joints' axes; row 0 is the head's free joint."""
    axis: Floats
    """(L, 3) directions of the joints' axes."""
    parents: Int32s
    """(B,) parents of the bodies in the tree."""


class Links(NamedTuple):
    """Quantities of the L links."""

    velocity: Floats
    """(L, 3) of the centres, in the last step."""
    spin: Floats
    """(L, 3) angular velocities of the links."""
    wrench: Floats
    """(L, 6) force, and torque about the world's origin."""
    depth: Floats
    """(L,) sum over the link's contacts."""
    before: Floats
    """(L, 3) centres at the start of the last step."""
    load: Floats
    """(L,) force that the ground bore in the last step."""
    mass_kg: Floats
    water: Floats
    """(L, 9) constants of the water forces (``sim.physics.water.water_constants``)."""


class Geoms(NamedTuple):
    """Body and contact role of each geom."""

    body: Int32s
    role: Int32s


class Motors(NamedTuple):
    """Columns of a ``ServoDrive``, in its order."""

    on: Floats
    goal: Floats
    gain: Floats
    pwm_limit: Floats
    supply: Floats
    ohm: Floats
    k_t: Floats
    k_e: Floats
    current_limit: Floats
    current: Floats
    torque: Floats
    pwm: Floats
    drawn_j: Floats
    returned_j: Floats
    heat_j: Floats
    work_j: Floats


class Gears(NamedTuple):
    """Friction of the gears: terms (13, J), and MuJoCo's arrays (6 + J,)."""

    terms: Floats
    friction: Floats
    bias: Floats
    constraint: Floats
    rotor: Floats
    """(5, J) state of the backlash."""
    armature: Floats
    """(6 + J,) MuJoCo's."""


class Law(NamedTuple):
    """Constants of ground friction."""

    mu: tuple[float, float, float, float]
    """Coefficients of the ground's friction (``FrictionConfig.grip``)."""
    radius_m: float
    step_s: float
    spine: int
    """Links of the spine."""


class Body(NamedTuple):
    """The body and its ground."""

    state: State
    chain: Chain
    links: Links
    geoms: Geoms
    law: Law
    totals: Floats
    """(3,) energies lost since the reset (``Mechanics.totals``)."""


class Shafts(NamedTuple):
    """Motors and gears that turn the joints."""

    motors: Motors
    gears: Gears
    work: Floats
    """(2, J) speed before the step, and the ground's torque."""


class ContactFields(NamedTuple):
    """Offsets of a contact's fields: in words of eight bytes, the last two in words of four."""

    size: int
    dist: int
    place: int
    normal: int
    geom: int
    row: int


class Contacts(NamedTuple):
    """The present contacts as numbers and, in the same memory, as integers."""

    reals: Floats
    integers: Int32s
    count: int  # type: ignore[assignment]
    at: ContactFields
