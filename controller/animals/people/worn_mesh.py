"""Any mesh of a person on the bones of the PDE person ([GC] 2.4, Fig. 11)."""

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from snakewalk.config.arrays import Floats, Ints
from snakewalk.controller.animals.mesh.rig import Rig
from snakewalk.controller.animals.mesh.skin import Weights
from snakewalk.controller.animals.people.surface import Person
from snakewalk.controller.images.mesh import Mesh

_CANDIDATES = 24
_AGREE = 0.17
"""Number of near corners that are tried, and the least cosine between the normals (ours)."""


def worn_mesh(person: Person, mesh: Mesh) -> Rig:
    """Hang a mesh on the bones of the nearest points of a person's surface.

    The mesh stands as the person at rest does. It is scaled to the stature; its feet are on the
    ground and its middle is the person's. The paper adds the displacement of the nearest point;
    here the corner gets that point's bones, so it turns with them. The nearest point faces the same
    way as the corner, so it is not on the other thigh.
    """
    rest = person.rig.mesh.vertices
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    scale = person.skeleton.stature_m / (high[2] - low[2])
    place = scale * (mesh.vertices - [0.0, 0.0, low[2]])
    middle = 0.5 * (rest.min(axis=0) + rest.max(axis=0)) - 0.5 * scale * (low + high)
    place[:, :2] += middle[:2]
    nearest = _facing(place, mesh.normals, person.rig.mesh)
    rig_weights = person.rig.held
    weights = Weights(rig_weights.bones[nearest], rig_weights.shares[nearest])
    normals = np.asarray(mesh.normals, dtype=float)
    return Rig(
        replace(mesh, vertices=place, normals=normals),
        weights,
        person.rig.rest_m,
        person.rig.parent,
        person.rig.names,
    )


def _facing(place: Floats, normals: Floats, surface: Mesh) -> Ints:
    """(V,) the nearest corner of a surface whose normal is within 80 degrees of the given one."""
    candidates = np.asarray(cKDTree(surface.vertices).query(place, k=_CANDIDATES)[1], np.int64)
    agree = np.einsum("vkx,vx->vk", surface.normals[candidates], normals) > _AGREE
    return np.asarray(candidates[np.arange(len(place)), agree.argmax(axis=1)])
