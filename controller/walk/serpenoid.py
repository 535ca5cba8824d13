"""A serpenoid on the angle track: the baseline, whose mean line bends towards the aim."""

from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Floats, Ints
from snakewalk.controller.kinematics.rotations import wrap
from snakewalk.controller.motion.path_progress import Decision
from snakewalk.controller.walk.angle_track import AngleTrack


@dataclass(frozen=True, slots=True)
class SerpenoidParameters:
    """Hirose's serpenoid, ``theta = base + A sin(2 pi k s / L)``, over a body of length L."""

    amplitude_rad: float = 0.7
    waves: float = 1.2
    """Number k of waves on the body."""
    turn_limit_rad: float = 1.2
    """Largest bend of the mean line over one body length."""
    pieces: int = 10
    """Decisions per body length."""

    def wave_rad(self, sample: Ints, points: int) -> Floats:
        """Angles about the mean line at samples of a track, with ``points`` per body."""
        return self.amplitude_rad * np.sin(2.0 * np.pi * self.waves * sample / points)


class Serpenoid:
    """Appends short pieces of a travelling sine whose mean line turns towards the aim."""

    def __init__(self, points: int) -> None:
        self._p = SerpenoidParameters()
        self._base_rad = 0.0
        self._at = points  # index of the wave's next sample
        self._points = points
        self.track = AngleTrack(self._p.wave_rad(np.arange(points), points)[::-1])

    def decide(self, offset_rad: float, aim_rad: float) -> Decision:
        """Append the next piece; same contract as ``Walker.decide``."""
        p = self._p
        piece_points = max(1, round(self._points / p.pieces))
        error = float(wrap(self._base_rad + offset_rad - aim_rad))
        limit = p.turn_limit_rad * piece_points / self._points
        bend = float(np.clip(-error, -limit, limit))
        line = self._base_rad + bend * np.arange(1, piece_points + 1) / piece_points
        self.track.append(line + p.wave_rad(self._at + np.arange(piece_points), self._points))
        self._base_rad += bend
        self._at += piece_points
        return Decision(0, error, bend, 1, 1)


SERPENOID = -1
"""State of a decision that the fallback made."""


def phase_at_end(track: AngleTrack, parameters: SerpenoidParameters) -> tuple[float, int]:
    """Join a serpenoid to a track: at its last angle, bending the same way.

    Returns:
        Angle of the mean line, and the next sample of the wave.

    """
    points = track.points
    recent = track.at_rad(np.arange(track.end - points, track.end, dtype=float))
    swing = (recent[-1] - recent.mean()) / parameters.amplitude_rad
    phase = float(np.arcsin(np.clip(swing, -0.95, 0.95)))
    if recent[-1] < recent[-2]:
        phase = np.pi - phase
    last = round(phase * points / (2.0 * np.pi * parameters.waves))
    base = recent[-1] - parameters.wave_rad(np.array([last]), points)[0]
    return float(base), last + 1
