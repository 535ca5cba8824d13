"""A serpenoid on the angle track: the baseline, steered by bending its mean line, and the fallback.

The fallback takes over from a walk while it is lost: variety first, then arriving.
"""

from dataclasses import dataclass, replace

import numpy as np

from snakewalk.controller.kinematics.rotations import wrap
from snakewalk.controller.motion.path_progress import Decision
from snakewalk.controller.walk.angle_track import AngleTrack
from snakewalk.controller.walk.walker import Walker


@dataclass(frozen=True, slots=True)
class SerpenoidParameters:
    """Hirose's serpenoid, ``theta = base + A sin(2 pi k s / L)``, over a body of length L."""

    amplitude_rad: float = 0.7
    waves: float = 1.2
    """k, on the body."""
    turn_limit_rad: float = 1.2
    """Largest bend of the mean line over one body length."""
    pieces: int = 10
    """Decisions per body length."""


class Serpenoid:
    """Appends short pieces of a travelling sine whose mean line turns towards the aim."""

    def __init__(
        self,
        points: int,
        parameters: SerpenoidParameters | None = None,
        track: AngleTrack | None = None,
    ) -> None:
        self._p = parameters or SerpenoidParameters()
        self._base_rad = 0.0
        self._at = float(points)  # of the wave's next sample
        self._points = points
        self.track = track or AngleTrack(self._wave(np.arange(points))[::-1])

    def take_over(self) -> None:
        """Go on from the end of a track made by others: at its last angle, bending the same way."""
        p, track = self._p, self.track
        recent = track.at_rad(np.arange(track.end - self._points, track.end, dtype=float))
        phase = np.arcsin(np.clip((recent[-1] - recent.mean()) / p.amplitude_rad, -0.95, 0.95))
        if recent[-1] < recent[-2]:
            phase = np.pi - phase
        self._base_rad = float(recent[-1] - p.amplitude_rad * np.sin(phase))
        self._at = float(phase) * self._points / (2.0 * np.pi * p.waves) + 1.0

    def decide(self, offset_rad: float, aim_rad: float) -> Decision:
        """Append the next piece; same contract as ``Walker.decide``."""
        p = self._p
        keep = max(1, round(self._points / p.pieces))
        error = float(wrap(self._base_rad + offset_rad - aim_rad))
        limit = p.turn_limit_rad * keep / self._points
        bend = float(np.clip(-error, -limit, limit))
        line = self._base_rad + bend * np.arange(1, keep + 1) / keep
        self.track.append(line + self._wave(self._at + np.arange(keep)))
        self._base_rad += bend
        self._at += keep
        return Decision(0, error, bend, 1, 1)

    def _wave(self, sample: np.ndarray) -> np.ndarray:
        p = self._p
        return np.asarray(p.amplitude_rad * np.sin(2.0 * np.pi * p.waves * sample / self._points))


SERPENOID = -1
"""State of a decision that the fallback made."""


class SerpenoidFallback:
    """Grows the walker's track, as the serpenoid between ``fall_back(True)`` and ``(False)``."""

    def __init__(self, walker: Walker) -> None:
        self._walker = walker
        self.track = walker.track
        self._serpenoid = Serpenoid(walker.track.points, track=walker.track)
        self._lost = False

    def fall_back(self, lost: bool) -> None:
        """Set whether the body has lost its path."""
        if lost and not self._lost:
            self._serpenoid.take_over()
        self._lost = lost

    def decide(self, offset_rad: float, aim_rad: float) -> Decision:
        """Append the next piece: of the walk, or of the serpenoid while the walk is lost."""
        if not self._lost:
            return self._walker.decide(offset_rad, aim_rad)
        made = self._serpenoid.decide(offset_rad, aim_rad)
        return replace(made, state=SERPENOID, visited=self._walker.visited)
