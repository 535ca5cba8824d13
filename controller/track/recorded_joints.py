"""Joint angles of a recording over time, for one robot."""

from pathlib import Path

import numpy as np
from scipy.ndimage import gaussian_filter1d

from snakewalk.config.archive import read_arrays
from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.kinematics.retarget import Retarget
from snakewalk.controller.motion.parted_recording import gaps
from snakewalk.controller.track.choice import Choice
from snakewalk.controller.track.readers.load import load_track
from snakewalk.controller.track.slowing import CUT_CYCLES
from snakewalk.controller.track.wave import measure_wave


def recorded_joints(
    track: str, robot: RobotConfig, time_unit: str | None = None
) -> tuple[Floats, Floats]:
    """Read times (T,) and joint angles (T, J) from the file itself, or from its midlines.

    Joints of midlines are smoothed, with a cut well above the wave's frequency. Long gaps, in which
    the file has no midline, stay gaps.

    Raises:
        InputError: no such recording, or it was made for another robot.

    """
    stored = None if time_unit else _stored_joints(track, robot)
    if stored is not None:
        return stored
    recording = load_track(track, choice=Choice(time_unit=time_unit))
    if recording.frames < 2:
        raise InputError(f"{track}: has one frame; a motion needs two")
    joints = Retarget(robot).joints_rad(recording.angles_rad)
    known_s = recording.time_s - recording.time_s[0]
    wave_hz = measure_wave(recording).frequency_hz
    width = recording.rate_hz / (2.0 * np.pi * CUT_CYCLES * wave_hz) if wave_hz > 0.0 else 0.0
    times = []
    parts = []
    for rows in np.split(np.arange(len(known_s)), gaps(known_s)):
        ends_s = known_s[rows[[0, -1]]] * recording.rate_hz
        time_s = np.arange(round(ends_s[0]), round(ends_s[1]) + 1) / recording.rate_hz
        even = np.stack([np.interp(time_s, known_s[rows], part) for part in joints[rows].T], axis=1)
        times.append(time_s)
        parts.append(gaussian_filter1d(even, width, axis=0, mode="nearest") if width else even)
    return np.concatenate(times), np.concatenate(parts)


def _stored_joints(track: str, robot: RobotConfig) -> tuple[Floats, Floats] | None:
    """Joint angles that a synthesis stored with its midlines; None without them."""
    if Path(track).suffix != ".npz" or not Path(track).is_file():
        return None
    try:
        arrays, _ = read_arrays(Path(track), {"joints_rad", "rate_hz", "robot"})
        if len(arrays) < 3:
            return None
        joints = np.asarray(arrays["joints_rad"], dtype=float)
        rate_hz = float(arrays["rate_hz"])
        name = str(arrays["robot"])
    except (TypeError, ValueError, OSError):
        return None  # load_track raises with the reason
    if name != robot.name or joints.ndim != 2 or len(joints) < 2:
        return None
    if not (np.isfinite(joints).all() and 0.0 < rate_hz < np.inf):
        raise InputError(f"{track}: joints_rad and rate_hz must be finite, and the rate above 0 Hz")
    return np.arange(len(joints)) / rate_hz, joints
