"""Frames of the overhead camera, and the joints at the same time, during a check.

On a port the joints are only read: torque stays unchanged, and a person turns a joint. The
simulated robot wiggles by itself.
"""

import queue
import threading
from collections.abc import Callable
from contextlib import ExitStack, closing
from pathlib import Path

import cv2
import numpy as np

from snakewalk.config.arrays import Floats, Image
from snakewalk.config.errors import InputError
from snakewalk.controller.cameras.camera_check import CameraCheck
from snakewalk.controller.cameras.camera_findings import Lock
from snakewalk.controller.cameras.device_camera import (
    PATIENCE_S,
    in_colour,
    open_device,
    overhead_detector,
)
from snakewalk.controller.run.backend import metal
from snakewalk.controller.run.external.simulated_backend import simulated
from snakewalk.controller.run.prepared_run import PreparedRun
from snakewalk.drivers.clock import WallClock
from snakewalk.drivers.types import JointCommand

_WIGGLE_RAD = 0.25
_WIGGLE_HZ = 0.6, 0.97  # incommensurable: one delay fits, not a period later
_JOINTS = 3  # number of wiggling joints at the head
_RAMP_S = 0.5
_READS_HZ = 50.0  # of the joints, with a real camera

OnFrame = Callable[[Image, CameraCheck, float], None]
"""(H, W, 3) red, green, blue; the check so far; time (s)."""


def show_nothing(image: Image, check: CameraCheck, time_s: float) -> None:
    """Ignore a frame."""


