"""The tongue of a synthesised snake ([PT] 2.6.6): a forked cylinder that slides out of the head."""

from dataclasses import replace

import numpy as np

from snakewalk.config.arrays import Floats, Image
from snakewalk.controller.animals.mesh.mesh import tube_faces, vertex_normals
from snakewalk.controller.animals.mesh.rig import Rig
from snakewalk.controller.animals.mesh.skin import Weights
from snakewalk.controller.gaits.wave import TURN
from snakewalk.controller.images.mesh import Mesh
from snakewalk.controller.track.bone_motion import BoneMotion

LENGTH = 0.05
RADIUS = 0.0018
"""Length and radius of the whole tongue, over the body's length (ours)."""
_RGB = 191, 26, 38
_ROWS = 8
"""Rows that the texture gets for the tongue's colour."""
_AROUND = 8
_HIDDEN = 2.0
"""Distance of the drawn-in tongue's tip behind the head's, over its radius."""
_FORK = 0.35
"""Share of the length that is forked."""


def rig_with_tongue(rig: Rig, length_m: float, texture: Image | None) -> tuple[Rig, Image | None]:
    """Hang a tongue on the first bone of a spine; it is the last bone, drawn in at rest.

    ``length_m`` is the body's; its texture gets rows of the tongue's colour.
    """
    mesh = rig.mesh
    bone = len(rig.rest_m)
    corners, faces = _forked(LENGTH * length_m, RADIUS * length_m)
    corners = corners + rig.rest_m[0] - [_HIDDEN * RADIUS * length_m, 0.0, 0.0]
    uv = mesh.uv
    colour = np.array([0.5, 0.5])
    if texture is not None:
        high = len(texture) + _ROWS
        red = np.broadcast_to(np.array(_RGB, np.uint8), (_ROWS, texture.shape[1], 3))
        texture = np.concatenate([texture, red])
        uv = (uv * [1.0, len(texture) - _ROWS] + [0.0, _ROWS]) / [1.0, high]
        colour = np.array([0.5, 0.5 * _ROWS / high])
    joined = Mesh(
        vertices=np.vstack([mesh.vertices, corners]),
        normals=np.vstack([mesh.normals, vertex_normals(corners, faces)]),
        uv=np.vstack([uv, np.tile(colour, (len(corners), 1))]),
        faces=np.vstack([mesh.faces, faces + len(mesh.vertices)]),
    )
    weights = Weights(
        np.vstack([rig.held.bones, np.full((len(corners), 3), bone, dtype=np.int64)]),
        np.vstack([rig.held.shares, np.tile([0.0, 1.0, 0.0], (len(corners), 1))]),
    )
    parent = np.append(rig.parent, 0)
    return Rig(joined, weights, np.vstack([rig.rest_m, rig.rest_m[0]]), parent), texture


def bones_with_tongue(bones: BoneMotion, heights: Floats) -> BoneMotion:
    """Add the tongue's bone: heights (T,), 0 drawn in and 1 out."""
    long_m = LENGTH * bones.length_m
    ahead = bones.rotation[:, 0, :, 0]
    front = bones.front_m[:, 0] + (long_m * heights)[:, None] * ahead
    return replace(
        bones,
        front_m=np.concatenate([bones.front_m, front[:, None]], axis=1),
        rotation=np.concatenate([bones.rotation, bones.rotation[:, :1]], axis=1),
        bone_m=np.append(bones.bone_m, 0.0),
    )


def _forked(long_m: float, thick_m: float) -> tuple[Floats, np.ndarray]:
    """Corners (V, 3) and faces of a stem along -x and two tips that end at x = 0."""
    turn = np.arange(_AROUND) * TURN / _AROUND
    vertices = []
    faces = []
    count = 0
    split = -_FORK * long_m
    for ends, aside, radii in (
        ((split, -long_m), (0.0, 0.0), (1.0, 1.0)),
        ((0.0, split), (3.5, 0.0), (0.35, 0.8)),
        ((0.0, split), (-3.5, 0.0), (0.35, 0.8)),
    ):
        rings = [
            np.stack(
                [
                    np.full(_AROUND, x),
                    thick_m * (off + radius * np.cos(turn)),
                    thick_m * radius * np.sin(turn),
                ],
                axis=-1,
            )
            for x, off, radius in zip(ends, aside, radii, strict=True)
        ]
        vertices += [*rings, *(ring.mean(axis=0, keepdims=True) for ring in rings)]
        faces.append(tube_faces(2, _AROUND) + count)
        count += 2 * _AROUND + 2
    return np.concatenate(vertices), np.concatenate(faces)
