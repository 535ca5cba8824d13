"""The private interface of MuJoCo: the memory of ``mjData`` and C functions by address.

The arrays of ``mjData`` never move, except those of the contact solver. The offsets come from the
structure descriptions in the mujoco package. ``step_layout`` checks them once per process.
"""

import contextlib
import ctypes
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import mujoco
import numpy as np

from snakewalk.config.arrays import Ints
from snakewalk.drivers.fallbacks import is_forced
from snakewalk.sim.physics.step_memory import FUNCTIONS, POINTERS, WHOLE

_SCALAR_TYPES: dict[str, type] = {
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
_POINTERS = (ctypes.c_void_p,) * 3
_IN_DATA = POINTERS[2:]
_WORD_BYTES = 8
_BALL = """<mujoco><worldbody><geom type="plane" size="1 1 1"/>
<body pos="0 0 .09"><freejoint/><geom size=".1"/></body></worldbody></mujoco>"""


@dataclass(frozen=True, slots=True)
class StepLayout:
    """Byte offsets in ``mjData`` and ``mjContact``, and addresses of C functions."""

    data: Mapping[str, int]
    """Addresses of ``step_memory.POINTERS`` in ``mjData``."""
    contact: Mapping[str, int]
    """Layout of a contact in memory (``step_memory.CONTACT``)."""
    functions: Mapping[str, int]
    """Addresses of MuJoCo's functions (``step_memory.FUNCTIONS``): all, or the first three."""

    @property
    def has_parts(self) -> bool:
        """Whether ``mj_step1`` can be called by parts."""
        return len(self.functions) == len(FUNCTIONS)

    def fields(self, model: mujoco.MjModel, data: mujoco.MjData) -> dict[str, int]:
        """Return the ``STEP_MEMORY`` fields of MuJoCo's memory."""
        return {
            "model_at": model._address,
            "data_at": data._address,
            **{f"{name}_at": data._address + offset for name, offset in self.data.items()},
            **{f"contact_{name}": value for name, value in self.contact.items()},
            **{f"{name}_at": address for name, address in self.functions.items()},
        }

    def contact_words(self, data: mujoco.MjData) -> Ints:
        """Copy the present contacts as (contacts, words of eight bytes)."""
        size = data.ncon * self.contact["size"] // _WORD_BYTES
        memory = (ctypes.c_int64 * size).from_address(data.contact.dist.ctypes.data)
        return np.array(memory, np.int64).reshape(data.ncon, -1)


@cache
def step_layout() -> StepLayout | str:
    """Return the layout of this MuJoCo, or the reason why it cannot be used.

    It is checked on a ball on a floor: addresses against MuJoCo's Python objects, and a step by
    parts, with a contact written in place, against ``mj_step``.
    """
    if is_forced("mujoco"):
        return "the environment asks for it"
    try:
        layout, arrays = _mujoco_layout()
    except ImportError:
        return "it does not describe its memory"
    except (KeyError, AttributeError, OSError) as error:
        return f"its memory is not described as expected ({error})"
    if not _matches_arrays(layout, arrays):
        return "its memory is not as it describes it"
    if layout.has_parts and not _steps_by_parts(layout):
        return StepLayout(layout.data, layout.contact, _addresses(FUNCTIONS[:WHOLE]))
    return layout


def _mujoco_layout() -> tuple[StepLayout, dict[str, int]]:
    """Return the layout that MuJoCo describes, and ``mjData`` offsets of two arrays."""
    data = _structure("mjData")
    contact = _structure("mjContact")
    hessian = contact.H.offset // _WORD_BYTES
    fields = {
        "size": ctypes.sizeof(contact),
        "dist": contact.dist.offset,
        "place": contact.pos.offset,
        "normal": contact.frame.offset,
        "geom": contact.geom.offset,
        "row": contact.efc_address.offset,
        "hessian_begin": hessian,
        "hessian_end": hessian + contact.H.size // _WORD_BYTES,
    }
    functions = _addresses(FUNCTIONS[:WHOLE])
    with contextlib.suppress(AttributeError):  # one of them is not exported
        functions = _addresses(FUNCTIONS)
    offsets = {name: getattr(data, name).offset for name in _IN_DATA}
    arrays = {name: getattr(data, name).offset for name in ("qpos", "qvel")}
    return StepLayout(offsets, fields, functions), arrays


def _structure(name: str) -> Any:
    ast_nodes, structs = _introspection()
    fields = []
    for member in structs.STRUCTS[name].fields:
        if not isinstance(member, ast_nodes.StructFieldDecl):
            raise KeyError(f"{name} holds an anonymous structure")
        fields.append((member.name, _ctype(member.type)))
    return type(name, (ctypes.Structure,), {"_fields_": fields})


def _introspection() -> tuple[Any, Any]:
    from mujoco.introspect import ast_nodes, structs  # noqa: PLC0415  MuJoCo 3.2 lacks it

    return ast_nodes, structs


def _ctype(kind: object) -> Any:
    ast_nodes, _ = _introspection()
    if isinstance(kind, ast_nodes.PointerType):
        return ctypes.c_void_p
    if isinstance(kind, ast_nodes.ArrayType):
        item = _ctype(kind.inner_type)
        for extent in reversed(kind.extents):
            item = item * extent
        return item
    name = str(getattr(kind, "name", kind)).removeprefix("struct ").rstrip("_")
    return _SCALAR_TYPES[name] if name in _SCALAR_TYPES else _structure(name)


def _addresses(functions: Iterable[str]) -> dict[str, int]:
    """Find C functions in the library of the Python module."""
    library = ctypes.CDLL(mujoco._functions.__file__)
    addresses = {
        name: ctypes.cast(getattr(library, name), ctypes.c_void_p).value for name in functions
    }
    return {name: address for name, address in addresses.items() if address}


def _ball() -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = mujoco.MjModel.from_xml_string(_BALL)
    return model, mujoco.MjData(model)


def _matches_arrays(layout: StepLayout, arrays: Mapping[str, int]) -> bool:
    model, data = _ball()
    mujoco.mj_step(model, data)

    def at(offset: int, kind: Any) -> float:
        value: float = kind.from_address(data._address + offset).value
        return value

    contacts = data.contact
    fields = layout.contact
    offset = layout.data
    first = contacts.dist.ctypes.data
    return bool(
        data.ncon > 0
        and at(offset["time"], ctypes.c_double) == data.time > 0.0
        and at(offset["ncon"], ctypes.c_int) == data.ncon
        and at(offset["contact"], ctypes.c_size_t) == first
        and at(offset["parena"], ctypes.c_size_t) >= data.ncon * fields["size"]
        and at(offset["efc_force"], ctypes.c_size_t) == data.efc_force.ctypes.data
        and at(arrays["qpos"], ctypes.c_size_t) == data.qpos.ctypes.data
        and at(arrays["qvel"], ctypes.c_size_t) == data.qvel.ctypes.data
        and fields["size"] == contacts.dist.strides[0]
        and fields["dist"] == 0
        and fields["place"] == contacts.pos.ctypes.data - first
        and fields["normal"] == contacts.frame.ctypes.data - first
        and fields["geom"] == contacts.geom.ctypes.data - first
        and fields["row"] == contacts.efc_address.ctypes.data - first
    )


def _steps_by_parts(layout: StepLayout) -> bool:
    """Whether steps by parts, with a contact written in place, equal ``mj_step`` to the bit."""
    model, reference = _ball()
    _, parts = _ball()
    part = ctypes.CFUNCTYPE(None, *_POINTERS[:2])
    add = ctypes.CFUNCTYPE(ctypes.c_int, *_POINTERS)
    calls = {name: part(address) for name, address in layout.functions.items()}
    add_contact = add(layout.functions["mj_addContact"])
    for _ in range(3):
        mujoco.mj_step(model, reference)
        for name in FUNCTIONS[WHOLE:-4]:
            if name == "mj_comPos":
                calls["mj_kinematics"](model._address, parts._address)
            calls[name](model._address, parts._address)
        words = layout.contact_words(parts)
        fields = layout.fields(model, parts)
        count = len(words)
        if count != 1:
            return False
        ctypes.c_int.from_address(fields["ncon_at"]).value = 0
        if add_contact(model._address, parts._address, words.ctypes.data) != 0:
            return False
        begin, end = layout.contact["hessian_begin"], layout.contact["hessian_end"]
        first = parts.contact.dist.ctypes.data
        ctypes.memmove(first, words.ctypes.data, begin * _WORD_BYTES)
        ctypes.memmove(
            first + end * _WORD_BYTES,
            words.ctypes.data + end * _WORD_BYTES,
            (words.shape[1] - end) * _WORD_BYTES,
        )
        ctypes.c_int.from_address(fields["ncon_at"]).value = count
        ctypes.c_int64.from_address(fields["parena_at"]).value = count * layout.contact["size"]
        for name in (*FUNCTIONS[-4:-1], "mj_step2"):
            calls[name](model._address, parts._address)
        pairs = ((reference.qpos, parts.qpos), (reference.qvel, parts.qvel))
        if any(array.tobytes() != other.tobytes() for array, other in pairs):
            return False
    return bool(reference.efc_force.tobytes() == parts.efc_force.tobytes())
