"""New motion from segments: at random ([TH] 4.2.2), or through control points ([TH] 5).

[TH] joins segments where the body is straight to 4 degrees; two such ends still differ by up to 8
degrees an angle, and in speed by anything; no servo can jump 8 degrees. Here the piece that
follows starts with the value *and slope* of the one before it, and the difference dies away along
a quintic: position and speed are continuous, acceleration is bounded.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.animals.fish.piece_graph import PieceGraph, placed
from snakewalk.controller.animals.fish.postures import Postures, tangents
from snakewalk.controller.animals.fish.surroundings import OPEN_WATER, Surroundings
from snakewalk.controller.kinematics.arc_length import arc_lengths
from snakewalk.controller.kinematics.retarget import Retarget
from snakewalk.controller.kinematics.smoothstep import quintic

BLEND_S = 0.25
OnProgress = Callable[[float, float], object]
"""Called with the seconds of motion that are chosen, and the most or wanted seconds."""
STEERED = 0.2
"""Largest part of the distance swum by which a way is bent to a control point (ours)."""
_BEAM = 40
_BEAM_EACH = 3
_DEPTH = 5
_SEARCH_DEPTH = 5
_LOOK_BEAM = 6
"""Pieces that a random motion looks ahead in a tank, and sequences that it compares."""


@dataclass(frozen=True, slots=True)
class PieceSequence:
    """Pieces in order."""

    order: tuple[int, ...]
    forced: int
    """Joins without a permitting rule, used if no other piece was left."""
    reached_s: tuple[float, ...] = ()
    """Times at which the control points were reached."""
    reached_at: tuple[int, ...] = ()
    """Frames of the motion in which the control points were reached."""
    crowded: int = 0
    """Pieces that come too near to a wall or another fish, as no other choice was left."""


@dataclass(frozen=True, slots=True)
class _Node:
    """A sequence under search: its pieces, where it ends, and the points it has reached."""

    order: tuple[int, ...]
    base: Floats
    """(2,) position of the base of the head, or (3,) with its height."""
    head_rad: float
    samples: int
    forced: int
    reached_at: tuple[int, ...]
    way: float = 0.0
    """Distance that the fish has swum since the last control point."""
    crowded: int = 0
    """Pieces that come too near to a wall or another fish."""
    clearance: float = np.inf
    """Distance from walls and fish of the last piece, and of the place ahead of its end."""

    @property
    def last(self) -> int:
        return self.order[-1]


@dataclass(frozen=True, slots=True)
class _Aim:
    """Control points, the distance to come within, and the surroundings."""

    points: Floats
    radius: float
    around: Surroundings
    capture: float = 0.0

    def nearest(self, path: Floats, travelled: Floats, point: int) -> int | None:
        """Index of the place of a path at which a point is reached; None: not on this path."""
        missing = self.points[point] - path
        off = np.linalg.norm(missing, axis=1)
        near = np.flatnonzero(off <= self.radius)
        if len(near) or self.capture <= 0.0:
            return int(near[0]) if len(near) else None
        aside = np.hypot(missing[:, 0], missing[:, 1])
        reached = (aside <= self.capture) & (off <= STEERED * travelled)
        near = np.flatnonzero(reached)
        return int(near[np.argmin(off[near])]) if len(near) else None


def random_sequence(
    pieces: PieceGraph,
    seconds: float,
    rng: np.random.Generator,
    around: Surroundings = OPEN_WATER,
    on_progress: OnProgress = lambda *_: None,
) -> PieceSequence:
    """Follow permitted pieces, each as likely as the other, for at least ``seconds``.

    In a tank, or among other fish, a piece is drawn again while it, or every sequence of
    ``_SEARCH_DEPTH`` pieces that is found after it, comes too near.
    """
    aim = _Aim(np.zeros((0, 2)), 0.0, around)
    node = _begin(around, 2)
    while not node.order or node.samples / pieces.rate_hz < seconds:
        on_progress(node.samples / pieces.rate_hz, seconds)
        choice, by_rule = _choice(pieces, node)
        if not around.any:
            node = _append_piece(pieces, node, int(rng.choice(choice)), by_rule, aim)
            continue
        drawn = [_append_piece(pieces, node, int(k), by_rule, aim) for k in rng.permutation(choice)]
        node = _first_free_sequence(pieces, drawn, node.crowded, aim)
    return PieceSequence(node.order, node.forced, crowded=node.crowded)


def _begin(around: Surroundings, dimensions: int) -> _Node:
    """Return the empty sequence at the start."""
    x, y, head_rad = around.start
    return _Node((), np.array([x, y, 0.0][:dimensions]), head_rad, 0, 0, ())


def _first_free_sequence(pieces: PieceGraph, drawn: list[_Node], crowded: int, aim: _Aim) -> _Node:
    """Return the first sequence that can go on without coming too near; else the best one."""
    ends = []
    for candidate in drawn:
        if candidate.crowded > crowded:
            ends.append((candidate.crowded, -candidate.clearance))
            continue
        ends.append(_escape(pieces, candidate, aim))
        if ends[-1][0] == crowded:
            return candidate
    return drawn[min(range(len(ends)), key=ends.__getitem__)]


def _escape(pieces: PieceGraph, node: _Node, aim: _Aim) -> tuple[int, float]:
    """Crowded pieces and clearance, negative, of the best sequence of ``_SEARCH_DEPTH`` pieces."""
    beam = [node]
    for _ in range(_SEARCH_DEPTH):
        grown = [
            _append_piece(pieces, beam_node, k, by_rule, aim)
            for beam_node in beam
            for choice, by_rule in [_choice(pieces, beam_node)]
            for k in choice
        ]
        grown.sort(key=lambda grown_node: (grown_node.crowded, -grown_node.clearance))
        beam = grown[:_LOOK_BEAM]
    return beam[0].crowded, -beam[0].clearance


def sequence_through(
    pieces: PieceGraph,
    points: Floats,
    *,
    radius: float,
    limit_s: float = 120.0,
    depth: int = _DEPTH,
    capture: float = 0.0,
    around: Surroundings = OPEN_WATER,
    on_progress: OnProgress = lambda *_: None,
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
        capture: a point is also reached within this distance if ``steered`` can bend the way to it:
            the missing distance is less than ``STEERED`` of the distance swum. 0: no steering.
        around: walls and fish to keep away from.
        on_progress: called before each piece.

    Raises:
        InputError: a point was not reached in time, or heights of a film that has none.

    """
    dimensions = points.shape[1]
    if dimensions == 3 and any(piece.rise is None for piece in pieces.pieces):
        raise InputError(
            "a control point has a height, but these postures have none: they are matched from "
            "above alone; give X,Y, or match the film with --side"
        )
    aim = _Aim(points, radius, around, capture)
    begin = _begin(around, dimensions)
    while len(begin.reached_at) < len(points):
        on_progress(begin.samples / pieces.rate_hz, limit_s)
        if begin.samples / pieces.rate_hz > limit_s:
            point = ",".join(f"{value:g}" for value in points[len(begin.reached_at)])
            turns = [np.degrees(piece.head_rad[-1]) for piece in pieces.pieces]
            raise InputError(
                f"control point {len(begin.reached_at) + 1} at {point} is not reached within "
                f"{limit_s:g} s: the segments turn from {min(turns):.0f} to {max(turns):.0f} "
                "degrees; give a larger --radius, other points, or --mirror"
            )
        begin = _first_piece_of_best(pieces, begin, aim, depth)
    reached_s = tuple(k / pieces.rate_hz for k in begin.reached_at)
    return PieceSequence(begin.order, begin.forced, reached_s, begin.reached_at, begin.crowded)


