"""The boundary curves of a person, and the bones to which they are attached ([GC] 2.1, 2.2.1).

The paper cuts its curves from a mesh. These are ellipses at stations of each part, in shares of the
stature (ours). A limb begins with a curve on the trunk's surface, as in the paper.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from snakewalk.config.arrays import Floats, Ints
from snakewalk.controller.animals.mesh.patches import Tube
from snakewalk.controller.animals.mesh.pde_surface import TURN
from snakewalk.controller.animals.people.skeleton import (
    ABDUCTION_RAD,
    ANKLE,
    BALL,
    FOOT,
    HEEL,
    HIP_SIDE,
    INDEX,
    SHANK,
    SHOULDER,
    THIGH,
    PersonSkeleton,
)

AROUND = 32
"""Points of a curve, from the front over the left."""
_V = np.arange(AROUND) * TURN / AROUND

TRUNK = (
    # height, half width, half depth, middle ahead of the pelvis
    (1.000, 0.000, 0.000, 0.000), (0.993, 0.024, 0.030, -0.002), (0.975, 0.038, 0.048, 0.000),
    (0.950, 0.0435, 0.056, 0.002), (0.930, 0.044, 0.057, 0.003), (0.912, 0.0425, 0.054, 0.005),
    (0.900, 0.0405, 0.051, 0.006), (0.886, 0.037, 0.047, 0.008), (0.873, 0.031, 0.041, 0.010),
    (0.861, 0.0285, 0.033, 0.003), (0.842, 0.030, 0.032, -0.006), (0.828, 0.037, 0.034, -0.009),
    (0.814, 0.072, 0.043, -0.010), (0.797, 0.101, 0.054, -0.009), (0.760, 0.110, 0.066, -0.004),
    (0.715, 0.103, 0.069, 0.000), (0.660, 0.088, 0.061, 0.001), (0.615, 0.081, 0.056, 0.000),
    (0.575, 0.087, 0.060, -0.003), (0.535, 0.095, 0.066, -0.007), (0.503, 0.092, 0.064, -0.008),
    (0.478, 0.066, 0.048, -0.006), (0.463, 0.030, 0.028, -0.004), (0.458, 0.000, 0.000, -0.003),
)  # fmt: skip
NOSE = {0.930: 0.002, 0.912: 0.011, 0.900: 0.007}
"""Height of the nose over the face, at the stations that have it."""
LEG = (
    # height, half width, half depth, middle ahead of the hip, share of the upper bone
    (0.480, 0.0485, 0.064, -0.006, 0.45), (0.445, 0.0495, 0.060, -0.004, 0.80),
    (0.400, 0.047, 0.055, -0.001, 1.0),
    (0.345, 0.041, 0.047, 0.002, 1.0), (0.305, 0.035, 0.039, 0.003, 0.85),
    (0.285, 0.033, 0.037, 0.003, 0.5), (0.262, 0.031, 0.034, 0.000, 0.15),
    (0.215, 0.031, 0.035, -0.006, 0.0), (0.160, 0.027, 0.030, -0.006, 0.0),
    (0.105, 0.021, 0.023, -0.003, 0.0), (0.065, 0.019, 0.022, -0.002, 0.0),
    (0.039, 0.019, 0.023, -0.002, -0.5), (0.026, 0.016, 0.020, -0.002, -1.0),
)  # fmt: skip
"""A share below 0 is that of the foot; the rest is the shank's."""
ARM = (
    # distance from the shoulder, half thickness, half breadth, share of the forearm, of the hand
    (0.030, 0.030, 0.034, 0.0, 0.0), (0.065, 0.0295, 0.033, 0.0, 0.0),
    (0.110, 0.026, 0.029, 0.0, 0.0), (0.155, 0.0225, 0.025, 0.0, 0.0),
    (0.186, 0.0215, 0.023, 0.5, 0.0), (0.212, 0.0215, 0.024, 1.0, 0.0),
    (0.255, 0.019, 0.021, 1.0, 0.0), (0.305, 0.0145, 0.017, 1.0, 0.0),
    (0.332, 0.0115, 0.0155, 0.5, 0.5), (0.352, 0.012, 0.021, 0.0, 1.0),
    (0.380, 0.012, 0.023, 0.0, 1.0), (0.405, 0.010, 0.019, 0.0, 1.0),
    (0.422, 0.006, 0.011, 0.0, 1.0), (0.428, 0.0, 0.0, 0.0, 1.0),
)  # fmt: skip
SHOE = (
    # ahead of the ankle, half width, height
    (HEEL, 0.000, 0.028), (-0.031, 0.014, 0.046), (-0.016, 0.0195, 0.056), (0.008, 0.020, 0.058),
    (0.036, 0.0215, 0.046), (0.058, 0.0245, 0.037), (BALL, 0.026, 0.031), (0.095, 0.0235, 0.026),
    (0.109, 0.0155, 0.020), (HEEL + FOOT, 0.000, 0.012),
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class BodyPart:
    """One tube of the body: its curves, and the bones that carry them."""

    name: str
    """Name of the part of the body: trunk, leg, arm or shoe."""
    curves_m: Floats
    """(K, AROUND, 3) at rest; a tip is a curve of one place."""
    stations: Floats
    """(K,) place along the part, 0 to 1."""
    bones: Ints
    """(K, 3) numbers of the bones of each curve."""
    shares: Floats
    """(K, 3) shares of the bones in each curve; they sum to 1."""

    def moved_m(self, front_m: Floats, rotation: Floats, rest_m: Floats) -> Floats:
        """(K, AROUND, 3) the curves in a pose: bones (B, 3), turned by (B, 3, 3) from rest."""
        local = self.curves_m[:, None] - rest_m[self.bones][:, :, None]
        turned = np.einsum("kbij,kbvj->kbvi", rotation[self.bones], local)
        placed = turned + front_m[self.bones][:, :, None]
        return np.asarray(np.einsum("kb,kbvi->kvi", self.shares, placed))


def body_parts(skeleton: PersonSkeleton, girth: float) -> tuple[BodyPart, ...]:
    """Return trunk, two arms, two legs and two shoes.

    ``girth`` is a factor on all half widths and depths.
    """
    trunk = _trunk(girth)
    surface = Tube.through(trunk.curves_m, trunk.stations)
    on_trunk = surface.points_m(surface.rows(8), np.arange(4 * AROUND) * TURN / (4 * AROUND))
    leg = _leg(girth, on_trunk)
    arm = _arm(girth, on_trunk)
    shoe = _shoe(girth)
    sides = [
        part for side_parts in (leg, arm, shoe) for part in (side_parts, _mirrored_part(side_parts))
    ]
    size = skeleton.stature_m
    return tuple(
        BodyPart(p.name, size * p.curves_m, p.stations, p.bones, p.shares) for p in (trunk, *sides)
    )


def _trunk(girth: float) -> BodyPart:
    curves = []
    shares = []
    for height, wide, deep, middle in TRUNK:
        nose = NOSE.get(height, 0.0) * np.exp(-((np.angle(np.exp(1j * _V)) / 0.15) ** 2))
        slim = 1.0 if height > 0.85 else girth
        x = middle + slim * deep * np.cos(_V) + nose
        curves.append(np.stack([x, slim * wide * np.sin(_V), np.full(AROUND, height)], axis=-1))
        shares.append(_spine_shares(height))
    return BodyPart("trunk", np.array(curves), _stations(curves), *_bones_of_curves(shares))


def _spine_shares(height: float) -> dict[str, float]:
    """Share of the bones of the spine in a curve: linear between the middles of the bones."""
    names = ("pelvis", "waist", "chest", "neck", "head")
    place = float(np.interp(height, (0.555, 0.635, 0.735, 0.84, 0.872), np.arange(5.0)))
    below = min(int(place), 3)
    shares = {names[below]: below + 1.0 - place, names[below + 1]: place - below}
    return {name: share for name, share in shares.items() if share > 0.0}


def _leg(girth: float, on_trunk: Floats) -> BodyPart:
    curves = []
    shares = []
    top = THIGH + SHANK + ANKLE
    for height, wide, deep, middle, upper in LEG:
        slim = girth if height > 0.07 else 1.0
        inner = np.where(np.sin(_V) < 0.0, min(1.0, 0.95 * HIP_SIDE / (slim * wide)), 1.0)
        curves.append(
            np.stack(
                [
                    middle + slim * deep * np.cos(_V),
                    HIP_SIDE + slim * wide * inner * np.sin(_V),
                    np.full(AROUND, height),
                ],
                axis=-1,
            )
        )
        if height > 0.42:
            shares.append({"pelvis": 1.0 - upper, "left thigh": upper})
        elif upper >= 0.0:
            shares.append({"left thigh": upper, "left shank": 1.0 - upper})
        else:
            shares.append({"left foot": -upper, "left shank": 1.0 + upper})
    # the crease of the groin rises from the crotch to the side
    rise = (top - LEG[0][0]) * (0.6 + 0.4 * np.sin(_V)[:, None])
    root = _nearest_on_surface(curves[0] + rise * [0.0, 0.0, 1.0], on_trunk)
    curves.insert(0, root)
    shares.insert(0, {"pelvis": 1.0})
    return BodyPart("leg", np.array(curves), _stations(curves), *_bones_of_curves(shares))


def _arm(girth: float, on_trunk: Floats) -> BodyPart:
    along = np.array([0.0, np.sin(ABDUCTION_RAD), -np.cos(ABDUCTION_RAD)])
    out = np.array([0.0, np.cos(ABDUCTION_RAD), np.sin(ABDUCTION_RAD)])
    curves = []
    shares = []
    for far, thick, broad, forearm, hand in ARM:
        slim = girth if far < 0.3 else 1.0
        middle = np.array(SHOULDER) + far * along
        curves.append(
            middle
            + slim * broad * np.cos(_V)[:, None] * [1.0, 0.0, 0.0]
            + slim * thick * np.sin(_V)[:, None] * out
        )
        upper = {"left upper arm": 1.0 - forearm - hand}
        if far < 0.05:
            upper = {"left upper arm": 0.75, "chest": 0.25}
        shares.append(upper | {"left forearm": forearm, "left hand": hand})
    shoulder = np.array(SHOULDER) - [0.0, 0.020, 0.004]
    ring = shoulder + np.stack(
        [0.040 * np.cos(_V), 0.012 * np.sin(_V), 0.034 * np.sin(_V)], axis=-1
    )
    curves.insert(0, _nearest_on_surface(ring, on_trunk))
    shares.insert(0, {"chest": 1.0})
    return BodyPart("arm", np.array(curves), _stations(curves), *_bones_of_curves(shares))


def _shoe(girth: float) -> BodyPart:
    curves = []
    shares = []
    for ahead, wide, high in SHOE:
        up = np.cos(_V)
        flat = np.where(up < 0.0, -(np.abs(up) ** 0.45), up)
        z = 0.5 * high * (1.0 + flat) if wide else np.full(AROUND, 0.5 * high)
        side = HIP_SIDE - wide * np.sign(np.sin(_V)) * np.abs(np.sin(_V)) ** 0.8
        curves.append(np.stack([np.full(AROUND, ahead), side, z], axis=-1))
        toes = float(np.interp(ahead, (0.058, BALL, 0.095), (0.0, 0.5, 1.0)))
        shares.append({"left foot": 1.0 - toes, "left toes": toes})
    return BodyPart("shoe", np.array(curves), _stations(curves), *_bones_of_curves(shares))


def _nearest_on_surface(curve: Floats, surface: Floats) -> Floats:
    """(AROUND, 3) the curve on a surface's points that are nearest."""
    points = surface.reshape(-1, 3)
    return points[cKDTree(points).query(curve)[1]]


def _stations(curves: Sequence[Floats]) -> Floats:
    """(K,) share of the distance over the middles of the curves."""
    middle = np.array([curve.mean(axis=0) for curve in curves])
    far = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(middle, axis=0), axis=1))])
    return np.asarray(far / far[-1])


def _bones_of_curves(shares: Sequence[dict[str, float]]) -> tuple[Ints, Floats]:
    """(K, 3) bones and shares of the curves."""
    bones = np.zeros((len(shares), 3), dtype=np.int64)
    weights = np.zeros((len(shares), 3))
    for k, vertex_shares in enumerate(shares):
        kept = [(INDEX[name], share) for name, share in vertex_shares.items() if share > 0.0]
        bones[k] = kept[0][0]
        for j, (bone, share) in enumerate(kept):
            bones[k, j], weights[k, j] = bone, share
    return bones, weights


def _mirrored_part(part: BodyPart) -> BodyPart:
    """Return the right side's part; its curves still turn to the left."""
    turned = (-np.arange(AROUND)) % AROUND
    curves = part.curves_m[:, turned] * [1.0, -1.0, 1.0]
    names = list(INDEX)
    other = np.array([INDEX[name.replace("left", "right")] for name in names])
    return BodyPart(part.name, curves, part.stations, other[part.bones], part.shares)
