"""Belly contacts with the ground, found and written into MuJoCo's list of contacts.

MuJoCo searches contacts among all geoms. On a chain the belly, plane and parameters of nearly every
contact are known. Depth, place and normal are computed here, bit-identical to MuJoCo. MuJoCo still
searches when links come near each other, and for models with other contacts, such as feet and
obstacles.
"""

import copy
from dataclasses import dataclass

import mujoco
import numpy as np

from snakewalk.config.arrays import Bools, Floats, Int32s, Ints
from snakewalk.drivers.compiling import compiled, readonly_array
from snakewalk.sim.physics.addresses import call, copy_words
from snakewalk.sim.physics.layout import StepLayout
from snakewalk.sim.physics.mechanics import GROUND, Mechanics
from snakewalk.sim.physics.tangent_planes import AWAY_M, PLANES, TangentPlanes

_ROWS = readonly_array(dimensions=2, layout="C")
_WORD_BYTES = 8
_DEEP_M = 1e-3
"""Depth of the contacts that give the constants."""
_SAFE = 1.0 + 1e-9
"""Factor on the distance at which links can touch, against rounding."""


@dataclass(frozen=True, slots=True)
class BellyContacts:
    """All contacts that the bellies of one model can have with its ground, in MuJoCo's order."""

    words: Ints
    """(C, words of an ``mjContact``) what is the same in every step."""
    geoms: Int32s
    """(C, 2) plane and belly."""
    shapes_m: Floats
    """(C, 3) where on the belly's axis the ball lies that touches, its radius, and the margin."""
    reach_m2: Floats
    """(bodies, bodies) square of the distance of two centres of mass from which on the bodies do
    not touch each other, above the diagonal; negative where they never do."""

    @classmethod
    def of(cls, mechanics: Mechanics, layout: StepLayout) -> "BellyContacts | None":
        """Read the constants from MuJoCo; None for models with other contacts."""
        model = mechanics.model
        planes = mechanics.planes
        bellies = np.array([model.geom(k).name.startswith("belly") for k in range(model.ngeom)])
        is_touching = bellies | (mechanics.contact_role == GROUND)
        others = ~is_touching & ((model.geom_contype | model.geom_conaffinity) != 0)
        more = model.nu, model.neq, model.ntendon, model.nflex, model.nsensor, model.nplugin
        if not bellies.any() or others.any() or any(more) or model.body_rootid[1:].max() > 1:
            return None
        data = _sunk(model, planes, bellies)
        count = data.ncon
        capsule = model.geom_type == mujoco.mjtGeom.mjGEOM_CAPSULE
        per_part = PLANES if len(planes.planes) else 1
        expected_count = (bellies.sum() + (bellies & capsule).sum()) * per_part
        if count != expected_count or (data.contact.dim != 1).any():
            return None
        words = layout.contact_words(data)
        geoms = data.contact.geom.astype(np.int32)
        is_capsule = capsule[geoms[:, 1]]
        second = np.concatenate([[False], (geoms[1:] == geoms[:-1]).all(axis=1)])
        along_m = np.where(is_capsule, model.geom_size[geoms[:, 1], 1], 0.0)
        along_m[second] *= -1.0
        shapes = along_m, model.geom_size[geoms[:, 1], 0], data.contact.includemargin
        return cls(words, geoms, np.stack(shapes, axis=1), _reach_m2(model, bellies))


NO_CONTACTS = BellyContacts(
    np.zeros((0, 1), np.int64),
    np.zeros((0, 2), np.int32),
    np.zeros((0, 3)),
    np.zeros((0, 0)),
)
"""Value of a model whose contacts MuJoCo finds."""


