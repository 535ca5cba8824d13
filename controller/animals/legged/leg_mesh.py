"""The skin of a leg at rest: one tube over its straight segments, then a hoof or toes.

The bones of a leg lie along -x. In a bone, x points to the joint above, y to the right and z
forward. Corners near a joint are carried by both bones.
"""

from dataclasses import dataclass

import numpy as np

from snakewalk.config.animal import LegPairConfig
from snakewalk.config.arrays import Floats, Ints
from snakewalk.controller.animals.mesh.mesh import tube_faces, vertex_normals
from snakewalk.controller.animals.mesh.skin import Weights
from snakewalk.controller.gaits.wave import TURN
from snakewalk.controller.images.mesh import Mesh

AROUND = 16
"""Corners of a ring."""
_ROWS = 8
"""Rings of a segment."""
_BLEND = 0.3
"""Share of the shorter segment at a joint that both bones carry."""
_ROUND = np.radians([30.0, 55.0, 75.0])
_CAP = 1.5
"""Height of a leg's round top over its half width."""
_IN_HOOF = 0.8
"""Share of the foot that is drawn above a hoof."""
_TOES = ((0.45, -46.0), (0.68, -22.0), (0.86, -4.0), (1.0, 14.0), (0.62, 44.0))
"""Length of a toe, divided by the longest toe's, and outward direction in degrees (ours)."""

Uv = tuple[float, float]
Part = tuple[Mesh, Weights]


@dataclass(frozen=True, slots=True)
class LegColours:
    """Places of the texture."""

    skin: Uv
    dark: Uv


def leg_parts(
    pair: LegPairConfig, length_m: float, first: int, side: float, colours: LegColours
) -> list[Part]:
    """Return the tube of one leg, and the end of its foot.

    ``first`` is the index of its first bone; ``side`` is 1 of a left leg, -1 of a right one.
    """
    long_m = length_m * np.array(pair.segments)
    parts = [_tube(pair, length_m, long_m, first, colours.skin)]
    if pair.foot == 0.0 or pair.sole == "round":
        return parts
    hoof = pair.sole == "hoof"
    sine = np.sin(np.radians(pair.foot_deg))
    cosine = np.cos(np.radians(pair.foot_deg))
    # from ahead, left and up of the foot on the ground into the foot's bone
    turn = np.array([[-sine, 0.0, cosine], [0.0, -1.0, 0.0], [cosine, 0.0, sine]])
    tip = np.array([-long_m.sum(), 0.0, 0.0])  # of the leg at rest
    for corners, around in (_hoof if hoof else _toes)(pair, length_m, side):
        bone = first + len(long_m) - 1
        place = colours.dark if hoof else colours.skin
        parts.append(carried_part(corners @ turn.T + tip, around, bone, place))
    return parts


def carried_part(corners: Floats, around: int, bone: int, uv: Uv) -> Part:
    """Return rings of a tube (V, 3), then its two tips, as a part of one bone."""
    shares = np.tile([0.0, 1.0, 0.0], (len(corners), 1))
    weights = Weights(np.full((len(corners), 3), bone, dtype=np.int64), shares)
    return _mesh(corners, around, uv), weights


