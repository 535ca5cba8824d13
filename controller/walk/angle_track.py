"""The angle track: tangent angles along the path of the head, extended piece by piece.

[PT] 2.6.4 interpolates the angles repeatedly, which blurs them. Here one accumulated shift places
the head on unchanged samples. Without slip every point of the body passes through the angles of the
head exactly.
"""

import copy

import numpy as np

from snakewalk.config.arrays import Floats


class AngleTrack:
    """Unwrapped tangent angles, one sample per body segment length, oldest first.

    Sample ``k`` is the angle at arc length ``k`` (in segments). A body of N segments whose head has
    travelled ``head`` segments shows the samples ``head - 1, head - 2, ... head - N``, head first.
    """

    def __init__(self, body_rad: Floats) -> None:
        self.points = len(body_rad)
        """N, segments of the body."""
        self._samples = np.array(body_rad[::-1], dtype=float)

    @property
    def end(self) -> int:
        """Head position, in segments, at which the track runs out."""
        return len(self._samples)

    @property
    def last_rad(self) -> float:
        """Angle of the newest sample."""
        return float(self._samples[-1])

    def append(self, piece_rad: Floats) -> None:
        """Add ``piece_rad`` (n,), oldest (tail side) first."""
        self._samples = np.concatenate([self._samples, piece_rad])

    def with_piece(self, piece_rad: Floats) -> "AngleTrack":
        """Return a copy to which ``piece_rad`` (n,) is appended."""
        other = copy.copy(self)
        other.append(piece_rad)
        return other

    def without(self, count: int) -> "AngleTrack":
        """Return a copy without the oldest ``count`` samples."""
        other = copy.copy(self)
        other._samples = self._samples[count:].copy()
        return other

    def restart(self, body_rad: Floats) -> None:
        """Append a body (N,), head first, that did not follow the track; its head is the end."""
        self.append(body_rad[::-1])

    def body_rad(self, head: float) -> Floats:
        """Angles (N,), head first, of a body with its head at ``head`` segments.

        Raises:
            ValueError: the head would be beyond the end, or the tail before the start.

        """
        if not self.points <= head <= self.end:
            raise ValueError(f"head at {head:.2f}; the track serves {self.points} to {self.end}")
        first = int(head) - self.points
        part = head % 1.0
        body = self._samples[first : int(head)][::-1]
        if part == 0.0:
            return body.copy()
        before = self._samples[first + 1 : int(head) + 1][::-1]
        return np.asarray(body + part * (before - body))

    def bodies_rad(self, first: int, last: int) -> Floats:
        """(n, N) ``body_rad`` at the whole heads from ``first`` to ``last``, inclusive."""
        heads = np.arange(first, last + 1)[:, None]
        return np.asarray(self._samples[heads - np.arange(1, self.points + 1)])

    def at_rad(self, sample: Floats) -> Floats:
        """Angles at places on the track, linearly interpolated and clamped to its ends."""
        return np.asarray(np.interp(sample, np.arange(self.end), self._samples))

    def displacement(self, start: int, stop: int, rotation_rad: float = 0.0) -> Floats:
        """Displacement (2,), segments, of a head that follows the samples without slip."""
        angles = self._samples[start:stop] + rotation_rad
        return np.array([np.cos(angles).sum(), np.sin(angles).sum()])

    def samples(self, start: int) -> Floats:
        """Samples from index ``start``."""
        return self._samples[start:]
