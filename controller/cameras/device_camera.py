"""A real overhead camera: a thread captures and processes frames.

Processing needs longer than a cycle of the loop, so it runs in parallel.
"""

import queue
import threading
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from snakewalk.config.arrays import Image
from snakewalk.config.camera import CameraConfig
from snakewalk.config.errors import InputError
from snakewalk.config.heightfield import HeightField
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.controller.cameras.camera_frames import (
    CHECK_FRAMES,
    OnPicture,
    centre_of,
    require_whole_body,
)
from snakewalk.controller.cameras.camera_pose import PriorAt
from snakewalk.controller.cameras.floor_learning import FloorLearning
from snakewalk.controller.cameras.ground_rest import heights_of
from snakewalk.controller.cameras.lens import Lens
from snakewalk.controller.cameras.overhead_camera import (
    CameraModel,
    LineDetection,
    OverheadDetector,
)
from snakewalk.controller.cameras.pose_tracking import BodyPrior, TrackedPose
from snakewalk.controller.images.video import read_image
from snakewalk.drivers.clock import Clock

PATIENCE_S = 5.0
"""Time to wait for the first frame."""
ANSWER_S = 0.1
"""Longest time until the loop states the expected place of the body."""


class DeviceCamera:
    """The camera that OpenCV opens as ``camera.device``; ``close`` it.

    A frame is dated ``latency_s`` before its receipt.

    Raises:
        InputError: no such camera, no background, another size, no frame, or no robot in it.

    """

    def __init__(
        self,
        run: RunConfig,
        robot: RobotConfig,
        clock: Clock,
        on_picture: OnPicture = lambda picture, time_s: None,
        ground: HeightField | None = None,
    ) -> None:
        """Open it; ``on_picture`` is called from the capture thread."""
        camera = run.camera
        self._clock = clock
        self._on_picture = on_picture
        self.detector = overhead_detector(run, robot, ground)
        self._name = f"camera {camera.device}"
        self._latency_s = camera.latency_s
        self._device = open_device(camera)
        self._robot = robot
        self._learning = FloorLearning(robot, camera.learn_s)
        self._found: queue.SimpleQueue[LineDetection | TrackedPose | InputError] = (
            queue.SimpleQueue()
        )
        self._asked: queue.SimpleQueue[float] = queue.SimpleQueue()
        self._answers: queue.SimpleQueue[BodyPrior | None] = queue.SimpleQueue()
        self._gone: InputError | None = None
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="overhead camera", daemon=True)
        self._thread.start()
        try:
            self.start = self.first()
            """First detection of the camera."""
            require_whole_body(self.start, self._name)
        except InputError:
            self.close()
            raise

    def first(self) -> LineDetection:
        """Wait for the next frame.

        Raises:
            InputError: no frame arrives.

        """
        self._collect(self._clock.now_s())
        if self._gone is not None:
            raise self._gone
        try:
            first_detection = self._found.get(timeout=PATIENCE_S)
        except queue.Empty:
            raise InputError(f"{self._name}: no frame came in {PATIENCE_S:g} s") from None
        if isinstance(first_detection, InputError):
            self._gone = first_detection
            raise first_detection
        if isinstance(first_detection, TrackedPose):
            return self.first()
        return first_detection

    def arrived(self, now_s: float, prior_at: PriorAt) -> list[LineDetection | TrackedPose]:
        """Return the detections since the last call, up to ``now_s``."""
        while not self._asked.empty():
            self._answers.put(prior_at(self._asked.get_nowait()))
        return self._collect(now_s)

    def _collect(self, now_s: float) -> list[LineDetection | TrackedPose]:
        detections: list[LineDetection | TrackedPose] = []
        while not self._found.empty():
            detection = self._found.get_nowait()
            if isinstance(detection, InputError):
                self._gone = detection
            elif detection.time_s <= now_s:
                detections.append(detection)
        return detections

    def close(self) -> None:
        """Stop the thread and release the camera."""
        self._stop.set()
        self._thread.join(timeout=PATIENCE_S)
        self._device.release()

    def _search_frame(self, frame: Image, time_s: float) -> LineDetection | TrackedPose:
        """Search near the loop's estimate; anywhere while no loop answers."""
        while not self._answers.empty():  # for an abandoned frame
            self._answers.get_nowait()
        self._asked.put(time_s)
        try:
            prior = self._answers.get(timeout=ANSWER_S)
        except queue.Empty:
            prior = None
        if prior is None:
            return self.detector.detect(frame, time_s)
        detection = self.detector.track(frame, time_s, prior, self._robot)
        self.detector = self._learning.after(self.detector, frame, prior, detection)
        return detection

    def _watch(self) -> None:
        taken = 0
        while not self._stop.is_set():
            is_read, frame = self._device.read()
            if not is_read:
                self._found.put(InputError(f"{self._name}: delivers no more frames"))
                return
            taken += 1
            try:
                picture = in_colour(frame)
                time_s = self._clock.now_s() - self._latency_s
                self._on_picture(picture, time_s)
                if taken % CHECK_FRAMES == 0:
                    self.detector = self.detector.registered(picture)
                self._found.put(self._search_frame(picture, time_s))
            except InputError as fault:
                self._found.put(InputError(f"{self._name}: {fault}"))
                return


def overhead_detector(
    run: RunConfig, robot: RobotConfig, ground: HeightField | None
) -> OverheadDetector:
    """Build the detector of a real camera from the run's table, above known ground.

    Raises:
        InputError: no background image, or of another size, no lens in its file, or corners or
            markers that fix no plane.

    """
    camera = run.camera
    floor = in_colour(read_image(Path(camera.background or "")))
    if floor.shape[:2] != (camera.height_px, camera.width_px):
        raise InputError(
            f"{camera.background}: is {floor.shape[1]} x {floor.shape[0]} pixels, the camera "
            f"{camera.width_px} x {camera.height_px}"
        )
    lens = None if camera.lens is None else Lens.read(Path(camera.lens))
    if lens is not None and lens.size_px != (camera.width_px, camera.height_px):
        raise InputError(
            f"{camera.lens}: is of pictures of {lens.size_px[0]} x {lens.size_px[1]} pixels, the "
            f"camera has {camera.width_px} x {camera.height_px}: calibrate in the size of the run"
        )
    if camera.corners_px is not None:
        model = CameraModel.from_corners(camera, centre_of(run), lens)
    else:
        model = CameraModel.of_floor(camera, centre_of(run), lens, floor)
    model = replace(model, heights=heights_of(ground))
    return OverheadDetector(model, floor, robot.body_radius_m, camera.shade)


def open_device(camera: CameraConfig) -> cv2.VideoCapture:
    """Open the camera with the configured size and rate.

    Raises:
        InputError: the camera does not exist.

    """
    name = camera.device or ""
    device = cv2.VideoCapture(int(name)) if name.isdigit() else cv2.VideoCapture(name)
    if not device.isOpened():
        raise InputError(f"camera {name}: OpenCV cannot open it")
    device.set(cv2.CAP_PROP_FRAME_WIDTH, camera.width_px)
    device.set(cv2.CAP_PROP_FRAME_HEIGHT, camera.height_px)
    device.set(cv2.CAP_PROP_FPS, camera.rate_hz)
    device.set(cv2.CAP_PROP_BUFFERSIZE, 1)
    return device


def in_colour(image: NDArray[np.generic]) -> Image:
    """(H, W, 3) for any number of channels."""
    out = np.asarray(image, dtype=np.uint8)
    return np.dstack([out] * 3) if out.ndim == 2 else out
