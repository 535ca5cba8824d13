"""The overhead camera: frames a second on one core at 640 x 480, and how far off the pose is.

A drawn view, so that it runs without OpenGL; drawing is not counted.
"""

from functools import partial
from itertools import cycle

import cv2
import numpy as np

from benchmarks.rows import Row, cpu_s
from snakewalk.config.camera import CameraConfig
from snakewalk.config.loader import load_robot
from snakewalk.controller.cameras.overhead_camera import CameraModel, OverheadDetector
from snakewalk.controller.cameras.pose_fit import fit_both_ends
from snakewalk.controller.kinematics.links import pose_at
from snakewalk.controller.track.frame_status import FrameStatus
from tests.oracles.overhead_scene import DrawnView

TITLE = "Overhead camera: a frame of 640 x 480 to head, heading and links, on one core"

WANTED_HZ = 30.0
FRAMES = 40


def run() -> list[Row]:
    """Measure."""
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        return _rows()
    finally:
        cv2.setNumThreads(threads)


def _rows() -> list[Row]:
    robot, camera = load_robot("yaw16"), CameraConfig()
    model = CameraModel.straight_down(camera, (0.0, 0.0))
    view = DrawnView(robot, model, (camera.width_px, camera.height_px))
    detector = OverheadDetector(model, view.empty_floor(), robot.body_radius_m, camera.shade)
    chance = np.random.default_rng(1)
    scenes = []
    for k in range(FRAMES):
        bend = chance.uniform(0.1, 0.5) * np.sin(
            chance.uniform(0.0, 6.3) + chance.uniform(0.4, 0.8) * np.arange(robot.joint_count)
        )
        heading = float(chance.uniform(-3.1, 3.1))
        back = 0.5 * robot.length_m * np.array([np.cos(heading), np.sin(heading)])
        pose = pose_at(chance.uniform(-1.0, 1.0, 2) + back, heading)
        scenes.append((pose, bend, view.picture(pose, bend, k + 1)))
    off_m, off_rad, used = [], [], 0
    for pose, bend, image in scenes:
        detection = detector.detect(image, 0.0)
        if detection.status is not FrameStatus.GOOD:
            continue
        used += 1
        # which end leads is known from the frame before; here from the truth
        fits = fit_both_ends(robot, detection.line_m, bend)
        fit = max(fits, key=lambda one: np.cos(one.heading_rad - pose.heading_rad))
        off_m.append(float(np.hypot(*(fit.head_m - pose.head_in_world_m[:2]))))
        turn = fit.heading_rad - pose.heading_rad
        off_rad.append(float(np.arctan2(np.sin(turn), np.cos(turn))))
    endless = cycle(scenes)

    def frame() -> None:
        _, bend, image = next(endless)
        line_m = detector.detect(image, 0.0).line_m
        if np.isfinite(line_m).all():
            fit_both_ends(robot, line_m, bend)

    sight_s = cpu_s(partial(detector.detect, scenes[0][2], 0.0), 10)
    whole_s = cpu_s(frame, FRAMES)
    metre_px = camera.field_width_m / camera.width_px
    head_m = float(np.sqrt(np.mean(np.square(off_m))))
    return [
        Row("frames a second", 1.0 / whole_s, "Hz", "30 Hz", WANTED_HZ * whole_s, 1.0),
        Row("silhouette and medial axis", sight_s * 1e3, "ms"),
        Row("all of it, with the fit", whole_s * 1e3, "ms", "33 ms", WANTED_HZ * whole_s, 1.0),
        Row(f"frames used, of {FRAMES}", used, "frames"),
        Row("head, rms", head_m * 1e3, "mm", "a pixel", head_m / metre_px),
        Row("heading, rms", float(np.sqrt(np.mean(np.square(off_rad)))), "rad"),
    ]