class CameraWatch:
    """A run's camera; ``check`` measures for a while."""

    def __init__(self, prepared: PreparedRun, port: str | None) -> None:
        """Prepare; opens nothing.

        ``port`` is that of the servos to read; None without servos, or with a simulated camera.

        Raises:
            InputError: a port for a simulated camera.

        """
        self._prepared = prepared
        self._port = port
        self._camera = prepared.run.camera
        self.locks: dict[str, Lock] = {}
        """Locks of exposure and white balance, after ``check``."""
        if self._camera.device is None and port is not None:
            raise InputError("--port: a simulated camera does not see real servos: name --device")

    @property
    def name(self) -> str:
        """Name of the camera."""
        device = self._camera.device
        return "simulated" if device is None else device

    def check(self, seconds: float, on_frame: OnFrame = show_nothing) -> CameraCheck:
        """Measure.

        Raises:
            InputError: no camera, no frame, or an unsuitable lens, background or marker.

        """
        if self._camera.device is None:
            return self._check_simulated(seconds, on_frame)
        return self._real(seconds, on_frame)

    def _check_simulated(self, seconds: float, on_frame: OnFrame) -> CameraCheck:
        """Deliver each frame a period after it was taken: the latency to be found."""
        from snakewalk.controller.cameras.rendered_camera import (  # noqa: PLC0415  simulator: an extra
            rendered_detector,
            top_view,
        )

        prepared = self._prepared
        run = self._prepared.run
        camera = self._camera
        robot = prepared.robot
        self.locks = {"exposure": "locked", "white balance": "locked"}
        pose = prepared.initial_pose()
        backend = simulated(run, robot, prepared.world, prepared.ground, pose)
        chain = backend.chain
        clock = backend.clock
        qpos = backend.qpos
        if qpos is None:
            raise AssertionError("the simulator knows its coordinates")
        with closing(top_view(run, robot, prepared.world, prepared.ground)) as view:
            floor = view.empty_floor()
            detector = rendered_detector(run, robot, floor, prepared.ground)
            check = CameraCheck(camera, robot, detector)
            begin = chain.enable()
            goal = begin.position_rad
            begin_s = clock.now_s()
            cycles = 0
            next_s = begin_s
            coming = list[tuple[float, Image]]()
            while clock.now_s() < begin_s + seconds:
                state = chain.read()  # the simulated body has the pose of this read
                now_s = state.time_s
                check.add_joints(now_s - float(state.age_s.mean()), state.position_rad)
                if now_s >= next_s - 1e-9:
                    coming.append((now_s + 1.0 / camera.rate_hz, view.picture(qpos())))
                    next_s += 1.0 / camera.rate_hz
                while coming and coming[0][0] <= now_s + 1e-9:
                    due_s, image = coming.pop(0)
                    check.add_frame(image, due_s)
                    on_frame(image, check, due_s)
                chain.write(JointCommand(now_s, goal + _wiggle(now_s - begin_s, len(goal))))
                cycles += 1
                clock.sleep_until_s(begin_s + cycles / run.cycle_hz)
            chain.disable()
        return check

    def _real(self, seconds: float, on_frame: OnFrame) -> CameraCheck:
        run = self._prepared.run
        robot = self._prepared.robot
        camera = self._camera
        ground = self._prepared.ground
        detector = None if camera.background is None else overhead_detector(run, robot, ground)
        check = CameraCheck(camera, robot, detector)
        with ExitStack() as stack:
            chain = None
            if self._port is not None:
                backend = metal(run, robot, self._port)
                chain = backend.chain
                clock = backend.clock
            else:
                clock = WallClock()
            device = open_device(camera)
            stack.callback(device.release)
            self.locks = device_locks(device)
            frames: queue.SimpleQueue[tuple[Image | None, float]] = queue.SimpleQueue()
            stop = threading.Event()
            film = Path(camera.device or "").is_file()

            def take() -> None:
                while not stop.is_set():
                    is_read, frame = device.read()
                    shown_s = 1e-3 * device.get(cv2.CAP_PROP_POS_MSEC) if film else clock.now_s()
                    frames.put((in_colour(frame) if is_read else None, shown_s))
                    if not is_read:
                        return

            thread = threading.Thread(target=take, name="camera check", daemon=True)
            begin_s = clock.now_s()
            thread.start()
            stack.callback(thread.join, PATIENCE_S)
            stack.callback(stop.set)
            reads = 0
            patient_s = PATIENCE_S
            while clock.now_s() < begin_s + seconds:
                if chain is not None:
                    state = chain.read()
                    good = np.where(state.valid, state.position_rad, np.nan)
                    check.add_joints(state.time_s - float(state.age_s.mean()), good)
                    reads += 1
                    clock.sleep_until_s(begin_s + reads / _READS_HZ)
                try:
                    image, time_s = frames.get(timeout=0.0 if chain is not None else 0.1)
                except queue.Empty:
                    if clock.now_s() - begin_s > patient_s:
                        raise InputError(
                            f"camera {self.name}: no frame came in {PATIENCE_S:g} s"
                        ) from None
                    continue
                if image is None:
                    break
                patient_s = clock.now_s() - begin_s + PATIENCE_S
                check.add_frame(image, time_s)
                on_frame(image[..., ::-1], check, time_s)
        return check


def device_locks(device: cv2.VideoCapture) -> dict[str, Lock]:
    """Whether exposure and white balance are locked, if Video4Linux reports it."""
    if device.getBackendName() != "V4L2":
        return {"exposure": "not reported", "white balance": "not reported"}
    exposure: dict[float, Lock] = {1.0: "locked", 0.0: "automatic", 3.0: "automatic"}
    white: dict[float, Lock] = {0.0: "locked", 1.0: "automatic"}
    return {
        "exposure": exposure.get(device.get(cv2.CAP_PROP_AUTO_EXPOSURE), "not reported"),
        "white balance": white.get(device.get(cv2.CAP_PROP_AUTO_WB), "not reported"),
    }


def _wiggle(time_s: float, joints: int) -> Floats:
    """(J,) offset of the goals: uneven, so that only one delay fits."""
    grown = min(1.0, time_s / _RAMP_S)
    angle = sum(np.sin(2.0 * np.pi * hz * time_s) for hz in _WIGGLE_HZ) / len(_WIGGLE_HZ)
    return np.where(np.arange(joints) < _JOINTS, _WIGGLE_RAD * grown * angle, 0.0)
