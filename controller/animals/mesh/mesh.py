"""The body's mesh: rings of ellipses joined, closed at both tips, with mirrored texture ([PT] 2.2).

The picture's place across the body is the cosine of the angle around it, so the upper side's
picture is mirrored to the lower. (A mirror at the ellipse's centre, as the text may be read, would
put a seam along both sides.)
"""

import numpy as np

from snakewalk.config.arrays import Floats, Ints
from snakewalk.controller.animals.mesh.body_model import BodyModel
from snakewalk.controller.images.mesh import Mesh

AROUND = 32
"""Corners of a ring."""
_CAP = 9  # rings of each tip


def body_mesh(model: BodyModel, skeleton: Floats) -> Mesh:
    """Put the ellipses at the points of a skeleton (P, 2) in plan, in body lengths, head first.

    Raises:
        ValueError: another number of points than the model's.

    """
    points = len(model.half_width)
    if skeleton.shape != (points, 2):
        raise ValueError(f"expected a skeleton of {points} points, not {skeleton.shape}")
    scale = 1.0 if model.length_m is None else model.length_m
    s = _stations(model)
    even = np.linspace(0.0, 1.0, points)
    place = np.stack([np.interp(s, even, skeleton[:, k]) for k in range(2)], axis=-1)
    forward = -np.gradient(skeleton, axis=0)
    forward = np.stack([np.interp(s, even, forward[:, k]) for k in range(2)], axis=-1)
    forward /= np.hypot(*forward.T)[:, None]
    left = np.stack([-forward[:, 1], forward[:, 0]], axis=-1)
    turn = np.linspace(0.0, 2.0 * np.pi, AROUND, endpoint=False)
    # a ring of no size has no normals
    round_ = round_tips(model, s)
    wide = np.maximum(np.interp(s, even, model.half_width) * round_, 1e-5)[:, None]
    high = np.maximum(np.interp(s, even, model.half_height) * round_, 1e-5)[:, None]
    plan = place[:, None] + (wide * np.cos(turn))[..., None] * left[:, None]
    z = high + high * np.sin(turn)  # every ring lies on the ground, as in the ground step
    rings = np.concatenate([plan, z[..., None]], axis=-1).reshape(-1, 3)
    middle = np.stack([*place[[0, -1]].T, high[[0, -1], 0]], axis=-1)
    across = np.tile(0.5 + 0.5 * np.cos(turn), len(s))
    along = np.repeat(s, AROUND)
    uv = np.stack([along, across], axis=-1)
    vertices = np.concatenate([rings, middle]) * scale
    faces = tube_faces(len(s), AROUND)
    return Mesh(
        vertices=vertices,
        normals=vertex_normals(vertices, faces),
        uv=np.concatenate([uv, [[0.0, 0.5], [1.0, 0.5]]]),
        faces=faces,
    )


def picture_around(mesh: Mesh) -> tuple[Mesh, Ints]:
    """Fit a tube's places in the texture to a picture around the whole body.

    The picture begins and ends at the belly, where the corners are split.

    Args:
        mesh: rings of ``AROUND`` corners, from the left side over the back, then two tips.

    Returns:
        The mesh, and (V,) the original corner of each of its corners.

    """
    rings = len(mesh.vertices) // AROUND
    share = np.append(
        np.tile((np.arange(AROUND) / AROUND + 0.25) % 1.0, rings), [0.5, 0.5]
    )  # 0 the belly, then the left side; the tips are on the back
    corner = share[mesh.faces]
    ends = (corner < 0.5) & (np.ptp(corner, axis=1) > 0.5)[:, None]
    split = np.unique(mesh.faces[ends])
    faces = mesh.faces.copy()
    faces[ends] = len(share) + np.searchsorted(split, mesh.faces[ends])
    source = np.concatenate([np.arange(len(share)), split])
    across = np.concatenate([share, share[split] + 1.0])
    uv = np.stack([mesh.uv[source, 0], across], axis=-1)
    return Mesh(mesh.vertices[source], mesh.normals[source], uv, faces), source


def tips(model: BodyModel) -> tuple[float, float]:
    """Half widths at the head's and the tail's tip."""
    return max(float(model.half_width[0]), 1e-4), max(float(model.half_width[-1]), 1e-4)


def _stations(model: BodyModel) -> Floats:
    """Places of the rings, 0..1: those of the skeleton, closer around the tips."""
    quarter = 1.0 - np.cos(np.linspace(0.0, 0.5 * np.pi, _CAP))
    head, tail = tips(model)
    even = np.linspace(0.0, 1.0, len(model.half_width))
    middle = even[(even > head) & (even < 1.0 - tail)]
    return np.concatenate([head * quarter, middle, 1.0 - tail * quarter[::-1]])


def round_tips(model: BodyModel, s: Floats) -> Floats:
    """Factor on the radii: the skeleton ends on the boundary, which no circle may cross."""
    head, tail = tips(model)
    near = np.minimum(s / head, (1.0 - s) / tail)
    return np.sqrt(np.clip(1.0 - np.clip(1.0 - near, 0.0, 1.0) ** 2, 0.0, None))


def tube_faces(points: int, around: int) -> Ints:
    """Two triangles for each side between rings, and a fan at each tip."""
    k = np.arange(around)
    after = (k + 1) % around
    last = (points - 1) * around
    head = points * around
    tail = points * around + 1
    front = np.stack([np.full(around, head), k, after], axis=-1)
    back = np.stack([np.full(around, tail), last + after, last + k], axis=-1)
    return np.concatenate([band_faces(points, around), front, back]).astype(np.int64)


def band_faces(rings: int, around: int) -> Ints:
    """Two triangles for each side between rings; a ring of one place gives flat ones."""
    k = np.arange(around)
    first_corner = np.arange(rings - 1)[:, None] * around
    a = first_corner + k
    b = first_corner + (k + 1) % around
    c, d = a + around, b + around
    sides = np.concatenate([np.stack([a, c, b], -1), np.stack([b, c, d], -1)])
    return sides.reshape(-1, 3).astype(np.int64)


def vertex_normals(vertices: Floats, faces: Ints) -> Floats:
    """Mean of the faces around each vertex, by area."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    face = np.cross(b - a, c - a)
    total = np.zeros_like(vertices)
    for k in range(3):
        np.add.at(total, faces[:, k], face)
    return np.asarray(total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-300))
