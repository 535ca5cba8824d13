"""Common facts of the simulated and the real overhead camera."""

from collections.abc import Callable

import numpy as np

from snakewalk.config.arrays import Image
from snakewalk.config.errors import InputError
from snakewalk.config.run import RunConfig
from snakewalk.controller.cameras.overhead_camera import LineDetection
from snakewalk.controller.track.frame_status import FrameStatus

OnPicture = Callable[[Image, float], None]
"""Accepts a picture (H, W, 3), blue first as in OpenCV, and its time."""
CHECK_FRAMES = 15
"""Frames between two checks whether the camera was bumped."""


def centre_of(run: RunConfig) -> tuple[float, float]:
    """Floor below the lens: as configured, or the middle of start and waypoints."""
    if run.camera.centre_m is not None:
        return run.camera.centre_m
    places = np.array([run.start_m, *run.waypoints_m])
    x, y = 0.5 * (places.min(axis=0) + places.max(axis=0))
    return float(x), float(y)


def require_whole_body(detection: LineDetection, camera: str) -> LineDetection:
    """Return a detection of the whole body.

    Raises:
        InputError: it is incomplete.

    """
    if detection.status is not FrameStatus.GOOD:
        raise InputError(
            f"{camera}: the robot is not completely visible at its start: {detection.status}"
        )
    return detection
