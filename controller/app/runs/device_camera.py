"""A real overhead camera: a thread that takes frames, looks at them, and keeps what it saw.

Looking takes longer than a cycle of the loop may, so it is done beside it.
"""

import queue
import threading
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from snakewalk.config.arrays import Image
from snakewalk.config.camera import CameraConfig
from snakewalk.config.errors import InputError
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.controller.app.runs.rendered_camera import centre_of, require_whole_body
from snakewalk.controller.capture.image.video import read_image
from snakewalk.controller.localization.lens import Lens
from snakewalk.controller.localization.overhead_camera import (
    CameraModel,
    LineDetection,
    OverheadDetector,
)
from snakewalk.drivers.clock import Clock

PATIENCE_S = 5.0
"""How long the first frame is waited for."""


class DeviceCamera:
    """What OpenCV opens under ``camera.device``; ``close`` it.

    A frame is dated when it has been handed over: the camera's own delay is not known.

    Raises:
        InputError: no such camera, no background, another size, no frame, or no robot in it.

    """

    def __init__(self, run: RunConfig, robot: RobotConfig, clock: Clock) -> None:
        camera = run.camera
        self._clock = clock
        self.detector = overhead_detector(run, robot)
        self._name = f"camera {camera.device}"
        self._device = open_device(camera)
        self._found: queue.SimpleQueue[LineDetection | InputError] = queue.SimpleQueue()
        self._gone: InputError | None = None
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="overhead camera", daemon=True)
        self._thread.start()
        try:
            self.start = self.first()
            """What the camera saw first."""
            require_whole_body(self.start, self._name)
        except InputError:
            self.close()
            raise

    def first(self) -> LineDetection:
        """Wait for the next frame.

        Raises:
            InputError: none comes.

        """
        self.arrived(self._clock.now_s())
        if self._gone is not None:
            raise self._gone
        try:
            found = self._found.get(timeout=PATIENCE_S)
        except queue.Empty:
            raise InputError(f"{self._name}: no frame came in {PATIENCE_S:g} s") from None
        if isinstance(found, InputError):
            self._gone = found
            raise found
        return found

    def arrived(self, now_s: float) -> list[LineDetection]:
        """Return what has been seen since the last call, up to ``now_s``."""
        found: list[LineDetection] = []
        while not self._found.empty():
            one = self._found.get_nowait()
            if isinstance(one, InputError):
                self._gone = one
            elif one.time_s <= now_s:
                found.append(one)
        return found

    def close(self) -> None:
        """Stop the thread and let the camera go."""
        self._stop.set()
        self._thread.join(timeout=PATIENCE_S)
        self._device.release()

    def _watch(self) -> None:
        while not self._stop.is_set():
            whole, frame = self._device.read()
            if not whole:
                self._found.put(InputError(f"{self._name}: hands over no more frames"))
                return
            try:
                self._found.put(self.detector.detect(in_colour(frame), self._clock.now_s()))
            except InputError as fault:
                self._found.put(InputError(f"{self._name}: {fault}"))
                return


def overhead_detector(run: RunConfig, robot: RobotConfig) -> OverheadDetector:
    """Build the detector of a real camera from its table in the run.

    Raises:
        InputError: no background image, of another size, no lens in its file, or corners that fix
            no plane.

    """
    camera = run.camera
    ground = in_colour(read_image(Path(camera.background or "")))
    if ground.shape[:2] != (camera.height_px, camera.width_px):
        raise InputError(
            f"{camera.background}: is {ground.shape[1]} x {ground.shape[0]} pixels, the camera "
            f"{camera.width_px} x {camera.height_px}"
        )
    lens = None if camera.lens is None else Lens.read(Path(camera.lens))
    if lens is not None and lens.size_px != (camera.width_px, camera.height_px):
        raise InputError(
            f"{camera.lens}: is of pictures of {lens.size_px[0]} x {lens.size_px[1]} pixels, the "
            f"camera has {camera.width_px} x {camera.height_px}: calibrate in the size of the run"
        )
    centre_m = centre_of(run)
    corners = camera.corners_px is not None
    make = CameraModel.from_corners if corners else CameraModel.straight_down
    model = make(camera, centre_m, lens)
    return OverheadDetector(model, ground, robot.body_radius_m, camera.shade)


def open_device(camera: CameraConfig) -> cv2.VideoCapture:
    """Open the camera in the wanted size and rate.

    Raises:
        InputError: there is none.

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
    """(H, W, 3) whatever the number of channels."""
    out = np.asarray(image, dtype=np.uint8)
    return np.dstack([out] * 3) if out.ndim == 2 else out
