"""Where MuJoCo keeps a step's contacts in memory, so that compiled code can follow them.

The arrays of ``mjData`` never move, except those of the contact solver, which are laid out anew in
every step. The offsets come from the description of the C structures that the mujoco package
carries, and are checked against the addresses that its Python objects show.
"""

import ctypes
from dataclasses import dataclass
from functools import cache

import mujoco
from mujoco.introspect import ast_nodes, structs

_PLAIN: dict[str, type] = {
    "int": ctypes.c_int,
    "float": ctypes.c_float,
    "char": ctypes.c_char,
    "size_t": ctypes.c_size_t,
    "uintptr_t": ctypes.c_void_p,
    "uint64_t": ctypes.c_uint64,
    "mjtSize": ctypes.c_int64,
    "mjtNum": ctypes.c_double,
    "mjtBool": ctypes.c_uint8,
    "mjtByte": ctypes.c_uint8,
}
_BALL = """<mujoco><worldbody><geom type="plane" size="1 1 1"/>
<body pos="0 0 .09"><freejoint/><geom size=".1"/></body></worldbody></mujoco>"""


@dataclass(frozen=True, slots=True)
class StepLayout:
    """Byte offsets in ``mjData`` and ``mjContact``, and what compiled code calls."""

    time: int
    ncon: int
    contact: int
    efc_force: int
    contact_size: int
    contact_dist: int
    contact_pos: int
    contact_normal: int
    contact_geom: int
    contact_row: int
    """Of a contact's first row in ``efc_force``, -1 for none."""
    contact_hessian: tuple[int, int]
    """Begin and end of what the solver notes of a contact with friction."""
    kinematics_address: int
    """Of ``mj_kinematics(model, data)``: where everything is."""
    step1_address: int
    """Of the C function ``mj_step1(model, data)``: all that follows from position and velocity."""
    step2_address: int
    """Of ``mj_step2(model, data)``: forces, and the state after them."""
    parena: int
    """Bytes of the arena that are taken, the contacts first."""
    parts: tuple[int, ...]
    """Addresses of the ``STEP1_PARTS``; none where this MuJoCo has not all of them."""


STEP1_PARTS = (
    *("mj_checkPos", "mj_checkVel", "mj_comPos", "mj_makeM", "mj_factorM", "mj_collision"),
    *("mj_makeConstraint", "mj_projectConstraint", "mj_fwdVelocity", "mj_addContact"),
)
"""Of ``mj_step1`` all that a chain without actuators, sensors and cameras needs; and what adds a
contact. Left out is the search for islands: a chain is one."""


@cache
def step_layout() -> StepLayout | None:
    """Offsets for this MuJoCo, or None where they cannot be verified on a ball on a floor."""
    try:
        of_data, of_contact = _structure("mjData"), _structure("mjContact")
        layout = StepLayout(
            time=of_data.time.offset,
            ncon=of_data.ncon.offset,
            contact=of_data.contact.offset,
            efc_force=of_data.efc_force.offset,
            contact_size=ctypes.sizeof(of_contact),
            contact_dist=of_contact.dist.offset,
            contact_pos=of_contact.pos.offset,
            contact_normal=of_contact.frame.offset,
            contact_geom=of_contact.geom.offset,
            contact_row=of_contact.efc_address.offset,
            contact_hessian=(of_contact.H.offset, of_contact.H.offset + of_contact.H.size),
            kinematics_address=_address("mj_kinematics"),
            step1_address=_address("mj_step1"),
            step2_address=_address("mj_step2"),
            parena=of_data.parena.offset,
            parts=_parts(),
        )
    except (KeyError, AttributeError, OSError):
        return None
    return layout if _verified(layout, of_data) else None


def _structure(name: str) -> type[ctypes.Structure]:
    fields = []
    for member in structs.STRUCTS[name].fields:
        if not isinstance(member, ast_nodes.StructFieldDecl):
            raise KeyError(f"{name} holds an anonymous structure")
        fields.append((member.name, _ctype(member.type)))
    return type(name, (ctypes.Structure,), {"_fields_": fields})


def _ctype(kind: object) -> type:
    if isinstance(kind, ast_nodes.PointerType):
        return ctypes.c_void_p
    if isinstance(kind, ast_nodes.ArrayType):
        item = _ctype(kind.inner_type)
        for extent in reversed(kind.extents):
            item = item * extent
        return item
    name = str(getattr(kind, "name", kind)).removeprefix("struct ").rstrip("_")
    return _PLAIN[name] if name in _PLAIN else _structure(name)


def _address(function: str) -> int:
    """Find a C function in the library that the Python module itself is linked to."""
    library = ctypes.CDLL(mujoco._functions.__file__)
    address = ctypes.cast(getattr(library, function), ctypes.c_void_p).value
    if address is None:
        raise OSError(f"{function} is not exported")
    return address


def _parts() -> tuple[int, ...]:
    try:
        return tuple(map(_address, STEP1_PARTS))
    except AttributeError:
        return ()


def _verified(layout: StepLayout, of_data: type[ctypes.Structure]) -> bool:
    model = mujoco.MjModel.from_xml_string(_BALL)
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data)

    def at(offset: int, kind: type) -> float:
        value: float = kind.from_address(data._address + offset).value  # type: ignore[attr-defined]
        return value

    contacts = data.contact
    stable = of_data.qpos.offset, of_data.qvel.offset
    return (
        data.ncon > 0
        and at(layout.time, ctypes.c_double) == data.time > 0.0
        and at(layout.ncon, ctypes.c_int) == data.ncon
        and at(layout.contact, ctypes.c_size_t) == contacts.dist.ctypes.data
        and at(layout.parena, ctypes.c_size_t) >= data.ncon * layout.contact_size
        and at(layout.efc_force, ctypes.c_size_t) == data.efc_force.ctypes.data
        and at(stable[0], ctypes.c_size_t) == data.qpos.ctypes.data
        and at(stable[1], ctypes.c_size_t) == data.qvel.ctypes.data
        and layout.contact_size == contacts.dist.strides[0]
        and layout.contact_dist == 0
        and layout.contact_pos == contacts.pos.ctypes.data - contacts.dist.ctypes.data
        and layout.contact_normal == contacts.frame.ctypes.data - contacts.dist.ctypes.data
        and layout.contact_geom == contacts.geom.ctypes.data - contacts.dist.ctypes.data
        and layout.contact_row == contacts.efc_address.ctypes.data - contacts.dist.ctypes.data
    )