def compose(
    pieces: PieceGraph,
    sequence: PieceSequence,
    blend_s: float = BLEND_S,
    start: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Postures:
    """Put the pieces end to end; angles, direction and path are blended at every junction.

    ``start`` is the place and the direction, in radians, of the first posture.

    A film with a side view also gives height, which continues from piece to piece, and pitch.
    """
    parts = [pieces.pieces[k] for k in sequence.order]
    base = []
    head = []
    origin = np.array(start[:2])
    direction = start[2]
    for part in parts:
        base.append(placed(part.base, origin, direction))
        head.append(part.head_rad + direction)
        origin = base[-1][-1]
        direction = float(head[-1][-1])
    samples = max(1, round(blend_s * pieces.rate_hz))
    rise = []
    up = 0.0
    for part in parts:
        if part.rise is not None:
            rise.append(part.rise + np.array([up, 0.0]))
            up = float(rise[-1][-1, 0])
    lifted = join(rise, samples) if len(rise) == len(parts) else None
    return Postures(
        base=join(base, samples),
        head_rad=join([heading[:, None] for heading in head], samples)[:, 0],
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
    return [int(junction) for junction in np.cumsum(lengths[:-1])]


def _first_piece_of_best(pieces: PieceGraph, first_node: _Node, aim: _Aim, depth: int) -> _Node:
    """Return the first piece of the best sequence found."""
    reached = len(first_node.reached_at)
    beam = [first_node]
    best = None
    first = len(first_node.order)
    for level in range(depth):
        grown = [
            _append_piece(pieces, node, k, by_rule, aim)
            for node in beam
            for choice, by_rule in [_choice(pieces, node)]
            for k in choice
        ]
        grown.sort(key=lambda node: _cost(node, aim))
        beam = _diverse(grown, first) if aim.around.any else grown[:_BEAM]
        if best is None or _cost(beam[0], aim) < _cost(best, aim):
            best = beam[0]
        if level + 1 < depth and len(beam[0].reached_at) > reached and not aim.around.any:
            break
    if best is None:
        raise ValueError("depth must be 1 or more")
    if aim.around.any:  # a free sequence of full length shows that the fish can go on
        best = beam[0]
    node = first_node
    for k in best.order[first : first + 1]:
        node = _append_piece(
            pieces, node, k, (not node.order or k in pieces.permitted(node.last)), aim
        )
    return node


def _diverse(grown: list[_Node], first: int) -> list[_Node]:
    """Keep the best sequences of each next piece: the shortest ways may all meet another fish."""
    place = {id(node): k for k, node in enumerate(grown)}
    kept: dict[int, list[_Node]] = {}
    for node in grown:
        kept.setdefault(node.order[first], []).append(node)
    few = [node for nodes in kept.values() for node in nodes[:_BEAM_EACH]]
    return sorted(few, key=lambda node: place[id(node)])


def _choice(pieces: PieceGraph, node: _Node) -> tuple[list[int], bool]:
    if node.order:
        return pieces.next(node.last)
    return sorted(pieces.lasting) or list(range(len(pieces.pieces))), True


def _append_piece(pieces: PieceGraph, node: _Node, piece: int, by_rule: bool, aim: _Aim) -> _Node:
    part = pieces.pieces[piece]
    path = placed(part.base, node.base[:2], node.head_rad)
    if len(node.base) == 3 and part.rise is not None:
        path = np.column_stack([path, node.base[2] + part.rise[:, 0]])
    travelled = node.way + arc_lengths(path[:, :2])
    reached = node.reached_at
    start = 1
    while len(reached) < len(aim.points):
        nearest = aim.nearest(path[start:], travelled[start:], len(reached))
        if nearest is None:
            break
        start += nearest
        missing = aim.points[len(reached)] - path[start]
        if np.linalg.norm(missing) > aim.radius:  # from here on the motion is steered through it
            path[start:] += missing
        reached = (*reached, node.samples + start)
        travelled = travelled - travelled[start]
    crowded = False
    clearance = np.inf
    head_rad = node.head_rad + float(part.head_rad[-1])
    if aim.around.any:
        clearance = aim.around.clearance(path, node.samples)
        crowded = clearance < aim.around.apart
        clearance = min(
            clearance, aim.around.ahead(path[-1], head_rad, node.samples + len(path) - 1)
        )
    return replace(
        node,
        order=(*node.order, piece),
        base=path[-1],
        head_rad=head_rad,
        samples=node.samples + len(path) - 1,
        forced=node.forced + (not by_rule),
        reached_at=reached,
        way=float(travelled[-1]),
        crowded=node.crowded + crowded,
        clearance=clearance,
    )


def _cost(node: _Node, aim: _Aim) -> tuple[int, int, float]:
    """Sort key: crowded pieces, points reached, distance to the next one; after the last, time."""
    points = aim.points
    if len(node.reached_at) == len(points):
        return node.crowded, -len(points), float(node.reached_at[-1])
    away = points[len(node.reached_at)] - node.base
    if aim.capture > 0.0 and len(away) == 3:
        away[2] = np.sign(away[2]) * max(abs(away[2]) - STEERED * node.way, 0.0)
    far = float(np.linalg.norm(away))
    off = float(np.abs(np.angle(np.exp(1j * (np.arctan2(away[1], away[0]) - node.head_rad)))))
    return (
        node.crowded,
        -len(node.reached_at),
        far + 0.2 * far * off + 1e-3 * node.samples,
    )


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
    joined = np.concatenate([pieces[0]] + [piece[1:] for piece in pieces[1:]])
    index = len(pieces[0]) - 1
    for piece in pieces[1:]:
        # this sample holds the rest of the fade before, which this fade continues
        step = joined[index] - piece[0]
        slope = joined[index] - joined[index - 1] - (piece[1] - piece[0])
        count = len(piece) - 1
        joined[index + 1 : index + 1 + count] += fading(
            step, slope, float(samples), np.arange(1.0, count + 1.0)
        )
        index += count
    return joined


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
