"""The skin that moves: a mesh at rest whose corners are carried by the bones of a spine.

A corner goes with the bone at its place along the spine and with that bone's neighbours. Their
shares are quadratic B-splines: they sum to one and have no kink. If bones are links that meet in
joints, the spine of the skin runs through every joint. It passes the middle of a link on the outer
side, by an eighth of the link's length times the sine of the bend. The offset of a corner from the
spine turns with the bones: [GC] 2.3 adds it unchanged, which makes a body flat after a turn by a
right angle.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from snakewalk.config.arrays import Floats, Ints
from snakewalk.controller.animals.mesh.cross_sections import AROUND, CrossSections
from snakewalk.controller.animals.mesh.mesh import tube_faces, vertex_normals
from snakewalk.controller.animals.mesh.patches import Fin, Tube
from snakewalk.controller.animals.mesh.pde_surface import TURN
from snakewalk.controller.images.mesh import Mesh

_ROWS = 4  # of the mesh from one curve to the next
_FIN_ROWS = 9
_FIN_AROUND = 24


@dataclass(frozen=True, slots=True)
class Skin:
    """A mesh of a straight body: head's tip at x = 0, tail's at ``-length``, y left, z up."""

    mesh: Mesh
    along: Floats
    """(V,) place along the spine that carries a corner, 0 the head's tip, 1 the tail's."""
    length_m: float
    axis_m: float
    """Height of the spine at rest."""

    def sized(self, length_m: float) -> "Skin":
        """Return the skin of a body of another length."""
        factor = length_m / self.length_m
        mesh = replace(self.mesh, vertices=self.mesh.vertices * factor)
        return Skin(mesh, self.along, length_m, self.axis_m * factor)


@dataclass(frozen=True, slots=True)
class Weights:
    """Which bones carry each corner."""

    bones: Ints
    """(V, 3) the bone before, the bone at the corner's place, and the one behind."""
    shares: Floats
    """(V, 3) shares of the bones in each corner; they sum to 1."""


def pde_skin(sections: CrossSections, tube: Tube, fins: tuple[Fin, ...] = ()) -> Skin:
    """Sample a tube and its fins as one mesh."""
    s = tube.rows(_ROWS)
    turn = np.arange(AROUND) * TURN / AROUND
    rings = tube.points_m(s[1:-1], turn)
    ends = tube.points_m(s[[0, -1]], turn[:1])[:, 0]
    vertices = [rings.reshape(-1, 3), ends]
    along = [np.repeat(s[1:-1], AROUND), s[[0, -1]]]
    across = [np.tile(0.5 + 0.5 * np.cos(turn), len(s) - 2), np.array([0.5, 0.5])]
    faces = [tube_faces(len(s) - 2, AROUND)]
    u = np.linspace(0.0, 1.0, _FIN_ROWS)
    v = np.arange(_FIN_AROUND) * TURN / _FIN_AROUND
    for fin in fins:
        points = fin.surface.points_m(u, v)
        tip = points[-1].mean(axis=0, keepdims=True)
        root = np.interp(v, np.arange(len(fin.root_s)) * TURN / len(fin.root_s), fin.root_s)
        start = sum(len(part) for part in vertices)
        vertices += [points.reshape(-1, 3), tip]
        along += [np.tile(root, _FIN_ROWS), root.mean(keepdims=True)]
        across += [
            np.full(points.shape[0] * points.shape[1] + 1, 0.5 + 0.5 * np.cos(fin.root_v.mean()))
        ]
        faces.append(_fin_faces(points, tip) + start)
    corners = np.concatenate(vertices)
    triangles = np.concatenate(faces)
    places = np.concatenate(along)
    mesh = Mesh(
        vertices=corners,
        normals=vertex_normals(corners, triangles),
        uv=np.stack([places, np.concatenate(across)], axis=-1),
        faces=triangles,
    )
    return Skin(mesh, places, sections.length_m, sections.axis_m)


def carried(mesh: Mesh, surface: Skin) -> Skin:
    """Hang any mesh on a skin: a corner goes where its nearest surface point goes ([GC] 2.4).

    The paper adds the nearest point's displacement. Here the corner gets that point's bones, so it
    turns with them. Parts beyond the surface's ends, such as the lobes of a tail fin, move by their
    own place.
    """
    nearest = cKDTree(surface.mesh.vertices).query(mesh.vertices)[1]
    along_vertices = np.clip(-mesh.vertices[:, 0] / surface.length_m, 0.0, 1.0)
    beyond = (along_vertices < surface.along.min()) | (along_vertices > surface.along.max())
    along = np.where(beyond, along_vertices, surface.along[nearest])
    return Skin(mesh, along, surface.length_m, surface.axis_m)


def weights(skin: Skin, bone_m: Floats) -> Weights:
    """Share every corner out among bones of lengths (K,), head first; K of 2 or more."""
    last = len(bone_m) - 1
    ends = np.concatenate([[0.0], np.cumsum(bone_m)]) / bone_m.sum()
    place = np.interp(skin.along, ends, np.arange(len(ends)))
    middle = np.minimum(place.astype(np.int64), last)
    x = place - middle - 0.5
    before, after = 0.5 * (0.5 - x) ** 2, 0.5 * (0.5 + x) ** 2
    before[middle == 0] = 0.0  # the first and the last bone keep what has no neighbour
    after[middle == last] = 0.0
    shares = np.stack([before, 1.0 - before - after, after], axis=1)
    bones = np.clip(middle[:, None] + np.array([-1, 0, 1]), 0, last)
    return Weights(bones.astype(np.int64), shares)


def rest_fronts_m(bone_m: Floats, axis_m: float) -> Floats:
    """(K, 3) front ends of the bones of the straight body."""
    start = np.concatenate([[0.0], np.cumsum(bone_m)[:-1]])
    return np.stack([-start, np.zeros(len(start)), np.full(len(start), axis_m)], axis=1)


def _fin_faces(points: Floats, tip: Floats) -> Ints:
    rows, around = points.shape[:2]
    # without the fan at the root, which is inside the body
    faces = tube_faces(rows, around)[: -2 * around]
    last = (rows - 1) * around
    k = np.arange(around)
    after = (k + 1) % around
    fan = np.stack([np.full(around, rows * around), last + after, last + k], axis=-1)
    faces = np.concatenate([faces, fan])
    corner = np.concatenate([points.reshape(-1, 3), tip])
    a, b, c = (corner[faces[:, k]] - points[0].mean(axis=0) for k in range(3))
    outwards = float(np.einsum("fi,fi->", a, np.cross(b, c))) > 0.0
    return faces if outwards else faces[:, ::-1]
