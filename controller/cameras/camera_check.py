"""Measurements from a few seconds of a camera: rate, markers, light, latency."""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from snakewalk.config.arrays import Floats, Image
from snakewalk.config.camera import CameraConfig
from snakewalk.config.errors import InputError
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.cameras.camera_latency import LatencyFit, fit_latency
from snakewalk.controller.cameras.markers.floor_markers import (
    Bump,
    FloorFit,
    Markers,
    find_markers,
    fit_floor,
    picture_move,
)
from snakewalk.controller.cameras.markers.lens_residual import Distortion, marker_distortion
from snakewalk.controller.cameras.overhead_camera import LineDetection, OverheadDetector
from snakewalk.controller.track.frame_status import FrameStatus

_SEARCH_PERIOD_S = 0.25
"""Time between two searches for markers, which need longer than a frame."""
_LINE_S = 0.05
"""Time between two frames in which the body is looked for."""
_LINES = 400
_READS = 1000
"""Number of latest samples for the latency: 20 s."""
_SPARSE = 8  # pixel step for the light


@dataclass(frozen=True, slots=True)
class CameraReport:
    """Observations so far."""

    frames: int
    size_px: tuple[int, int]
    """Width and height of a picture."""
    duration_s: float
    rate_hz: float
    """Frame rate; NaN with less than two frames."""
    gap_max_s: float
    """Longest time between two frames."""
    seen: Mapping[int, float]
    """Share of the pictures in which each marker of the table was found."""
    others: tuple[int, ...]
    """Markers in the last picture that the table does not name."""
    floor: FloorFit | None
    """Floor according to the last picture; None if it shows too few markers."""
    fault: str
    """Reason why the floor is missing; empty if it was found."""
    bump: Bump | None
    """Against the picture of the empty floor; None without one, or without markers."""
    light_spread: float
    """Range of the picture's usual brightness (5 to 95 %), as a share of it."""
    latency: LatencyFit | None
    """Latency of the camera; None if no joints were read, or the picture of the empty floor is
    missing."""
    distortion: Distortion | None = None
    """Distortion of an uncalibrated lens, where the markers of the last picture show it."""


class CameraCheck:
    """Receives frames and joint angles in order of time."""

    def __init__(
        self, camera: CameraConfig, robot: RobotConfig, detector: OverheadDetector | None
    ) -> None:
        """Begin; ``camera`` names the markers.

        ``detector`` has a picture of the empty floor; None: neither latency nor bumps are reported.
        """
        self._camera = camera
        self._robot = robot
        self._detector = detector
        self._frame_s: list[float] = []
        self._light: list[float] = []
        self._lines: deque[LineDetection] = deque(maxlen=_LINES)
        self._joint_s: deque[float] = deque(maxlen=_READS)
        self._joint_rad: deque[Floats] = deque(maxlen=_READS)
        self._latest: Image | None = None
        self._looks, self._found = 0, dict.fromkeys(camera.marker_places_m, 0)
        self._looked_s = self._line_time_s = -np.inf
        self._window = slice(None), slice(None)
        self.markers: Markers = {}
        """Markers of the last picture in which they were searched."""

    def add_frame(self, image: Image, time_s: float) -> None:
        """Process a frame (H, W, 3) received at this time.

        Raises:
            InputError: its size differs from the picture of the empty floor.

        """
        self._frame_s.append(time_s)
        self._latest = image
        self._light.append(float(image[::_SPARSE, ::_SPARSE].mean()))
        if self._joint_s and time_s - self._line_time_s >= _LINE_S:
            self._line_time_s = time_s
            self._add_line(image, time_s)
        if time_s - self._looked_s < _SEARCH_PERIOD_S:
            return
        self._looked_s = time_s
        self.markers = find_markers(image)
        self._looks += 1
        for name in self._found:
            self._found[name] += name in self.markers

    def _add_line(self, image: Image, time_s: float) -> None:
        """Find the body near its last place, else anywhere."""
        detector = self._detector
        if detector is None:
            return
        rows, columns = self._window
        (x, y), left, top = detector.model.moved_px, columns.start or 0, rows.start or 0
        part = replace(
            detector,
            model=replace(detector.model, moved_px=(x - left, y - top)),
            background=np.ascontiguousarray(detector.background[rows, columns]),
        )
        line = part.outline(np.ascontiguousarray(image[rows, columns]), time_s)
        self._window = slice(None), slice(None)
        if line.status is not FrameStatus.GOOD:
            return
        self._lines.append(line)
        px = detector.model.in_image(line.line_m, detector.axis_height_m)
        around = 0.25 * float(np.ptp(px, axis=0).max()) + 8.0
        low, high = px.min(axis=0) - around, px.max(axis=0) + around
        (left, top), (right, below) = np.maximum(low, 0.0).astype(int), high.astype(int) + 1
        self._window = slice(int(top), int(below)), slice(int(left), int(right))

    def add_joints(self, time_s: float, joint_rad: Floats) -> None:
        """Store joint angles (J,) read at this time."""
        self._joint_s.append(time_s)
        self._joint_rad.append(np.array(joint_rad, dtype=float))

    def report(self) -> CameraReport:
        """Return the observations so far.

        Raises:
            InputError: there was no frame.

        """
        if self._latest is None:
            raise InputError("the camera has delivered no frame")
        size_px = (self._latest.shape[1], self._latest.shape[0])
        times = np.array(self._frame_s)
        gaps_s = np.diff(times)
        places = self._camera.marker_places_m
        first = None if self._detector is None else self._detector.model
        lens = None if first is None else first.lens
        floor = None
        fault = ""
        distortion = None
        if places:
            try:
                floor = fit_floor(self.markers, places, lens)
                if lens is None and self._camera.lens is None:
                    side_m = self._camera.marker_side_m
                    distortion = marker_distortion(self.markers, places, size_px, side_m)
            except InputError as error:
                fault = str(error)
        move = None
        if first is not None and first.markers:
            matrix = first.matrix(size_px)
            move = picture_move(first.markers, self.markers, first.floor_from_px, matrix, lens)
        low, usual, high = np.percentile(self._light, [5.0, 50.0, 95.0])
        latency = None
        if self._joint_s and self._detector is not None:
            latency = fit_latency(
                self._robot, self._lines, np.array(self._joint_s), np.array(self._joint_rad)
            )
        return CameraReport(
            frames=len(times),
            size_px=size_px,
            duration_s=float(times[-1] - times[0]),
            rate_hz=float(len(gaps_s) / gaps_s.sum()) if gaps_s.sum() > 0.0 else float("nan"),
            gap_max_s=float(gaps_s.max(initial=0.0)),
            seen={name: count / max(self._looks, 1) for name, count in self._found.items()},
            others=tuple(sorted(set(self.markers) - set(places))),
            floor=floor,
            distortion=distortion if distortion is not None and distortion.is_certain else None,
            fault=fault,
            bump=None if move is None else move.bump,
            light_spread=float((high - low) / max(usual, 1.0)),
            latency=latency,
        )
