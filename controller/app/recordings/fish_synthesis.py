"""From postures to a new motion, with what is to be said of it."""

from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot
from snakewalk.controller.capture.fish.piece_graph import PieceGraph, piece_graph
from snakewalk.controller.capture.fish.postures import Postures
from snakewalk.controller.capture.fish.segments import (
    MotionSegment,
    Segmentation,
    commonest_posture,
    cut,
)
from snakewalk.controller.capture.fish.synthesis import (
    PieceSequence,
    at_random,
    compose,
    joint_motion,
    joint_pieces,
    junctions,
    save_motion,
    through,
)
from snakewalk.controller.kinematics.retarget import Retarget


@dataclass(frozen=True, slots=True)
class Wanted:
    """What is asked of a synthesis; angles in degrees, as on the command line."""

    through: list[tuple[float, float]]
    seconds: float = 20.0
    seed: int = 0
    radius: float = 0.5
    """Body lengths."""
    limit_s: float = 120.0
    mirror: bool = False
    within_deg: float = 4.0
    merge_deg: float = 20.0
    reference: str = "straight"
    blend_s: float = 0.25
    robot: str = "yaw16"


@dataclass(frozen=True, slots=True)
class Made:
    """A motion and where it is from."""

    source: Postures
    segments: list[MotionSegment]
    pieces: PieceGraph
    sequence: PieceSequence
    motion: Postures
    joints_rad: Floats
    """(T, joints) of the robot."""
    robot: str
    facts: dict[str, Any]

    def save(self, file: Path) -> None:
        """Write it as a recording that a run can take."""
        with file.open("wb") as stream:
            save_motion(stream, self.motion, self.joints_rad, self.robot, self.sequence)


def synthesise_motion(source: Postures, wanted: Wanted) -> Made:
    """Cut, choose, compose, retarget.

    Raises:
        InputError: no segment, a control point out of reach, an unknown robot or reference.

    """
    robot = load_robot(wanted.robot)
    within = float(np.radians(wanted.within_deg))
    reference = None
    if wanted.reference == "commonest":
        if not source.found.any():
            raise InputError(f"{source.name}: holds no posture")
        reference = commonest_posture(source.angles_rad, within)
        if wanted.mirror:
            raise InputError("--mirror needs the straight reference: a bent one has no mirror end")
    elif wanted.reference != "straight":
        raise InputError(f"--reference {wanted.reference}: straight or commonest")
    cutting = Segmentation(within_rad=within, merge_rad=float(np.radians(wanted.merge_deg)))
    segments = cut(source, cutting, reference)
    pieces = piece_graph(source, segments, mirror=wanted.mirror)
    if wanted.through:
        points = np.array(wanted.through)
        radius = wanted.radius * source.length
        sequence = through(pieces, points, radius=radius, limit_s=wanted.limit_s)
    else:
        sequence = at_random(pieces, wanted.seconds, np.random.default_rng(wanted.seed))
    motion = replace(
        compose(pieces, sequence, wanted.blend_s),
        name=f"{source.name}, put together anew",
        source=source.source,
        licence=source.licence,
    )
    retarget = Retarget(robot)
    joints = joint_motion(pieces, sequence, retarget, wanted.blend_s)
    facts: dict[str, Any] = {
        "segments": _count([segment.kind for segment in segments]),
        "beats_merged": sum(segment.parts - 1 for segment in segments),
        "pieces_used": len(sequence.order),
        "seconds": round((motion.frames - 1) / motion.rate_hz, 2),
        "joins_without_rule": sequence.forced,
        "reached_s": [round(at, 2) for at in sequence.reached_s],
        "robot": robot.name,
    }
    steps = _steps(joint_pieces(pieces, sequence, retarget))
    at = junctions(pieces, sequence)
    if len(steps):
        after = np.abs(np.diff(joints, axis=0))[at]
        facts["join_step_deg"] = round(float(np.degrees(steps.max())), 2)
        facts["join_step_blended_deg"] = round(float(np.degrees(after.max())), 2)
    return Made(source, segments, pieces, sequence, motion, joints, robot.name, facts)


def _steps(parts: list[Floats]) -> Floats:
    """(joins,) largest joint step where one piece ends and the next begins, unblended."""
    return np.array([np.abs(b[0] - a[-1]).max() for a, b in pairwise(parts)])


def _count(kinds: list[Any]) -> dict[str, int]:
    return {kind: kinds.count(kind) for kind in sorted(set(kinds))}