def _sunk(model: mujoco.MjModel, planes: TangentPlanes, bellies: Bools) -> mujoco.MjData:
    """A straight body, slightly sunk into its ground: it has all its contacts."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    if len(planes.planes):
        model = copy.copy(model)
        deep_m = planes.radius_m - _DEEP_M
        for k in range(PLANES):
            model.geom_pos[planes.planes[:, k]] = data.geom_xpos[planes.balls]
            model.geom_pos[planes.planes[:, k], 2] -= deep_m
            model.geom_quat[planes.planes[:, k]] = 1.0, 0.0, 0.0, 0.0
    else:
        over_m = data.geom_xpos[bellies, 2] - model.geom_size[bellies, 0]
        data.qpos[2] -= over_m.max() + _DEEP_M
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_collision(model, data)
    return data


def _reach_m2(model: mujoco.MjModel, bellies: Bools) -> Floats:
    """``BellyContacts.reach_m2``, for pairs that may touch in MuJoCo."""
    reach_m = np.zeros(model.nbody)
    for geom in np.flatnonzero(bellies):
        body = int(model.geom_bodyid[geom])
        away_m = float(np.linalg.norm(model.geom_pos[geom] - model.body_ipos[body]))
        reach_m[body] = max(reach_m[body], away_m + model.geom_rbound[geom])
    excluded_pairs = {int(signature) for signature in model.exclude_signature}
    squares = np.full((model.nbody, model.nbody), -1.0)
    for a in range(1, model.nbody):
        for b in range(a + 1, model.nbody):
            mate = a == model.body_parentid[b] or (a << 16) + b in excluded_pairs
            if reach_m[a] and reach_m[b] and not mate:
                squares[a, b] = ((reach_m[a] + reach_m[b]) * _SAFE) ** 2
    return squares


@compiled(f"boolean({_ROWS}, {_ROWS}, float64[:, ::1])", makes_arrays=False)
def links_near(centre_m: Floats, reach_m2: Floats, work: Floats) -> bool:
    """Whether any pair of links may touch.

    Args:
        centre_m: (bodies, 3) centres of mass in the world.
        reach_m2: (bodies, bodies) of ``BellyContacts``.
        work: (3, bodies) overwritten.

    """
    count = len(centre_m)
    near = 0
    x, y, z = work[0], work[1], work[2]
    for a in range(count):
        x[a], y[a], z[a] = centre_m[a, 0], centre_m[a, 1], centre_m[a, 2]
    for a in range(1, count):
        for b in range(a + 1, count):
            dx, dy, dz = x[b] - x[a], y[b] - y[a], z[b] - z[a]
            near += dx * dx + dy * dy + dz * dz <= reach_m2[a, b]
    return near > 0


def write_contacts(
    reals: Floats,
    fields: tuple[int, int, int, int, int],
    words: Ints,
    geoms: Int32s,
    shapes_m: Floats,
    place_m: Floats,
    axes: Floats,
    plane_m: Floats,
    plane_quat: Floats,
    turn: int,
    plane_axes: Floats,
    claimed_slots: Ints,
) -> int:
    """Write all present contacts in sequence; returns their number, -1 for MuJoCo's own search.

    Their frames get the normal only: without friction the rest is unused.

    Args:
        reals: space for all contacts, as numbers.
        fields: offsets in words of distance, place and normal; begin and end of the unused words.
        words: of ``BellyContacts``.
        geoms: of ``BellyContacts``.
        shapes_m: of ``BellyContacts``.
        place_m: (geoms, 3) centres.
        axes: (geoms, 9) rows of their matrices.
        plane_m: (geoms, 3) points of the planes.
        plane_quat: (geoms, 4) their orientations, if they were just laid; else in ``axes``.
        turn: address of ``mju_quat2Mat`` if they were just laid, else 0. Its last bits depend on
            the version of MuJoCo.
        plane_axes: (9,) overwritten.
        claimed_slots: (C,) contact whose constants each place of the list has; -1 for none.

    """
    size = words.shape[1]
    slot = 0
    room = reals.ctypes.data
    constants = words.ctypes.data
    at_dist, at_place, at_normal, first, last = fields
    for c in range(len(words)):
        plane = geoms[c, 0]
        belly = geoms[c, 1]
        along = shapes_m[c, 0]
        radius = shapes_m[c, 1]
        margin = shapes_m[c, 2]
        n0, n1, n2 = axes[plane, 2], axes[plane, 5], axes[plane, 8]
        if turn:
            if plane_m[plane, 2] <= AWAY_M:
                continue
            call(turn, plane_axes.ctypes.data, plane_quat.ctypes.data + plane * 4 * _WORD_BYTES)
            n0, n1, n2 = plane_axes[2], plane_axes[5], plane_axes[8]
        x = place_m[belly, 0] + axes[belly, 2] * along
        y = place_m[belly, 1] + axes[belly, 5] * along
        z = place_m[belly, 2] + axes[belly, 8] * along
        away = (x - plane_m[plane, 0]) * n0 + (y - plane_m[plane, 1]) * n1
        away = away + (z - plane_m[plane, 2]) * n2
        if away > margin + radius:
            continue
        dist = away - radius
        if dist >= margin:
            return -1  # it touches without load: MuJoCo lists it with a mark
        base = size * slot
        if claimed_slots[slot] != c:
            claimed_slots[slot] = c
            to = room + base * _WORD_BYTES
            source = constants + c * size * _WORD_BYTES
            copy_words(to, source, first)
            copy_words(to + last * _WORD_BYTES, source + last * _WORD_BYTES, size - last)
        back = -dist / 2.0 - radius
        length = 1.0 / np.sqrt(n0 * n0 + n1 * n1 + n2 * n2)
        reals[base + at_dist] = dist
        reals[base + at_place] = x + back * n0
        reals[base + at_place + 1] = y + back * n1
        reals[base + at_place + 2] = z + back * n2
        reals[base + at_normal] = n0 * length
        reals[base + at_normal + 1] = n1 * length
        reals[base + at_normal + 2] = n2 * length
        slot += 1
    claimed_slots[slot:] = -1  # entries after the contacts are overwritten
    return slot
