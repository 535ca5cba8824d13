"""The body of an animal with legs: its skin on the spine, skinned legs, tapered ornaments.

[KP] 4.1 builds a goat of eleven parts and a lizard of five, each of ellipses.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from snakewalk.config.animal import AnimalConfig, OrnamentConfig
from snakewalk.config.arrays import Floats, Ints
from snakewalk.controller.animals.legged.leg import toe_left
from snakewalk.controller.animals.legged.leg_mesh import LegColours, carried_part, leg_parts
from snakewalk.controller.animals.legged.motion_transformation import AnimalMotion, body_frame
from snakewalk.controller.animals.legged.prototype import SEGMENTS
from snakewalk.controller.animals.mesh.rig import Rig, spine_rig
from snakewalk.controller.animals.mesh.skin import Skin, Weights
from snakewalk.controller.gaits.wave import TURN
from snakewalk.controller.images.mesh import Mesh
from snakewalk.controller.track.bone_motion import BoneMotion

_RING_CORNERS = 14
"""Corners of a ring."""
_ROWS = 7
"""Rings of a bowed ornament between its ends."""
_POINT = 0.15
"""Radius of an ornament's tip, divided by the root's."""
_PLAIN_UV = 0.3, 0.98
"""A place of the texture outside its bands."""
_DARK_V = 0.5
_LEG_BONES = tuple(
    dict(zip(("blade", "upper", "lower", "cannon", "foot"), names, strict=True))
    for names in (
        ("scapula", "upper_arm", "forearm", "fore_cannon", "fore_foot"),
        ("hip", "thigh", "shank", "hind_cannon", "hind_foot"),
    )
)
"""Names of the parts of a front and of a hind leg."""


def animal_rig(animal: AnimalConfig, skin: Skin, bands: int) -> Rig:
    """Hang the parts of an animal on its bones, which are in the order of ``animal_bones``.

    ``skin`` has the animal's length; ``bands`` is the number of its bands, for dark ornaments.
    """
    length_m = animal.length_m
    base = spine_rig(skin, np.full(SEGMENTS, length_m / SEGMENTS))
    parts = [(base.mesh, base.held)]
    rest = list(base.rest_m)
    parent = base.parent.tolist()
    names = list(base.names)

    def hang(corners: Floats, carrier: int, uv: tuple[float, float]) -> None:
        """Add a bone with its part."""
        parts.append(carried_part(corners, _RING_CORNERS, len(rest), uv))
        rest.append(np.zeros(3))
        parent.append(carrier)
        names.append(f"ornament_{len(names) - ornaments:02d}")

    dark = (1.0 / bands if bands else 0.5), _DARK_V
    for pair, bones in zip(animal.leg_pairs, _LEG_BONES, strict=True):
        for side, suffix in ((1.0, "left"), (-1.0, "right")):
            names += [f"{bones[part]}_{suffix}" for part in pair.parts]
            first = len(rest)
            parts += leg_parts(pair, length_m, first, side, LegColours(_PLAIN_UV, dark))
            starts_m = length_m * np.concatenate([[0.0], np.cumsum(pair.segments)[:-1]])
            rest += [np.array([-start, 0.0, 0.0]) for start in starts_m]
            parent += [_carrier(pair.at), *range(first, first + len(starts_m) - 1)]
    ornaments = len(names)
    for ornament in animal.all_ornaments:
        thick_m = length_m * ornament.thick
        cone = _horn(ornament, length_m, thick_m)
        uv = dark if ornament.dark else _PLAIN_UV
        if ornament.swing_rad > 0.0:
            hang(cone, _carrier(ornament.at), uv)
        else:
            root = length_m * np.array(ornament.root) + [-ornament.at * length_m, 0.0, skin.axis_m]
            parts.append(
                carried_part(
                    cone @ _ornament_rotation(ornament).T + root,
                    _RING_CORNERS,
                    _carrier(ornament.at),
                    uv,
                )
            )
    mesh, held = _joined_mesh(parts)
    return Rig(mesh, held, np.array(rest), np.array(parent, dtype=np.int64), tuple(names))


def animal_bones(animal: AnimalConfig, motion: AnimalMotion) -> BoneMotion:
    """Bones over time: spine, segments of each leg, each ornament that swings."""
    length_m = animal.length_m
    front = [motion.spine_m[:, k] for k in range(SEGMENTS)]
    turns = [
        _facing(motion.spine_m[:, k] - motion.spine_m[:, k + 1], motion.up) for k in range(SEGMENTS)
    ]
    long_m = [length_m / SEGMENTS] * SEGMENTS
    frame = body_frame(motion.spine_m, motion.up)
    for k, joints in enumerate(motion.joints_m):
        pair = animal.leg_pairs[k // 2]
        steps_m = joints[:, :-1] - joints[:, 1:]
        front += [joints[:, j] for j in range(steps_m.shape[1])]
        turns += [_facing(steps_m[:, j], frame.ahead) for j in range(steps_m.shape[1])]
        long_m += [length_m * part for part in pair.segments]
        if pair.foot > 0.0:
            right = -toe_left(pair, frame, 1.0 if k % 2 == 0 else -1.0)
            turns[-1] = _rotation_from_axes(steps_m[:, -1], right)
    steps = 2.0 * TURN * motion.time_s / animal.cycle_s
    for ornament in animal.all_ornaments:
        if ornament.swing_rad > 0.0:
            k = _carrier(ornament.at)
            x, y, z = ornament.root
            off = length_m * np.array([x + k / SEGMENTS - ornament.at, y, z])
            front.append(front[k] + np.einsum("tij,j->ti", turns[k], off))
            swing = Rotation.from_euler(
                "y", ornament.swing_rad * np.sin(steps)[:, None]
            ).as_matrix()
            turns.append(turns[k] @ swing @ _ornament_rotation(ornament))
            long_m.append(_length_m(ornament, length_m))
    return BoneMotion(
        motion.time_s, np.stack(front, axis=1), np.stack(turns, axis=1), np.array(long_m)
    )


def _length_m(ornament: OrnamentConfig, body_m: float) -> float:
    return body_m * float(np.linalg.norm(np.subtract(ornament.tip, ornament.root)))


def _ornament_rotation(ornament: OrnamentConfig) -> Floats:
    """(3, 3) turn of an ornament in the bone that carries it: its -x is from root to tip."""
    back = np.subtract(ornament.root, ornament.tip)[None]
    side = np.array([[0.0, 0.0, 1.0] if abs(back[0, 0]) >= abs(back[0, 2]) else [1.0, 0.0, 0.0]])
    return np.asarray(_facing(back, side)[0])


def _facing(forward: Floats, up: Floats) -> Floats:
    """(T, 3, 3) turns whose x is along ``forward`` and whose z is as near to ``up`` as possible."""
    y = np.cross(np.broadcast_to(up, forward.shape), forward)
    return _rotation_from_axes(forward, y / np.linalg.norm(y, axis=1, keepdims=True))


def _rotation_from_axes(forward: Floats, y: Floats) -> Floats:
    """(T, 3, 3) turns whose x is along ``forward`` and whose y is ``y``, normal to it."""
    x = forward / np.linalg.norm(forward, axis=1, keepdims=True)
    return np.stack([x, y, np.cross(x, y)], axis=-1)


def _carrier(share: float) -> int:
    return min(int(share * SEGMENTS), SEGMENTS - 1)


def _horn(ornament: OrnamentConfig, length_m: float, thick_m: float) -> Floats:
    """(V, 3) rings of a cone in its bone, bowed as a parabola, then its two tips."""
    long_m = _length_m(ornament, length_m)
    cone = _tube(long_m, thick_m, _POINT * thick_m, _ROWS if any(ornament.bow) else 1)
    on = np.clip(-cone[:, 0] / long_m, 0.0, 1.0)
    bow = length_m * np.array(ornament.bow) @ _ornament_rotation(ornament)
    return cone + 4.0 * (on * (1.0 - on))[:, None] * bow


def _tube(long_m: float, thick_m: float, end_m: float, rows: int) -> Floats:
    """(V, 3) rings of a tapered tube along -x from 0, round at both ends, then its two tips."""
    cap = np.array([1.0, 2.0]) * np.pi / 6.0
    on = np.linspace(0.0, 1.0, rows + 2)
    x = [*(thick_m * np.cos(cap)), *(-long_m * on), *(-long_m - end_m * np.sin(cap))]
    taper = thick_m + (end_m - thick_m) * on
    radius = [*(thick_m * np.sin(cap)), *taper, *(end_m * np.cos(cap))]
    turn = np.arange(_RING_CORNERS) * TURN / _RING_CORNERS
    y, z = np.outer(radius, np.cos(turn)), np.outer(radius, np.sin(turn))
    rings = np.stack([np.repeat(x, _RING_CORNERS), y.ravel(), z.ravel()], axis=-1)
    return np.vstack([rings, [thick_m, 0.0, 0.0], [-long_m - end_m, 0.0, 0.0]])


def _joined_mesh(parts: list[tuple[Mesh, Weights]]) -> tuple[Mesh, Weights]:
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh, _ in parts)])
    faces: list[Ints] = [
        mesh.faces + start for (mesh, _), start in zip(parts, starts[:-1], strict=True)
    ]
    meshes, part_weights = zip(*parts, strict=True)
    return (
        Mesh(
            vertices=np.concatenate([mesh.vertices for mesh in meshes]),
            normals=np.concatenate([mesh.normals for mesh in meshes]),
            uv=np.concatenate([mesh.uv for mesh in meshes]),
            faces=np.concatenate(faces),
        ),
        Weights(
            np.concatenate([weights.bones for weights in part_weights]),
            np.concatenate([weights.shares for weights in part_weights]),
        ),
    )
