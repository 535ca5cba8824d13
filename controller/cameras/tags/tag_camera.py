"""Cameras with tags in their pictures: a real one in a thread, and the simulator's.

Drawn pictures of a simulated robot's tags, with blur and noise.

Only tags are drawn, on grey; a tag that faces away is hidden, but links hide nothing.
"""

import queue
import threading
from collections.abc import Callable
from typing import Any, Protocol

import cv2
import numpy as np

from snakewalk.config.arrays import Floats, Image
from snakewalk.config.camera import CameraConfig
from snakewalk.config.errors import InputError
from snakewalk.config.robot import RobotConfig
from snakewalk.config.tags import FixedTag
from snakewalk.controller.cameras.camera_frames import OnPicture, SimulatedFrames
from snakewalk.controller.cameras.device_camera import PATIENCE_S, in_colour, open_device
from snakewalk.controller.cameras.tags.tag_detector import TagDetector, TagPicture, tag_dictionary
from snakewalk.controller.cameras.tags.tag_fit import tag_corners
from snakewalk.controller.cameras.tags.tag_view import TagView, square
from snakewalk.controller.kinematics.links import SpineLinks
from snakewalk.controller.pose.sample import turned
from snakewalk.drivers.clock import Clock
from snakewalk.drivers.types import BodyPose

_CELL_PX = 12
_BACKGROUND = 110
_BLUR_PX = 0.7
_NOISE = 3.0
_LEAST_FACING = 0.1
"""Least cosine between the normal of a tag and the direction to the lens."""


class DrawnTags:
    """Draws pictures of tags."""

    def __init__(
        self, robot: RobotConfig, view: TagView, fixed: tuple[FixedTag, ...] = (), seed: int = 0
    ) -> None:
        assert robot.tags is not None
        self._spine = SpineLinks.of(robot)
        self._tags = robot.tags
        self._view = view
        self._random = np.random.default_rng(seed)
        self._dictionary = tag_dictionary(robot.tags.dictionary)
        self._prints: dict[int, Image] = {}
        self._fixed = [
            (
                tag.id,
                np.array(tag.place_m)
                + square(tag.side_m or robot.tags.side_m) @ turned(tag.turn_deg).T,
            )
            for tag in fixed
        ]

    def picture(self, head: BodyPose, joint_rad: Floats) -> Image:
        """Return the picture (H, W) of a body."""
        body = self._spine.in_world(head, joint_rad)
        squares = list(self._fixed)
        for tag in self._tags.on:
            corners = tag_corners(tag, self._tags.side_m) @ body.rotation[tag.link].T
            squares.append((tag.id, body.link_m[tag.link] + corners))
        width, height = self._view.lens.size_px
        shown = np.full((height, width), _BACKGROUND, dtype=np.float32)
        for number, corners in sorted(squares, key=self._distance_m):
            self._draw(shown, number, corners)
        shown = np.asarray(cv2.GaussianBlur(shown, (0, 0), _BLUR_PX))
        noise = self._random.normal(0.0, _NOISE, shown.shape)
        return np.clip(shown + noise, 0.0, 255.0).astype(np.uint8)

    def _distance_m(self, tag: tuple[int, Floats]) -> float:
        return -float(np.linalg.norm(tag[1].mean(axis=0) - self._view.place_m))

    def _draw(self, shown: Any, number: int, corners: Floats) -> None:
        normal = np.cross(corners[1] - corners[0], corners[0] - corners[3])
        to_lens = self._view.place_m - corners.mean(axis=0)
        facing = normal @ to_lens / (np.linalg.norm(normal) * np.linalg.norm(to_lens))
        ahead = (corners - self._view.place_m) @ self._view.rotation[:, 2]
        if facing < _LEAST_FACING or ahead.min() < 0.05:
            return
        drawn = self._print(number)
        edge = drawn.shape[0] - _CELL_PX
        inner = np.array([[_CELL_PX, _CELL_PX], [edge, _CELL_PX], [edge, edge], [_CELL_PX, edge]])
        pixels = self._view.pixels(corners)
        to_picture: Floats = np.asarray(
            cv2.getPerspectiveTransform(
                (inner - 0.5).astype(np.float32), pixels.astype(np.float32)
            ),
            dtype=float,
        )
        window = _window(to_picture, drawn.shape[0], shown.shape)
        left, top, right, low = window
        if right <= left or low <= top:
            return
        # drawn twice as large and averaged, so that edges lie between pixels
        twice = np.array([[2.0, 0.0, 0.5 - 2.0 * left], [0.0, 2.0, 0.5 - 2.0 * top], [0, 0, 1.0]])
        size = right - left, low - top
        large = (2 * size[0], 2 * size[1])
        face = cv2.warpPerspective(drawn.astype(np.float32), twice @ to_picture, large)
        cover = cv2.warpPerspective(np.ones(drawn.shape, np.float32), twice @ to_picture, large)
        face, cover = (
            cv2.resize(drawn_picture, size, interpolation=cv2.INTER_AREA)
            for drawn_picture in (face, cover)
        )
        part = shown[top:low, left:right]
        part *= 1.0 - cover
        part += face

    def _print(self, number: int) -> Image:
        if number not in self._prints:
            cells = int(self._dictionary.markerSize) + 2
            inner = cv2.aruco.generateImageMarker(self._dictionary, number, cells * _CELL_PX)
            self._prints[number] = np.pad(inner, _CELL_PX, constant_values=255)
        return self._prints[number]


def _window(to_picture: Floats, side_px: int, shape: tuple[int, ...]) -> tuple[int, int, int, int]:
    """Left, top, right and low of the picture part that a print covers."""
    edge = float(side_px)
    corners = np.array([[[0.0, 0.0], [edge, 0.0], [edge, edge], [0.0, edge]]])
    covered = cv2.perspectiveTransform(corners, np.asarray(to_picture, dtype=float))[0]
    left, top = np.maximum(np.floor(covered.min(axis=0)) - 1.0, 0.0)
    right, low = np.minimum(np.ceil(covered.max(axis=0)) + 2.0, (shape[1], shape[0]))
    return int(left), int(top), int(right), int(low)


_POLL_S = 0.02


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
                self._fault = "it delivers no more pictures; check its cable"
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
        self._frames = SimulatedFrames[TagPicture](camera.rate_hz, clock.now_s())

    def arrived(self, now_s: float) -> list[TagPicture]:
        """Record a picture if due; return arrived ones."""
        return self._frames.arrived(now_s, lambda: self._picture(now_s))

    def _picture(self, now_s: float) -> TagPicture:
        picture = self._drawn.picture(*self._body())
        self._on_picture(np.dstack([picture] * 3), now_s)
        return TagPicture(now_s, self._detector.find(picture))

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
        clock.sleep_until_s(clock.now_s() + _POLL_S)
    if not pictures_with_tags:
        raise InputError(f"pose tags: no picture within {PATIENCE_S:g} s; check the camera")
    raise InputError(
        f"pose tags: {pictures_with_tags} pictures show no tag of tags.on; check light, focus, "
        "dictionary and the numbers of the tags"
    )
