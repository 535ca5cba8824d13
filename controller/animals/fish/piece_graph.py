"""Successors of each segment, [TH] 4.2.1, also where the rule permits none.

A segment may follow another if the speeds at their joint fall into the same of three classes. The
text draws at random until a permitted one appears, which may never end. Here segments without a way
on are avoided; after one, the segment of the nearest speed follows, and is counted.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from snakewalk.config.arrays import Floats, Ints
from snakewalk.config.errors import InputError
from snakewalk.controller.animals.fish.postures import Postures
from snakewalk.controller.animals.fish.segments import Kind, MotionSegment
from snakewalk.drivers.attitude import about_up

CLASSES = 3


@dataclass(frozen=True, slots=True)
class Piece:
    """A segment in the frame of its first posture: base at the origin, head along x."""

    kind: Kind
    base: Floats
    """(n, 2) positions of the base of the head, from the origin."""
    head_rad: Floats
    """(n,) unwrapped headings of the head, from 0."""
    angles_rad: Floats
    """(n, J) joint angles of the segment, rad."""
    begin_speed: float
    end_speed: float
    origin: str
    """Frames of the recording from which the segment was cut."""
    rise: Floats | None = None
    """(n, 2) height from 0, and pitch; None of a film without a side view."""


@dataclass(frozen=True)
class PieceGraph:
    """Pieces and the rule by which they follow each other."""

    pieces: tuple[Piece, ...]
    joints_at: tuple[float, ...]
    rate_hz: float
    length_m: float | None
    classes: int = CLASSES

    @cached_property
    def _class(self) -> tuple[Ints, Ints]:
        begin = np.array([piece.begin_speed for piece in self.pieces])
        end = np.array([piece.end_speed for piece in self.pieces])
        return speed_classes(begin, end, self.classes)

    def permitted(self, piece: int) -> list[int]:
        """Pieces whose first speed is in the class of the last speed of ``piece``."""
        begin, end = self._class
        return np.flatnonzero(begin == end[piece]).tolist()

    @cached_property
    def lasting(self) -> frozenset[int]:
        """Pieces from which a sequence can go on for ever."""
        alive = set(range(len(self.pieces)))
        while True:
            dead = {k for k in alive if not alive.intersection(self.permitted(k))}
            if not dead:
                return frozenset(alive)
            alive -= dead

    def next(self, piece: int) -> tuple[list[int], bool]:
        """Pieces that may follow, never empty, and whether the rule permits them.

        Permitted pieces that do not lead to a dead end; else permitted ones; else those whose first
        speed is nearest to the last speed of ``piece``.
        """
        by_rule = self.permitted(piece)
        lasting = [k for k in by_rule if k in self.lasting]
        if lasting or by_rule:
            return lasting or by_rule, True
        begin = np.array([candidate.begin_speed for candidate in self.pieces])
        speed_gap = np.abs(begin - self.pieces[piece].end_speed)
        return np.flatnonzero(speed_gap <= speed_gap.min() + 1e-12).tolist(), False


def speed_classes(begin: Floats, end: Floats, classes: int) -> tuple[Ints, Ints]:
    """Classes of equal width from 0 to the largest speed that occurs, for both ends."""
    top = max(float(begin.max(initial=0.0)), float(end.max(initial=0.0)), 1e-12)
    return tuple(  # type: ignore[return-value]
        np.minimum((speed / top * classes).astype(np.int64), classes - 1) for speed in (begin, end)
    )


def piece_graph(
    postures: Postures, segments: list[MotionSegment], *, mirror: bool = False
) -> PieceGraph:
    """Cut segments from their film.

    Args:
        postures: of the film.
        segments: cut from it.
        mirror: add each piece with left and right exchanged; a fish that was filmed turning only
            to one side can then turn to both. Only for a basic posture that is straight.

    Raises:
        InputError: no segment.

    """
    if not segments:
        raise InputError(f"{postures.name}: contains no segment to join; match a longer film")
    rise = _rise(postures)
    pieces = [_piece(postures, segment, rise) for segment in segments]
    if mirror:
        pieces += [_mirrored_piece(piece) for piece in pieces]
    return PieceGraph(tuple(pieces), postures.joints_at, postures.rate_hz, postures.length_m)


def placed(base: Floats, origin: Floats, head_rad: float) -> Floats:
    """Points (n, 2) of a piece that begins at ``origin`` (2,) with the head at ``head_rad``."""
    return base @ about_up(-head_rad)[:2, :2] + origin


def _rise(postures: Postures) -> Floats | None:
    """(T, 2) height and pitch, linear over moments at which the side view lost the fish."""
    if postures.height is None or postures.pitch_rad is None:
        return None
    rise = np.column_stack([postures.height, postures.pitch_rad])
    indices = np.flatnonzero(np.isfinite(rise).all(axis=1))
    if len(indices) < 2:
        return None
    every = np.arange(len(rise))
    return np.column_stack([np.interp(every, indices, rise[indices, k]) for k in (0, 1)])


def _piece(postures: Postures, segment: MotionSegment, rise: Floats | None) -> Piece:
    part = slice(segment.start, segment.stop + 1)
    head = np.unwrap(postures.head_rad[part])
    base = postures.base[part] - postures.base[segment.start]
    return Piece(
        kind=segment.kind,
        base=placed(base, np.zeros(2), -float(head[0])),
        head_rad=head - head[0],
        angles_rad=postures.angles_rad[part],
        rise=None if rise is None else rise[part] - [rise[segment.start, 0], 0.0],
        begin_speed=segment.begin_speed,
        end_speed=segment.end_speed,
        origin=f"{segment.start}-{segment.stop}",
    )


def _mirrored_piece(piece: Piece) -> Piece:
    other: dict[Kind, Kind] = {"left": "right", "right": "left"}
    return Piece(
        kind=other.get(piece.kind, piece.kind),
        base=piece.base * [1.0, -1.0],
        head_rad=-piece.head_rad,
        angles_rad=-piece.angles_rad,
        rise=piece.rise,
        begin_speed=piece.begin_speed,
        end_speed=piece.end_speed,
        origin=f"{piece.origin} mirrored",
    )
