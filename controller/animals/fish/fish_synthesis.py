"""From postures to a new motion: cut, ordered, composed, and retargeted to a robot."""

import math
from collections import Counter
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from snakewalk.config.archive import read_arrays
from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot
from snakewalk.controller.animals.fish.piece_graph import PieceGraph, piece_graph
from snakewalk.controller.animals.fish.postures import Postures, save_postures
from snakewalk.controller.animals.fish.segments import (
    MotionSegment,
    Segmentation,
    commonest_posture,
    segment_motion,
)
from snakewalk.controller.animals.fish.steering import steered
from snakewalk.controller.animals.fish.surroundings import Surroundings
from snakewalk.controller.animals.fish.synthesis import (
    OnProgress,
    PieceSequence,
    compose,
    joint_motion,
    joint_pieces,
    junctions,
    random_sequence,
    sequence_through,
)
from snakewalk.controller.animals.fish.synthesis_options import SynthesisOptions
from snakewalk.controller.console.rounding import rounded
from snakewalk.controller.kinematics.retarget import Retarget

_CAPTURE = 0.5
"""Distance from a control point, in body lengths, from which the way is bent to it (ours)."""


@dataclass(frozen=True, slots=True)
class SynthesisFacts:
    """Counts of a synthesis, and the joint steps at its joins."""

    segments: dict[str, int]
    """Number of segments by kind."""
    beats_merged: int
    pieces_used: int
    seconds: float
    joins_without_rule: int
    reached_s: list[float]
    robot: str
    reached_within: list[float] | None = None
    """Distance from each control point, body lengths."""
    steered_deg: float | None = None
    """Largest change of direction by which the way was bent to the control points."""
    pieces_too_close: int | None = None
    """Segments that come nearer to walls or fish than asked, as no other choice was left."""
    wall_distance: float | None = None
    """Smallest distance of the body from the walls; below 0 it is outside."""
    fish_distance: float | None = None
    """Smallest distance between the heads of this and other fish."""
    join_step_deg: float | None = None
    """Largest joint step where one piece ends and the next begins; None with one piece."""
    join_step_blended_deg: float | None = None
    height_range: list[float] | None = None
    """Lowest and highest place relative to the start, body lengths or m; None of a film without a
    side view."""
    pitch_range_deg: list[float] | None = None

    def to_dict(self) -> dict[str, object]:
        """Return the facts that are known, for JSON."""
        values = {name: getattr(self, name) for name in SynthesisFacts.__slots__}
        return {name: value for name, value in values.items() if value is not None}


@dataclass(frozen=True, slots=True)
class SynthesisedMotion:
    """A motion and its source."""

    source: Postures
    segments: list[MotionSegment]
    pieces: PieceGraph
    sequence: PieceSequence
    motion: Postures
    joints_rad: Floats
    """(T, joints) joint angles of the robot, rad."""
    facts: SynthesisFacts

    def save(self, file: Path) -> None:
        """Write the motion as a recording that a run accepts."""
        save_postures(
            file,
            self.motion,
            joints_rad=self.joints_rad,
            robot=self.facts.robot,
            segments=self.sequence.order,
        )


