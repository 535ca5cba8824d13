"""How much slower than the animal a robot must be: joint speed and acceleration.

Noise of tracked points dominates differences over one frame. So demands use angles smoothed over
time, with a cut well above the wave's frequency. The unsmoothed speed is kept as well.
"""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d

from snakewalk.config.arrays import Floats

CUT_CYCLES = 5.0
"""Frequency at which smoothing leaves exp(-1/2), in multiples of the wave's frequency: the wave
keeps 98 %."""


@dataclass(frozen=True, slots=True)
class Demand:
    """Joint speeds and accelerations of the recorded motion in the animal's own time."""

    speed_rad_s: Floats
    """(K,) fastest joint between each two frames that follow each other, smoothed over time."""
    acceleration_rad_s2: Floats
    """(M,) largest of any joint, over each three such frames."""
    raw_speed_rad_s: float
    """Largest joint speed without smoothing: motion and tracking noise."""


@dataclass(frozen=True, slots=True)
class Slowing:
    """Factors >= 1 by which recorded time must be stretched."""

    by_speed: float
    """Factor for the complete recording that keeps the joints' speed limit."""
    by_acceleration: float
    """Throughout, for the acceleration limit; acceleration falls with the square of the factor."""
    where_needed: float
    """Longer in all, if only the moments that are too fast are slowed, to the speed limit."""

    @property
    def throughout(self) -> float:
        """Factor for the whole recording that keeps both limits."""
        return max(self.by_speed, self.by_acceleration)


def joint_demand(joints_rad: Floats, time_s: Floats, rate_hz: float, wave_hz: float) -> Demand:
    """Joint speeds and accelerations of a recording (T, J) at its own pace.

    Nothing is interpolated: only frames at most 1.5 frame times apart are compared.

    Args:
        joints_rad: of every kept frame.
        time_s: (T,) of the frames, increasing.
        rate_hz: frames per second.
        wave_hz: frequency of the body wave; sets the smoothing.

    Raises:
        ValueError: no two frames follow each other.

    """
    joins = np.diff(time_s) < 1.5 / rate_hz
    if not joins.any():
        raise ValueError("no two frames follow each other")
    runs = np.split(np.arange(len(time_s)), np.flatnonzero(~joins) + 1)
    width = rate_hz / (2.0 * np.pi * CUT_CYCLES * wave_hz) if wave_hz > 0.0 else 0.0
    speeds = []
    accelerations = []
    raw = 0.0
    for run in runs:
        if len(run) < 2:
            continue
        q = joints_rad[run]
        smooth = _smooth(q, width)
        raw = max(raw, float(np.abs(np.diff(q, axis=0)).max()) * rate_hz)
        speeds.append(np.abs(np.diff(smooth, axis=0)).max(axis=1) * rate_hz)
        accelerations.append(np.abs(np.diff(smooth, n=2, axis=0)).max(axis=1) * rate_hz**2)
    return Demand(np.concatenate(speeds), np.concatenate(accelerations), raw)


def slowing(demand: Demand, speed_limit_rad_s: float, acceleration_limit_rad_s2: float) -> Slowing:
    """Compare a demand with a robot's limits."""
    speed = demand.speed_rad_s / speed_limit_rad_s
    acceleration = demand.acceleration_rad_s2.max(initial=0.0) / acceleration_limit_rad_s2
    return Slowing(
        by_speed=max(1.0, float(speed.max())),
        by_acceleration=max(1.0, float(np.sqrt(acceleration))),
        where_needed=float(np.maximum(1.0, speed).mean()),
    )


def _smooth(joints_rad: Floats, width: float) -> Floats:
    """Smooth over time; the ends are continued point-symmetrically, without a kink."""
    width = min(width, len(joints_rad))  # a still body has a wave of no frequency
    room = min(int(np.ceil(4.0 * width)), len(joints_rad) - 1)
    if room == 0:
        return joints_rad
    longer = np.pad(joints_rad, ((room, room), (0, 0)), mode="reflect", reflect_type="odd")
    smooth = gaussian_filter1d(longer, width, axis=0, mode="nearest")
    return smooth[room : len(smooth) - room]
