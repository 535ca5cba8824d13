"""The skin of a person: PDE surfaces through curves that the bones carry ([GC] 2.1, 2.2.1).

``Person.solved_m`` solves for the surface of the moved curves, as in the paper. ``Person.rig``
gives each corner the bones of the curves next to it, which a glTF can play.
"""

from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Floats, Image, Ints
from snakewalk.controller.animals.mesh.mesh import band_faces, vertex_normals
from snakewalk.controller.animals.mesh.patches import Tube
from snakewalk.controller.animals.mesh.pde_surface import TURN
from snakewalk.controller.animals.mesh.rig import Rig
from snakewalk.controller.animals.mesh.skin import Weights
from snakewalk.controller.animals.people.body_curves import (
    ARM,
    AROUND,
    LEG,
    TRUNK,
    BodyPart,
    body_parts,
)
from snakewalk.controller.animals.people.skeleton import BONES, PersonSkeleton, bone_name
from snakewalk.controller.images.mesh import Mesh

_ROWS = 3
"""Rows of the mesh from one curve to the next."""
_BANDS = {"trunk": (0.0, 0.4), "arm": (0.4, 0.6), "leg": (0.6, 0.8), "shoe": (0.8, 1.0)}
"""Ranges of the texture, along u, of the parts of the body."""
_SKIN = (222, 178, 148)
_HAIR = (70, 46, 32)
_SHIRT = (52, 104, 150)
_TROUSERS = (62, 66, 82)
_SHOE = (44, 38, 36)
_DARK = (40, 30, 28)
_LIPS = (186, 110, 100)


@dataclass(frozen=True, slots=True)
class Person:
    """A body: skeleton, curves and the mesh of its surfaces at rest."""

    skeleton: PersonSkeleton
    parts: tuple[BodyPart, ...]
    rig: Rig
    texture: Image

    @classmethod
    def of(cls, stature_m: float, girth: float) -> "Person":
        """Make the body of a stature; ``girth`` is a factor on all widths."""
        skeleton = PersonSkeleton.of(stature_m)
        parts = body_parts(skeleton, girth)
        return cls(skeleton, parts, _rig(skeleton, parts), texture())

    def solved_m(self, front_m: Floats, rotation: Floats) -> Floats:
        """(V, 3) corners in a pose, solved for the moved curves.

        ``front_m`` (K, 3) are the joints, ``rotation`` (K, 3, 3) the turns of the bones from rest.
        """
        rest_m = self.skeleton.joint_m
        return np.concatenate(
            [_corners(p, p.moved_m(front_m, rotation, rest_m)) for p in self.parts]
        )


def _corners(part: BodyPart, curves_m: Floats) -> Floats:
    """(V, 3) rows of a part's surface through its curves."""
    tube = Tube.through(curves_m, part.stations)
    return tube.points_m(tube.rows(_ROWS), np.arange(AROUND) * TURN / AROUND).reshape(-1, 3)


def _rig(skeleton: PersonSkeleton, parts: tuple[BodyPart, ...]) -> Rig:
    """Join the parts, and give each corner bones of the next curves."""
    corners = []
    uv = []
    faces = []
    bones = []
    shares = []
    start = 0
    for part in parts:
        points = _corners(part, part.curves_m)
        rows = len(points) // AROUND
        corners.append(points)
        low, high = _BANDS[part.name]
        place = np.linspace(0.0, 1.0, rows)
        u = low + (0.005 + 0.99 * place) * (high - low)
        across = 0.5 + 0.49 * np.cos(np.arange(AROUND) * TURN / AROUND)
        uv.append(np.stack([np.repeat(u, AROUND), np.tile(across, rows)], axis=-1))
        faces.append(_outwards(band_faces(rows, AROUND), points) + start)
        row_bones, row_shares = _row_weights(part, rows)
        bones.append(np.repeat(row_bones, AROUND, axis=0))
        shares.append(np.repeat(row_shares, AROUND, axis=0))
        start += len(points)
    vertices = np.concatenate(corners)
    triangles = np.concatenate(faces)
    mesh = Mesh(vertices, vertex_normals(vertices, triangles), np.concatenate(uv), triangles)
    weights = Weights(np.concatenate(bones), np.concatenate(shares))
    names = tuple(bone_name(name) for name, _ in BONES)
    return Rig(mesh, weights, skeleton.joint_m, skeleton.parent, names)


def _row_weights(part: BodyPart, rows: int) -> tuple[Ints, Floats]:
    """(R, 3) bones and shares of the rows, smooth between two curves."""
    count = int(part.bones.max()) + 1
    dense = np.zeros((len(part.bones), count))
    for k in range(3):
        np.add.at(dense, (np.arange(len(dense)), part.bones[:, k]), part.shares[:, k])
    place = np.linspace(0.0, len(dense) - 1.0, rows)
    before = np.minimum(place.astype(int), len(dense) - 2)
    x = (place - before)[:, None]
    blend = x * x * (3.0 - 2.0 * x)
    between = (1.0 - blend) * dense[before] + blend * dense[before + 1]
    kept = np.argsort(-between, axis=1, kind="stable")[:, :3]
    share = np.take_along_axis(between, kept, axis=1)
    return kept.astype(np.int64), share / share.sum(axis=1, keepdims=True)


def _outwards(faces: Ints, points: Floats) -> Ints:
    """Turn the faces so that their normals point away from the inside."""
    a, b, c = (points[faces[:, k]] - points.mean(axis=0) for k in range(3))
    return faces if np.einsum("fi,fi->", a, np.cross(b, c)) > 0.0 else faces[:, ::-1]


def texture() -> Image:
    """(H, W, 3) skin, hair, shirt, trousers and shoes; the first row, v = 1, faces forward."""
    high = 128
    wide = 1280
    picture = np.empty((high, wide, 3), np.uint8)
    u = (np.arange(wide) + 0.5) / wide
    v = 1.0 - (np.arange(high) + 0.5) / high
    part = {name: (u >= low) & (u < up) for name, (low, up) in _BANDS.items()}
    picture[:, part["arm"]] = _SKIN
    picture[:, part["leg"]] = _TROUSERS
    picture[:, part["shoe"]] = _SHOE
    heights = np.array([section[0] for section in TRUNK])
    place = np.clip((u / 0.4 - 0.005) / 0.99, 0.0, 1.0) * (len(heights) - 1)
    up, front = np.meshgrid(np.interp(place, np.arange(len(heights)), heights), v)
    trunk = np.empty((high, wide, 3))
    trunk[:] = _SKIN
    hair = (up > 0.958) | ((front < 0.70) & (up > 0.925)) | ((front < 0.42) & (up > 0.868))
    trunk[hair] = _HAIR
    trunk[up < 0.828 - 0.012 * front**4] = _SHIRT
    trunk[up < 0.595] = _TROUSERS
    trunk[((up - 0.926) / 0.0045) ** 2 + ((front - 0.925) / 0.028) ** 2 < 1.0] = _DARK
    trunk[(np.abs(up - 0.939) < 0.0022) & (np.abs(front - 0.92) < 0.045)] = _HAIR
    trunk[(np.abs(up - 0.887) < 0.0028) & (front > 0.945)] = _LIPS
    picture[:, part["trunk"]] = trunk[:, part["trunk"]]
    arm = (u - 0.4) / 0.2 * len(ARM)
    picture[:, part["arm"] & (arm < 3.6)] = _SHIRT
    leg = (u - 0.6) / 0.2 * len(LEG)
    picture[:, part["leg"] & (leg > len(LEG) - 0.6)] = _SHOE
    return picture
