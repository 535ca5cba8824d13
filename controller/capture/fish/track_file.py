"""A synthesised motion as a recording for a run, with the joints of one robot beside."""

from pathlib import Path
from typing import BinaryIO

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.capture.fish.joining import PieceGraph
from snakewalk.controller.capture.fish.junction import join
from snakewalk.controller.capture.fish.postures import Postures, tangents
from snakewalk.controller.capture.fish.synthesis import BLEND_S, PieceSequence
from snakewalk.controller.kinematics.retarget import Retarget


def joint_pieces(pieces: PieceGraph, sequence: PieceSequence, retarget: Retarget) -> list[Floats]:
    """Each piece as joint angles (n, joints of the robot), not yet joined."""
    return [
        retarget.joints_rad(tangents(part.head_rad, part.angles_rad, pieces.joints_at))
        for part in (pieces.pieces[k] for k in sequence.order)
    ]


def joint_motion(
    pieces: PieceGraph, sequence: PieceSequence, retarget: Retarget, blend_s: float = BLEND_S
) -> Floats:
    """(T, joints) the whole motion, joined with a blend at the joint layer."""
    samples = max(1, round(blend_s * pieces.rate_hz))
    return join(joint_pieces(pieces, sequence, retarget), samples)


def save_motion(
    path: Path | BinaryIO,
    postures: Postures,
    joints_rad: Floats,
    robot: str,
    sequence: PieceSequence,
) -> None:
    """Write a motion; ``controller.capture.readers.load.load_track`` reads it as any recording."""
    np.savez_compressed(
        path,
        points=postures.points(),
        rate_hz=postures.rate_hz,
        length_m=np.nan if postures.length_m is None else postures.length_m,
        base=postures.base,
        head_rad=postures.head_rad,
        angles_rad_spine=postures.angles_rad,
        joints_at=postures.joints_at,
        joints_rad=joints_rad,
        robot=robot,
        segments=np.array(sequence.order),
        name=postures.name,
        source=postures.source,
        licence=postures.licence,
    )
