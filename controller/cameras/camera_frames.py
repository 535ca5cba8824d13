"""Common facts of the simulated and the real overhead camera."""

from collections import deque
from collections.abc import Callable
from typing import Generic, Protocol, TypeVar

import numpy as np

from snakewalk.config.arrays import Image
from snakewalk.config.errors import InputError
from snakewalk.config.run import RunConfig
from snakewalk.controller.cameras.overhead_camera import LineDetection
from snakewalk.controller.track.frame_status import FrameStatus


class Timed(Protocol):
    """A frame, or what it shows."""

    @property
    def time_s(self) -> float:
        """Time at which the frame was taken."""
        ...


OnPicture = Callable[[Image, float], None]
"""Accepts a picture (H, W, 3), blue first as in OpenCV, and its time."""
F = TypeVar("F", bound=Timed)
CHECK_FRAMES = 15
"""Frames between two checks whether the camera was bumped."""


class SimulatedFrames(Generic[F]):
    """Frames of a simulated camera; each arrives a period after it was taken."""

    def __init__(self, rate_hz: float, start_s: float) -> None:
        self._period_s = 1.0 / rate_hz
        self._next_s = start_s
        self._coming: deque[F] = deque()

    def arrived(self, now_s: float, take: Callable[[], F]) -> list[F]:
        """Capture a frame if due; return arrived ones."""
        if now_s >= self._next_s - 1e-9:
            self._coming.append(take())
            missed = int((now_s - self._next_s) / self._period_s + 1e-9)
            self._next_s += (missed + 1) * self._period_s
        arrivals = []
        while self._coming and self._coming[0].time_s + self._period_s <= now_s + 1e-9:
            arrivals.append(self._coming.popleft())
        return arrivals


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