def synthesise_motion(
    source: Postures, options: SynthesisOptions, on_progress: OnProgress = lambda *_: None
) -> SynthesisedMotion:
    """Cut, choose, compose, retarget.

    Raises:
        InputError: no segment, a control point out of reach, an unknown robot or reference.

    """
    robot = load_robot(options.robot)
    segments = _segments(source, options)
    pieces = piece_graph(source, segments, mirror=options.mirror)
    around = _surroundings(source, options)
    reached: dict[str, Any] = {"reached_s": []}
    if options.through:
        points = np.array(options.through)
        radius = options.radius * source.length
        sequence = sequence_through(
            pieces,
            points,
            radius=0.5 * radius,
            limit_s=options.limit_s,
            capture=max(_CAPTURE * source.length, radius),
            around=around,
            on_progress=on_progress,
        )
        steered_motion = steered(
            compose(pieces, sequence, options.blend_s, around.start),
            points,
            sequence.reached_at,
            0.5 * radius,
        )
        reached = {
            "reached_s": [
                round(frame_index / pieces.rate_hz, 2) for frame_index in steered_motion.reached_at
            ],
            "reached_within": [
                round(float(off) / source.length, 4) for off in steered_motion.distance
            ],
            "steered_deg": round(math.degrees(steered_motion.turn_rad), 1),
        }
        composed = steered_motion.motion
    else:
        rng = np.random.default_rng(options.seed)
        sequence = random_sequence(pieces, options.seconds, rng, around, on_progress)
        composed = compose(pieces, sequence, options.blend_s, around.start)
    motion = replace(
        composed,
        name=f"{source.name}, recombined",
        source=source.source,
        licence=source.licence,
    )
    retarget = Retarget(robot)
    joints = joint_motion(pieces, sequence, retarget, options.blend_s)
    kinds = Counter(str(segment.kind) for segment in segments)
    facts = SynthesisFacts(
        segments=dict(sorted(kinds.items())),
        beats_merged=sum(segment.parts - 1 for segment in segments),
        pieces_used=len(sequence.order),
        seconds=round((motion.frames - 1) / motion.rate_hz, 2),
        joins_without_rule=sequence.forced,
        robot=robot.name,
        pieces_too_close=sequence.crowded if around.any else None,
        wall_distance=rounded(around.wall_distance(motion), 4),
        fish_distance=rounded(around.fish_distance(motion), 4),
        **reached,
    )
    if motion.height is not None and motion.pitch_rad is not None:
        facts = replace(
            facts,
            height_range=_range(motion.height),
            pitch_range_deg=_range(np.degrees(motion.pitch_rad)),
        )
    steps = _steps(joint_pieces(pieces, sequence, retarget))
    if len(steps):
        after = np.abs(np.diff(joints, axis=0))[junctions(pieces, sequence)]
        facts = replace(
            facts,
            join_step_deg=round(math.degrees(steps.max()), 2),
            join_step_blended_deg=round(math.degrees(after.max()), 2),
        )
    return SynthesisedMotion(source, segments, pieces, sequence, motion, joints, facts)


def _segments(source: Postures, options: SynthesisOptions) -> list[MotionSegment]:
    within = math.radians(options.within_deg)
    reference = None
    if options.reference == "commonest":
        if not source.found.any():
            raise InputError(f"{source.name}: holds no posture")
        reference = commonest_posture(source.angles_rad, within)
        if options.mirror:
            raise InputError("--mirror needs the straight reference: a bent one has no mirror end")
    segmentation = Segmentation(within_rad=within, merge_rad=math.radians(options.merge_deg))
    return segment_motion(source, segmentation, reference)


def _surroundings(source: Postures, options: SynthesisOptions) -> Surroundings:
    """Return walls and fish in the recording's unit.

    Raises:
        InputError: a tank without inside, or one that does not hold the start.

    """
    tank = None
    if options.tank is not None:
        tank = np.array(options.tank).reshape(2, 2)
        if not ((tank[0] < options.start[:2]) & (tank[1] > options.start[:2])).all():
            raise InputError(
                "--tank: the fish does not start inside; give XMIN,YMIN,XMAX,YMAX, or --start"
            )
    others = []
    for file in options.avoid:
        arrays, _ = read_arrays(file, {"base", "rate_hz"})
        if set(arrays) != {"base", "rate_hz"}:
            raise InputError(
                f"{file}: is not a track of snakewalk animal fish synthesise; make one"
            )
        base = np.asarray(arrays["base"], float)
        rate_hz = float(arrays["rate_hz"])
        time_s = np.arange(len(base)) / rate_hz
        even = np.arange(0.0, time_s[-1] + 1e-9, 1.0 / source.rate_hz)
        others.append(np.column_stack([np.interp(even, time_s, base[:, k]) for k in (0, 1)]))
    x, y, head_deg = options.start
    start = x, y, math.radians(head_deg)
    return Surroundings(tank, tuple(others), options.apart * source.length, start)


def _steps(parts: list[Floats]) -> Floats:
    """(joins,) largest joint step where one piece ends and the next begins, unblended."""
    return np.array([np.abs(b[0] - a[-1]).max() for a, b in pairwise(parts)])


def _range(values: Floats) -> list[float]:
    return [round(float(end), 3) for end in (values.min(), values.max())]