def _mesh(corners: Floats, around: int, uv: Uv) -> Mesh:
    faces = _outwards(corners, tube_faces((len(corners) - 2) // around, around))
    return Mesh(
        vertices=corners,
        normals=vertex_normals(corners, faces),
        uv=np.tile(np.array(uv), (len(corners), 1)),
        faces=faces,
    )


def _outwards(corners: Floats, faces: Ints) -> Ints:
    """Faces in the order that makes the volume positive."""
    a, b, c = (corners[faces[:, k]] for k in range(3))
    volume = np.einsum("ij,ij->", a, np.cross(b, c))
    return faces if volume >= 0.0 else faces[:, [0, 2, 1]]


def _tube(
    pair: LegPairConfig, length_m: float, long_m: Floats, first: int, uv: Uv
) -> tuple[Mesh, Weights]:
    """Return the leg from its root to its toe, or into its hoof."""
    wide_m, deep_m = (length_m * radii for radii in _radii(pair))
    starts = np.concatenate([[0.0], np.cumsum(long_m)])
    x = []
    width = []
    depth = []
    bones = []
    shares = []
    last = len(long_m) - 1
    for k, long in enumerate(long_m):
        on = np.linspace(0.0, 1.0, _ROWS, endpoint=False)
        if k == last:
            on = np.linspace(0.0, _IN_HOOF if pair.sole == "hoof" else 1.0, _ROWS)
        waist = 1.0 - 0.22 * np.sin(np.pi * on) if pair.cannon and k == last - 1 else 1.0
        fade = (1.0 - on) ** 1.3
        x.append(-starts[k] - long * on)
        width.append(waist * (wide_m[k + 1] + (wide_m[k] - wide_m[k + 1]) * fade))
        depth.append(waist * (deep_m[k + 1] + (deep_m[k] - deep_m[k + 1]) * fade))
        before, behind = (
            _share_of_other_bone(long * away, long, long_m[near]) if 0 <= near <= last else 0.0 * on
            for away, near in ((on, k - 1), (1.0 - on, k + 1))
        )
        bones.append(np.tile([max(k - 1, 0), k, min(k + 1, last)], (len(on), 1)))
        shares.append(np.stack([before, 1.0 - before - behind, behind], axis=-1))
    for sine, cosine in zip(np.sin(_ROUND), np.cos(_ROUND), strict=True):  # the top is round
        x.insert(0, np.array([_CAP * wide_m[0] * sine]))
        width.insert(0, np.array([wide_m[0] * cosine]))
        depth.insert(0, np.array([deep_m[0] * cosine]))
        bones.insert(0, np.array([[0, 0, min(1, last)]]))
        shares.insert(0, np.array([[0.0, 1.0, 0.0]]))
    rings, wide, deep = (np.concatenate(parts) for parts in (x, width, depth))
    turn = np.arange(AROUND) * TURN / AROUND
    y, z = np.outer(wide, np.cos(turn)), np.outer(deep, np.sin(turn))
    corners = np.stack([np.repeat(rings, AROUND), y.ravel(), z.ravel()], axis=-1)
    top = [_CAP * wide_m[0], 0.0, 0.0]
    end = [rings[-1] - 0.6 * wide[-1], 0.0, 0.0]
    corners = np.vstack([corners, top, end])
    columns = [np.repeat(np.concatenate(parts), AROUND, axis=0) for parts in (bones, shares)]
    ends = np.array([[0, 0, min(1, last)], [max(last - 1, 0), last, last]])
    plain = np.tile([0.0, 1.0, 0.0], (2, 1))
    carried = Weights(np.vstack([columns[0], ends]) + first, np.vstack([columns[1], plain]))
    return _mesh(corners, AROUND, uv), carried


def _share_of_other_bone(away_m: Floats, own_m: float, other_m: float) -> Floats:
    """Share of the bone on the other side of a joint, by distance from the joint."""
    near = 1.0 - away_m / (_BLEND * min(own_m, other_m))
    return 0.5 * np.clip(near, 0.0, None) ** 1.5


def _radii(pair: LegPairConfig) -> tuple[Floats, Floats]:
    """Half widths and half depths at the joints from root to toe, over the body's length."""
    thick = pair.thick
    thin = 0.5 * pair.thick if pair.thin is None else pair.thin
    if pair.cannon > 0.0:
        width = [thick, 0.62 * thick, 1.45 * thin, 1.25 * thin]
        depth = [pair.deep * thick, 0.95 * thick, 1.9 * thin, 1.4 * thin]
    else:
        width = [thick, 0.72 * thick, 1.1 * thin]
        depth = [pair.deep * thick, 0.85 * thick, 1.1 * thin]
    if pair.blade > 0.0:
        width.insert(0, 0.6 * thick)
        depth.insert(0, 0.75 * pair.deep * thick)
    if pair.foot > 0.0:
        width.append(1.2 * thin)
        depth.append((1.2 if pair.sole == "hoof" else 0.7) * thin)
    return np.array(width), np.array(depth)


def _hoof(pair: LegPairConfig, length_m: float, _side: float) -> list[tuple[Floats, int]]:
    """Two claws, flat on the ground; the tip of the toe is the origin: ahead, left, up."""
    long = length_m * pair.toe
    high = 0.62 * length_m * pair.toe
    thin = 0.5 * pair.thick if pair.thin is None else pair.thin
    half = 0.62 * length_m * thin
    turn = np.arange(AROUND) * TURN / AROUND
    along, across = 0.5 + 0.5 * np.cos(turn), np.sin(turn)
    tubes = []
    for side in (-1.0, 1.0):
        rings = []
        # height, length and width over those of the sole, and how far behind the toe's tip
        for up, size, wide, back in (
            (0.0, 1.0, 1.0, 0.0),
            (0.5, 0.8, 0.95, 0.2),
            (1.0, 0.6, 0.85, 0.4),
        ):
            ahead = long * (-back - size * (1.0 - along))
            left = half * (wide * across + 1.08 * side)
            rings.append(np.stack([ahead, left, np.full(AROUND, up * high)], axis=-1))
        middle = [ring.mean(axis=0) for ring in (rings[0], rings[-1])]
        tubes.append((np.vstack([*rings, *middle]), AROUND))
    return tubes


def _toes(pair: LegPairConfig, length_m: float, side: float) -> list[tuple[Floats, int]]:
    """Five toes that spread from the end of the sole, and end on the ground."""
    thin = length_m * (0.5 * pair.thick if pair.thin is None else pair.thin)
    around = AROUND // 2
    tubes = []
    turn = np.arange(around) * TURN / around
    for share, out_deg in _TOES:
        out = side * np.radians(out_deg)
        ahead = np.array([np.cos(out), np.sin(out), 0.0])
        sideways = np.array([-np.sin(out), np.cos(out), 0.0])
        rings = []
        middles = []
        for on, radius in ((0.0, 0.5), (0.35, 0.42), (0.7, 0.34), (1.0, 0.14)):
            point = share * length_m * pair.toe * on * ahead
            point[2] += thin * (0.25 * np.sin(np.pi * on) - (1.0 - radius) * on**0.5)
            round_ = np.outer(np.cos(turn), sideways) + np.outer(np.sin(turn), [0.0, 0.0, 1.0])
            rings.append(point + radius * thin * round_)
            middles.append(point)
        tubes.append((np.vstack([*rings, middles[0], middles[-1]]), around))
    return tubes
