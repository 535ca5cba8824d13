"""Joints of a leg of up to five segments, from its root and its foot.

The first and the third segment of a mammal's leg move in parallel, as in a pantograph (M. S.
Fischer and R. Blickhan, J. Exp. Zool. A 305, 2006, 935). So they are one rigid part: blade and
forearm with cannon, or thigh and cannon. The segment between them closes the triangle to the foot.
A leg of two segments has no third one.
"""

from dataclasses import dataclass

import numpy as np

from snakewalk.config.animal import LegPairConfig
from snakewalk.config.arrays import Complexes, Floats

_KNEE_UP = 0.45
"""Upward part of the direction of a knee that points out (ours)."""


@dataclass(frozen=True, slots=True)
class LegFrame:
    """Directions of a body in T frames, unit vectors."""

    ahead: Floats
    """(T, 3) unit vectors ahead."""
    left: Floats
    """(T, 3) unit vectors to the left."""
    up: Floats
    """(T, 3) unit vectors up."""


def leg_joints_m(
    pair: LegPairConfig,
    length_m: float,
    root_m: Floats,
    toe_m: Floats,
    air: Floats,
    frame: LegFrame,
    side: float,
) -> Floats:
    """Joints (T, J, 3) of one leg, from root to toe.

    Args:
        pair: its lengths and angles.
        length_m: of the body.
        root_m: (T, 3) of the hip, or of the pivot of the blade.
        toe_m: (T, 3) of the foot's tip.
        air: (T,) elapsed share of its time in the air, 0 on the ground.
        frame: of the body.
        side: 1 of a left leg, -1 of a right one.

    A leg that is too short is stretched towards its foot; one that cannot fold enough is folded.

    """
    foot = length_m * pair.foot * foot_direction(pair, air, frame, side)
    ahead = pair.knee == "ahead" if pair.blade == 0.0 else pair.knee == "behind"
    towards = _KNEE_UP * frame.up + side * frame.left if pair.knee == "out" else frame.ahead
    if pair.knee != "out" and not ahead:
        towards = -towards
    joints = triangle_m(root_m, toe_m - foot, towards, *_parts(pair, length_m, air))
    if pair.foot > 0.0:
        joints.append(joints[-1] + foot)
    return np.stack(joints, axis=1)


def foot_direction(pair: LegPairConfig, air: Floats, frame: LegFrame, side: float) -> Floats:
    """(T, 3) from ankle or fetlock to the toe."""
    tilt = np.radians(pair.foot_deg - pair.foot_fold_deg * np.sin(np.pi * air) ** 2)[:, None]
    toe = np.cross(toe_left(pair, frame, side), frame.up)
    return np.sin(tilt) * toe - np.cos(tilt) * frame.up


def toe_left(pair: LegPairConfig, frame: LegFrame, side: float) -> Floats:
    """(T, 3) to the left of the foot, whose toe points to the side by ``foot_out_deg``."""
    out = side * np.radians(pair.foot_out_deg)
    return np.asarray(np.cos(out) * frame.left - np.sin(out) * frame.ahead)


def _parts(
    pair: LegPairConfig, length_m: float, air: Floats
) -> tuple[list[Complexes], float, list[Complexes]]:
    """Segments before the middle one, the middle one's length, and those behind it.

    Complex numbers (T,) in the plane of the leg: 1 is along the first segment, and i to the side to
    which its far end points.
    """
    fold = np.radians(pair.cannon_deg - pair.cannon_fold_deg * np.sin(np.pi * air) ** 2)
    cannon = np.asarray(length_m * pair.cannon * np.exp(1j * fold), np.complex128)
    plain = np.ones(len(air), np.complex128)
    if pair.blade == 0.0:
        third = [cannon] if pair.cannon > 0.0 else []
        return [length_m * pair.upper * plain], length_m * pair.lower, third
    turn = complex(np.exp(-1j * np.radians(pair.blade_deg)))
    third = [turn * length_m * pair.lower * plain]
    if pair.cannon > 0.0:
        third.append(turn * cannon)
    return [length_m * pair.blade * plain], length_m * pair.upper, third


def triangle_m(
    root_m: Floats,
    end_m: Floats,
    towards: Floats,
    first: list[Complexes],
    middle_m: float,
    third: list[Complexes],
) -> list[Floats]:
    """Joints (T, 3) of a leg in its plane, from the root to the end of the third part.

    Args:
        root_m: (T, 3)
        end_m: (T, 3) where the third part ends; without a third part, the middle segment.
        towards: (T, 3) directions to which the first joint points, not along the leg.
        first: segments (T,) before the middle one, as complex numbers in the plane.
        middle_m: length of the segment between the two rigid parts.
        third: segments (T,) after it, parallel to the first ones.

    A leg that is too short is stretched towards its end; one that cannot fold enough is folded.

    """
    direction = end_m - root_m
    far = np.linalg.norm(direction, axis=-1)
    down = direction / np.maximum(far, 1e-12)[:, None]
    out = towards - (towards * down).sum(axis=-1, keepdims=True) * down
    out /= np.maximum(np.linalg.norm(out, axis=-1, keepdims=True), 1e-12)
    rigid = np.sum([*first, *third], axis=0)
    long_m = np.abs(rigid)
    reach = np.clip(far, np.abs(long_m - middle_m) + 1e-12, long_m + middle_m)
    cosine = (long_m**2 + reach**2 - middle_m**2) / (2.0 * long_m * reach)
    turn = np.exp(1j * np.arccos(np.clip(cosine, -1.0, 1.0))) * long_m / rigid
    segments = [turn * part for part in first]
    segments += [reach - turn * rigid, *(turn * part for part in third)]
    joints = [root_m]
    corner = np.zeros_like(rigid)
    for segment in segments:
        corner = corner + segment
        joints.append(root_m + corner.real[:, None] * down + corner.imag[:, None] * out)
    return joints
