"""Cameras with tags in their pictures: a real one in a thread, and the simulator's."""

import queue
import threading
from collections import deque
from collections.abc import Callable
from typing import Final, Protocol

import numpy as np

from snakewalk.config.arrays import Floats, Image
from snakewalk.config.camera import CameraConfig
from snakewalk.config.errors import InputError
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.cameras.camera_frames import OnPicture
from snakewalk.controller.cameras.device_camera import PATIENCE_S, in_colour, open_device
from snakewalk.controller.cameras.tags.drawn_tags import DrawnTags
from snakewalk.controller.cameras.tags.tag_detector import TagDetector, TagPicture
from snakewalk.controller.cameras.tags.tag_view import TagView
from snakewalk.drivers.clock import Clock
from snakewalk.drivers.types import BodyPose

_LOOK_S: Final = 0.02


class TagPictures(Protocol):
    """Source of pictures, as their tags."""

    def arrived(self, now_s: float) -> list[TagPicture]:
        """Return the pictures since the last call, without waiting.

        Raises:
            InputError: the camera has failed.

        """
        ...

    def close(self) -> None:
        """Release the camera."""
        ...


class DeviceTags:
    """Tags in the pictures of an OpenCV device; ``close`` it.

    Raises:
        InputError: the device cannot be opened.

    """

    def __init__(
        self, camera: CameraConfig, detector: TagDetector, clock: Clock, on_picture: OnPicture
    ) -> None:
        self._camera = camera
        self._detector = detector
        self._clock = clock
        self._on_picture = on_picture
        self._device = open_device(camera)
        self._found: queue.SimpleQueue[TagPicture] = queue.SimpleQueue()
        self._fault: str | None = None
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="tag camera", daemon=True)
        self._thread.start()

    def arrived(self, now_s: float) -> list[TagPicture]:
        """Return the pictures since the last call.

        Raises:
            InputError: the device stopped, or changed its picture size.

        """
        arrivals = []
        while not self._found.empty():
            arrivals.append(self._found.get_nowait())
        if self._fault is not None and not arrivals:
            raise InputError(f"camera {self._camera.device}: {self._fault}")
        return arrivals

    def close(self) -> None:
        """Stop the thread and release the device."""
        self._ended.set()
        self._thread.join(timeout=PATIENCE_S)
        self._device.release()

    def _watch(self) -> None:
        size = self._camera.height_px, self._camera.width_px
        while not self._ended.is_set():
            is_whole, frame = self._device.read()
            if not is_whole:
                self._fault = "it hands over no more pictures; check its cable"
                return
            time_s = self._clock.now_s() - self._camera.latency_s
            picture = in_colour(frame)
            if picture.shape[:2] != size:
                self._fault = (
                    f"its pictures have {picture.shape[1]} x {picture.shape[0]} pixels; set "
                    "camera.width_px and camera.height_px, and calibrate in that size"
                )
                return
            self._on_picture(picture, time_s)
            self._found.put(TagPicture(time_s, self._detector.find(picture)))


class SimulatedTags:
    """Tags in drawn pictures of a simulated body; each arrives a period after it was taken."""

    def __init__(
        self,
        robot: RobotConfig,
        camera: CameraConfig,
        detector: TagDetector,
        body: Callable[[], tuple[BodyPose, Floats]],
        clock: Clock,
        on_picture: OnPicture,
        seed: int,
    ) -> None:
        """Watch a body: ``body`` returns its head pose and joint angles."""
        self._drawn = DrawnTags(robot, TagView.of(camera), camera.fixed_tags, seed)
        self._detector = detector
        self._body = body
        self._on_picture = on_picture
        self._period_s, self._next_s = 1.0 / camera.rate_hz, clock.now_s()
        self._coming: deque[TagPicture] = deque()

    def arrived(self, now_s: float) -> list[TagPicture]:
        """Record a picture if due; return arrived ones."""
        if now_s >= self._next_s - 1e-9:
            head, joint_rad = self._body()
            picture: Image = self._drawn.picture(head, joint_rad)
            self._on_picture(np.dstack([picture] * 3), now_s)
            self._coming.append(TagPicture(now_s, self._detector.find(picture)))
            missed = int((now_s - self._next_s) / self._period_s + 1e-9)
            self._next_s += (missed + 1) * self._period_s
        arrivals = []
        while self._coming and self._coming[0].time_s + self._period_s <= now_s + 1e-9:
            arrivals.append(self._coming.popleft())
        return arrivals

    def close(self) -> None:
        """Do nothing: no device is open."""


def first_picture(pictures: TagPictures, clock: Clock) -> TagPicture:
    """Wait for a picture with tags.

    Raises:
        InputError: no tag within 5 s.

    """
    until_s = clock.now_s() + PATIENCE_S
    pictures_with_tags = 0
    while clock.now_s() < until_s:
        for picture in pictures.arrived(clock.now_s()):
            pictures_with_tags += 1
            if picture.corners_px:
                return picture
        clock.sleep_until_s(clock.now_s() + _LOOK_S)
    if not pictures_with_tags:
        raise InputError(f"pose tags: no picture within {PATIENCE_S:g} s; check the camera")
    raise InputError(
        f"pose tags: {pictures_with_tags} pictures show no tag of tags.on; check light, focus, "
        "dictionary and the numbers of the tags"
    )
