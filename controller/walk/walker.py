"""The walk by the printed rule ([PT] 2.6.2): the next shape points towards the aim.

A linear ramp may cancel the heading error of the chosen shape; ``ramp_limit_rad = 0`` is the
printed rule. ``predictive_walker`` is for hills.
"""

from collections.abc import Callable, Iterator

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.run import WalkConfig
from snakewalk.controller.kinematics.rotations import wrap
from snakewalk.controller.motion.path_progress import Decision
from snakewalk.controller.shape.star import StarVisits
from snakewalk.controller.walk.angle_track import AngleTrack

Accept = Callable[[Floats], bool]


class Walker:
    """Grows an ``AngleTrack`` from a library of shapes (S, N), head first."""

    def __init__(self, shapes_rad: Floats, walk: WalkConfig, accept: Accept | None = None) -> None:
        self._shapes = shapes_rad
        self._walk = walk
        self._accept = accept
        self._star = StarVisits(len(shapes_rad))
        self.track = AngleTrack(shapes_rad[0] - shapes_rad[0].mean())

    def decide(self, offset_rad: float, aim_rad: float) -> Decision:
        """Choose the next shape and append its tail part.

        ``offset_rad`` rotates the track's angles to the world, the frame of ``aim_rad``.
        """
        walk = self._walk
        track = self.track
        placed = self._shapes + (track.last_rad - self._shapes[:, -1])[:, None]
        error = wrap(placed.mean(axis=1) + offset_rad - aim_rad)
        ranks, near = self._star.order(error, walk.heading_tolerance_rad, walk.nearest_count)
        state = self._choose(ranks, placed, error)
        track.append(self._piece(placed[state], error[state]))
        self._star.take(state)
        ramp = self._ramp(error[state])
        return Decision(state, float(error[state]), ramp, near, self._star.distinct)

    def _choose(self, ranks: Iterator[int], placed_rad: Floats, error_rad: Floats) -> int:
        """First state in the order of W whose body is accepted, else the first of all."""
        first = -1
        for state in ranks:
            if self._fits(self._piece(placed_rad[state], error_rad[state])):
                return state
            first = state if first < 0 else first
        return first

    def _ramp(self, error_rad: float) -> float:
        return float(np.clip(-error_rad, -self._walk.ramp_limit_rad, self._walk.ramp_limit_rad))

    def _piece(self, placed_rad: Floats, error_rad: float) -> Floats:
        """Tail part of a placed shape, oldest first, bent towards the aim."""
        piece_points = max(1, round(self._walk.decision_fraction * self.track.points))
        bend = self._ramp(error_rad) * np.linspace(0.0, 1.0, piece_points)
        return placed_rad[::-1][:piece_points] + bend

    def _fits(self, piece_rad: Floats) -> bool:
        if self._accept is None:
            return True
        old = self.track.body_rad(self.track.end)[: self.track.points - len(piece_rad)]
        return self._accept(np.concatenate([piece_rad[::-1], old]))
