"""Measurements of a run's IMU, each reading once, in the frames of ``body_frames``."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from snakewalk.config.arrays import Floats
from snakewalk.controller.runlog.record import RunRecord

_SAME_READING_S = 1e-4
"""Readings that were measured closer to each other are one: ages are rounded in the log."""


@dataclass(frozen=True, slots=True)
class ImuReadings:
    """Readings of the device; no rows where the log has none."""

    frame: str
    """Link that carries the IMU."""
    time_s: Floats
    """(N,) times of the readings, s."""
    quaternion: Floats
    """(N, 4) as x, y, z, w: the link in a world whose heading begins anywhere, and drifts."""
    rate_rad_s: Floats
    """(N, 3) about the link's forward, left and up axes."""
    link_m: Floats
    """(N, 3) position of the link by the run's pose; zero if unknown."""


def imu_readings(record: RunRecord) -> ImuReadings:
    """Readings of a log; one that was held while the device was silent counts once."""
    table = record.imu
    config = record.header.robot.imu
    pose = record.pose
    link = 0 if config is None else config.link
    measured_at_s = table.time_s - table.age_s
    fresh = np.diff(measured_at_s, prepend=-np.inf) > _SAME_READING_S
    time_s = measured_at_s[fresh]
    link_m = np.zeros((int(fresh.sum()), 3))
    if len(pose.time_s):
        seen_m = pose.links_m[:, link]
        is_known = np.isfinite(seen_m).all(axis=1)
        for axis in range(3) if is_known.any() else ():
            link_m[:, axis] = np.interp(time_s, pose.time_s[is_known], seen_m[is_known, axis])
    turn = table.rotation[fresh]
    quaternion = Rotation.from_matrix(turn).as_quat() if len(turn) else np.zeros((0, 4))
    return ImuReadings(f"link{link}", time_s, quaternion, table.rate_rad_s[fresh], link_m)
