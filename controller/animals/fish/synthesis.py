"""New motion from segments: at random ([TH] 4.2.2), or through control points ([TH] 5).

[TH] joins segments where the body is straight to 4 degrees; two such ends still differ by up to 8
degrees an angle, and in speed by anything; no servo can jump 8 degrees. Here the piece that
follows starts with the value *and slope* of the one before it, and the difference dies away along
a quintic: position and speed are continuous, acceleration is bounded.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.animals.fish.piece_graph import PieceGraph, placed
from snakewalk.controller.animals.fish.postures import Postures, tangents
from snakewalk.controller.kinematics.retarget import Retarget
from snakewalk.controller.kinematics.smoothstep import quintic

BLEND_S = 0.25
_BEAM = 40
_DEPTH = 5


@dataclass(frozen=True, slots=True)
class PieceSequence:
    """Pieces in order."""

    order: tuple[int, ...]
    forced: int
    """Joins that no rule permits, made because nothing else was left."""
    reached_s: tuple[float, ...] = ()
    """When each control point was reached."""


@dataclass(frozen=True, slots=True)
class _Node:
    """A sequence under search: its pieces, where it ends, and the points it has reached."""

    order: tuple[int, ...]
    base: Floats
    """(2,) or with the height (3,)."""
    head_rad: float
    samples: int
    forced: int
    reached_at: tuple[int, ...]

    @property
    def last(self) -> int:
        return self.order[-1]


def random_sequence(pieces: PieceGraph, seconds: float, rng: np.random.Generator) -> PieceSequence:
    """Follow permitted pieces, each as likely as the other, for at least ``seconds``."""
    every = range(len(pieces.pieces))
    order = [int(rng.choice(sorted(pieces.lasting) or list(every)))]
    lasts, forced = _seconds(pieces, order[0]), 0
    while lasts < seconds:
        choice, by_rule = pieces.next(order[-1])
        forced += not by_rule
        order.append(int(rng.choice(choice)))
        lasts += _seconds(pieces, order[-1])
    return PieceSequence(tuple(order), forced)


def sequence_through(
    pieces: PieceGraph,
    points: Floats,
    *,
    radius: float,
    limit_s: float = 120.0,
    depth: int = _DEPTH,
) -> PieceSequence:
    """Swim through control points in order, from the origin along x.

    The text uses the piece that ends nearest to the point; with turns of one size that can circle a
    point for ever. Here the best of many sequences of ``depth`` pieces is searched, and its first
    piece taken. A point counts as reached when the base of the head comes within ``radius`` of it,
    within a piece as well as at its end.

    Args:
        pieces: the pieces that can be joined.
        points: (n, 2), or with heights (n, 3), in the recording's unit, from where the motion
            starts, x along the head.
        radius: how near is near enough.
        limit_s: for all points together.
        depth: pieces to look ahead; 1 is the printed rule.

    Raises:
        InputError: a point was not reached in time, or heights of a film that has none.

    """
    dimensions = points.shape[1]
    if dimensions == 3 and any(piece.rise is None for piece in pieces.pieces):
        raise InputError(
            "a control point has a height, but these postures have none: they are matched from "
            "above alone; give X,Y, or match the film with --side"
        )
    begin = _Node((), np.zeros(dimensions), 0.0, 0, 0, ())
    here = begin
    while len(here.reached_at) < len(points):
        if here.samples / pieces.rate_hz > limit_s:
            point = ",".join(f"{value:g}" for value in points[len(here.reached_at)])
            turns = [np.degrees(piece.head_rad[-1]) for piece in pieces.pieces]
            raise InputError(
                f"control point {len(here.reached_at) + 1} at {point} is not reached within "
                f"{limit_s:g} s: the segments turn from {min(turns):.0f} to {max(turns):.0f} "
                "degrees; give a larger --radius, other points, or --mirror"
            )
        here = _ahead(pieces, here, points, radius, depth)
    reached = tuple(k / pieces.rate_hz for k in here.reached_at)
    return PieceSequence(here.order, here.forced, reached)


def compose(pieces: PieceGraph, sequence: PieceSequence, blend_s: float = BLEND_S) -> Postures:
    """Put the pieces end to end; angles, direction and path are blended at every junction.

    A film with a side view also gives height, which continues from piece to piece, and pitch.
    """
    parts = [pieces.pieces[k] for k in sequence.order]
    base, head = [], []
    origin, direction = np.zeros(2), 0.0
    for part in parts:
        base.append(placed(part.base, origin, direction))
        head.append(part.head_rad + direction)
        origin, direction = base[-1][-1], float(head[-1][-1])
    samples = max(1, round(blend_s * pieces.rate_hz))
    rise, up = [], 0.0
    for part in parts:
        if part.rise is not None:
            rise.append(part.rise + np.array([up, 0.0]))
            up = float(rise[-1][-1, 0])
    lifted = join(rise, samples) if len(rise) == len(parts) else None
    return Postures(
        base=join(base, samples),
        head_rad=join([one[:, None] for one in head], samples)[:, 0],
        angles_rad=join([part.angles_rad for part in parts], samples),
        joints_at=pieces.joints_at,
        rate_hz=pieces.rate_hz,
        length_m=pieces.length_m,
        height=None if lifted is None else lifted[:, 0],
        pitch_rad=None if lifted is None else lifted[:, 1],
    )


def junctions(pieces: PieceGraph, sequence: PieceSequence) -> list[int]:
    """Frames of the composed motion at which a new piece begins."""
    lengths = [len(pieces.pieces[k].head_rad) - 1 for k in sequence.order]
    return [int(at) for at in np.cumsum(lengths[:-1])]


def _seconds(pieces: PieceGraph, piece: int) -> float:
    return (len(pieces.pieces[piece].head_rad) - 1) / pieces.rate_hz


def _ahead(pieces: PieceGraph, here: _Node, points: Floats, radius: float, depth: int) -> _Node:
    """Return the first piece of the best sequence found."""
    reached = len(here.reached_at)
    beam, best, first = [here], None, len(here.order)
    for level in range(depth):
        grown = [
            _take(pieces, node, k, by_rule, points, radius)
            for node in beam
            for choice, by_rule in [_choice(pieces, node)]
            for k in choice
        ]
        grown.sort(key=lambda node: _cost(node, points))
        beam = grown[:_BEAM]
        if best is None or _cost(beam[0], points) < _cost(best, points):
            best = beam[0]
        if level + 1 < depth and len(beam[0].reached_at) > reached:
            break
    if best is None:
        raise ValueError("depth must be 1 or more")
    node = here
    for k in best.order[first : first + 1]:
        node = _take(pieces, node, k, _is_by_rule(pieces, node, k), points, radius)
    return node


def _choice(pieces: PieceGraph, node: _Node) -> tuple[list[int], bool]:
    if node.order:
        return pieces.next(node.last)
    return sorted(pieces.lasting) or list(range(len(pieces.pieces))), True


def _is_by_rule(pieces: PieceGraph, node: _Node, piece: int) -> bool:
    return not node.order or piece in pieces.permitted(node.last)


def _take(
    pieces: PieceGraph, node: _Node, piece: int, by_rule: bool, points: Floats, radius: float
) -> _Node:
    part = pieces.pieces[piece]
    path = placed(part.base, node.base[:2], node.head_rad)
    if len(node.base) == 3 and part.rise is not None:
        path = np.column_stack([path, node.base[2] + part.rise[:, 0]])
    reached, at = node.reached_at, 1
    while len(reached) < len(points):
        near = np.flatnonzero(np.linalg.norm(path[at:] - points[len(reached)], axis=1) <= radius)
        if not len(near):
            break
        at += int(near[0])
        reached = (*reached, node.samples + at)
    return replace(
        node,
        order=(*node.order, piece),
        base=path[-1],
        head_rad=node.head_rad + float(part.head_rad[-1]),
        samples=node.samples + len(path) - 1,
        forced=node.forced + (not by_rule),
        reached_at=reached,
    )


def _cost(node: _Node, points: Floats) -> tuple[int, float]:
    """More points first, then nearer to the next one; after the last, sooner."""
    if len(node.reached_at) == len(points):
        return -len(points), float(node.reached_at[-1])
    away = points[len(node.reached_at)] - node.base
    far = float(np.linalg.norm(away))
    off = float(np.abs(np.angle(np.exp(1j * (np.arctan2(away[1], away[0]) - node.head_rad)))))
    return -len(node.reached_at), far + 0.2 * far * off + 1e-3 * node.samples


def fading(step: Floats, slope: Floats, duration: float, time: Floats) -> Floats:
    """Offset (n, K) that starts as ``step`` (K,) with ``slope`` (K,) and is gone at ``duration``.

    The quintic with ``d(0) = step, d'(0) = slope, d''(0) = 0`` and ``d = d' = d'' = 0`` at the end.

    Args:
        step: at time 0.
        slope: its rate at time 0, per unit of ``time``.
        duration: > 0; beyond it the offset is 0.
        time: (n,) >= 0.

    """
    u = np.clip(np.asarray(time, dtype=float) / duration, 0.0, 1.0)
    value = 1.0 - quintic(u)
    rate = u * (1.0 + u * u * (-6.0 + u * (8.0 - 3.0 * u)))
    return np.outer(value, step) + np.outer(rate, slope) * duration


def join(pieces: list[Floats], samples: int) -> Floats:
    """Join pieces (T_k, K) whose ends fall on one moment: the last sample of one is left out.

    Args:
        pieces: joint angles over time, two or more samples each.
        samples: number of samples over which the difference fades. If a piece is shorter, the rest
            of the difference at its end is part of the difference there.

    Returns:
        (sum of T_k - 1, plus 1; K). The first piece is unchanged; so is everything if the pieces
        meet in value and slope.

    Raises:
        ValueError: no piece, a piece of one sample, or ``samples`` below 1.

    """
    if not pieces or any(len(piece) < 2 for piece in pieces) or samples < 1:
        raise ValueError("pieces of two or more samples, and a fade of one or more")
    whole = np.concatenate([pieces[0]] + [piece[1:] for piece in pieces[1:]])
    at = len(pieces[0]) - 1
    for piece in pieces[1:]:
        # this sample holds the rest of the fade before, which this fade continues
        step = whole[at] - piece[0]
        slope = whole[at] - whole[at - 1] - (piece[1] - piece[0])
        count = len(piece) - 1
        whole[at + 1 : at + 1 + count] += fading(
            step, slope, float(samples), np.arange(1.0, count + 1.0)
        )
        at += count
    return whole


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
    path: Path, postures: Postures, joints_rad: Floats, robot: str, sequence: PieceSequence
) -> None:
    """Write a motion that ``load_track`` reads, with the joints (T, joints) of one robot."""
    with path.open("wb") as stream:
        np.savez_compressed(
            stream,
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
            **{
                key: values
                for key in ("height", "pitch_rad")
                if (values := getattr(postures, key)) is not None
            },
            name=postures.name,
            source=postures.source,
            licence=postures.licence,
        )
