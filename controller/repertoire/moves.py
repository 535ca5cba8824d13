"""What the actions of a repertoire do in a cycle, in the plane."""

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.kinematics.frame import Frame
from snakewalk.controller.repertoire.repertoire import Repertoire

SAMPLES = 10
"""Moments of a cycle at which the distance to a waypoint is looked at."""


class Moves:
    """What each action does in a cycle, in the plane."""

    def __init__(self, repertoire: Repertoire, scale: float = 1.0) -> None:
        travels = [segment.flat_travel() for segment in repertoire.segments]
        stretch = np.array([scale, scale, 1.0])
        marks = [np.linspace(0, len(t) - 1, SAMPLES + 1).round().astype(int)[1:] for t in travels]
        self.way = np.array([t[m] * stretch for t, m in zip(travels, marks, strict=True)])
        """(A, SAMPLES, 3) x, y, heading in the frame at the beginning of the cycle."""
        self.duration_s = np.array([segment.duration_s for segment in repertoire.segments])
        """(A,)"""
        end = self.way[:, -1]
        chord = np.hypot(end[:, 0], end[:, 1])
        best = int(np.argmax(chord / self.duration_s))
        self.speed_m_s = float(chord[best] / self.duration_s[best])
        """Largest."""
        self.turn_rad_s = max(float(np.abs(end[:, 2] / self.duration_s).max()), 1e-3)
        """Largest."""
        self.course_rad = float(np.arctan2(end[best, 1], end[best, 0]) - 0.5 * end[best, 2])
        """Direction of travel against the body frame's x at the beginning of a cycle."""

    def after(self, pose: Floats, action: int) -> Floats:
        """(3,) where ``action`` leads from ``pose`` (3,) in a cycle."""
        c, s = np.cos(pose[2]), np.sin(pose[2])
        x, y, turn = self.way[action, -1]
        return np.array([pose[0] + c * x - s * y, pose[1] + s * x + c * y, pose[2] + turn])


def start_pose(frame: Frame) -> Floats:
    """(3,) x, y and heading."""
    return np.array([frame.origin_m[0], frame.origin_m[1], frame.heading_rad])
