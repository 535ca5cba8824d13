"""A body that moved without its joints: poses beyond a jump that become usable again.

A body that slid, or was moved, is far from its dead-reckoned pose although the source is right.
Then the measured poses lead to the new place without a gap, and later agree with the joints.
Swapped markers move a pose at once.
"""

import math
from collections import deque
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.drivers.attitude import about_up

SPEED_M_S = 2.0
RATE_RAD_S = 3.0
"""Greatest speed and turn of a sliding body between two poses (ours): 1 m down 10 degrees with
friction 0.08 ends at 1.4 m/s."""
STEP_M = 0.15
STEP_RAD = 0.3
"""Largest step between two poses, however long apart: a body that nobody saw slide did not."""
GAPS = 1.5
"""Intervals between poses in which a step may happen (ours): a tracker's step needs one."""
STEP_SD = 5.0
"""Noise of two poses that may add to a step, in standard deviations (ours)."""
SETTLED_S = 1.0
LEAST = 5
"""Time, and least number of poses in it, that must agree with the joints (ours)."""
SETTLED_M = 0.05
SETTLED_RAD = 0.2
SETTLED_SD = 5.0
"""Farthest distance of a settled pose from their mean, or in standard deviations (ours)."""


@dataclass(frozen=True, slots=True)
class PlacedPose:
    """A measured pose next to the motion of the joints at its time."""

    time_s: float
    position_m: Floats
    """(3,) of the head, measured."""
    odometry_m: Floats
    """(2,) of the head, in the frame of dead reckoning."""
    turn_rad: float
    """Turn from the frame of dead reckoning to the world, by this measurement alone."""
    position_sd_m: float
    turn_sd_rad: float

    def moved_to(self, other: "PlacedPose", turn_rad: float) -> Floats:
        """Return the position (3,) at the time of another pose, moved by the joints alone."""
        way_m = np.append(other.odometry_m - self.odometry_m, 0.0)
        return np.asarray(self.position_m + about_up(turn_rad) @ way_m)


class Relocated(NamedTuple):
    """How far a body moved without its joints."""

    distance_m: float
    seconds: float
    """Time since the last pose that was used."""


class Relocation:
    """Call ``use`` with each pose that is used, and ``add`` with each jump, in order of time."""

    def __init__(self) -> None:
        self._used: PlacedPose | None = None
        self._last: PlacedPose | None = None
        self._seen_s = -np.inf
        self._settled: deque[PlacedPose] = deque()

    @property
    def is_followed(self) -> bool:
        """Whether poses lead without a gap from the last one that was used."""
        return bool(self._settled)

    def use(self, pose: PlacedPose) -> None:
        """Begin at a pose that is used."""
        self._used = self._last = pose
        self._seen_s = pose.time_s
        self._settled.clear()

    def add(self, pose: PlacedPose) -> Relocated | None:
        """Return how the body moved once its poses have settled; None before."""
        used = self._used
        last = self._last
        gap_s = pose.time_s - self._seen_s
        self._seen_s = pose.time_s
        if used is None or last is None or not _follows(last, pose, GAPS * gap_s):
            return None
        self._last = pose
        self._settled.append(pose)
        while pose.time_s - self._settled[0].time_s > SETTLED_S:
            self._settled.popleft()
        first = self._settled[0]
        spacing_s = (pose.time_s - first.time_s) / max(len(self._settled) - 1, 1)
        if pose.time_s - first.time_s < SETTLED_S - 1.5 * spacing_s:
            return None
        if len(self._settled) < LEAST or not _agree(list(self._settled)):
            return None
        away_m = pose.position_m - used.moved_to(pose, used.turn_rad)
        return Relocated(float(np.linalg.norm(away_m)), pose.time_s - used.time_s)


def _follows(last: PlacedPose, pose: PlacedPose, most_s: float) -> bool:
    """Whether a body may have moved from one pose to the next, in at most ``most_s``."""
    gap_s = min(pose.time_s - last.time_s, most_s)
    off_m = np.linalg.norm(pose.position_m - last.moved_to(pose, last.turn_rad))
    off_rad = abs(math.remainder(pose.turn_rad - last.turn_rad, math.tau))
    noise_m = STEP_SD * np.hypot(last.position_sd_m, pose.position_sd_m)
    noise_rad = STEP_SD * np.hypot(last.turn_sd_rad, pose.turn_sd_rad)
    return bool(
        gap_s > 0.0
        and off_m <= min(SPEED_M_S * gap_s, STEP_M) + noise_m
        and off_rad <= min(RATE_RAD_S * gap_s, STEP_RAD) + noise_rad
    )


def _agree(poses: list[PlacedPose]) -> bool:
    """Whether poses differ by the motion of the joints and by noise only."""
    newest = poses[-1]
    turns = np.unwrap([pose.turn_rad for pose in poses])
    turn_rad = float(turns.mean())
    places_m = np.array([pose.moved_to(newest, turn_rad) for pose in poses])
    off_m = np.linalg.norm(places_m - places_m.mean(axis=0), axis=1)
    off_rad = np.abs(turns - turn_rad)
    most_m = [max(SETTLED_M, SETTLED_SD * pose.position_sd_m) for pose in poses]
    most_rad = [max(SETTLED_RAD, SETTLED_SD * pose.turn_sd_rad) for pose in poses]
    return bool(np.all(off_m <= most_m) and np.all(off_rad <= most_rad))
