"""Drawn frames with known truth: light, shadow, foreign things, a bumped camera, no robot."""

from collections.abc import Callable

import cv2
import numpy as np
import pytest

from snakewalk.config.arrays import Floats
from snakewalk.config.camera import CameraConfig
from snakewalk.config.loader import load_robot
from snakewalk.config.robot import LinkConfig, RobotConfig
from snakewalk.controller.cameras.floor_light import lit_floor, unexplained
from snakewalk.controller.cameras.overhead_camera import CameraModel, OverheadDetector
from snakewalk.controller.cameras.pose_tracking import BodyPrior
from snakewalk.controller.kinematics.links import body_in_world, pose_at
from tests.oracles.overhead_scene import DrawnView

ROBOT = load_robot("yaw16")
CAMERA = CameraConfig(width_px=320, height_px=240, field_width_m=3.0, height_m=3.0)
MODEL = CameraModel.straight_down(CAMERA, (0.0, 0.0))
VIEW = DrawnView(ROBOT, MODEL, (CAMERA.width_px, CAMERA.height_px))
DETECTOR = OverheadDetector(MODEL, VIEW.empty_floor(), ROBOT.body_radius_m, CAMERA.shade)
BEND = 0.4 * np.sin(0.3 + 0.6 * np.arange(ROBOT.joint_count))
HEAD = np.array([0.5, 0.15])
POSE = pose_at(HEAD, 0.4)
PICTURE = VIEW.picture(POSE, BEND)


def prior(
    dx: float = 0.03, dy: float = -0.03, turn: float = 0.08, bend: Floats = BEND
) -> BodyPrior:
    body = body_in_world(ROBOT, pose_at(HEAD + np.array([dx, dy]), 0.4 + turn), bend)
    return BodyPrior(body.link_m[:, :2], body.forward[:, :2])


def sun(frame: Floats) -> Floats:
    lit = frame.copy()
    lit[60:160, 150:260] *= 1.4
    return lit


def gradient(frame: Floats) -> Floats:
    return frame * np.linspace(0.7, 1.3, frame.shape[1])[None, :, None]


def box(frame: Floats) -> Floats:
    out = frame.copy()
    out[:60, 100:200] = 20.0
    return out


def noisy(frame: Floats) -> Floats:
    return frame + np.random.default_rng(3).normal(0.0, 15.0, frame.shape)


@pytest.mark.parametrize(
    "fault",
    [lambda f: f, lambda f: 0.65 * f, lambda f: 1.5 * f, sun, gradient, box, noisy],
    ids=["none", "darker", "brighter", "sun", "gradient", "box", "noise"],
)
def test_the_head_is_found_in_another_light_and_beside_other_things(
    fault: Callable[[Floats], Floats],
) -> None:
    image = np.clip(np.rint(fault(PICTURE.astype(float))), 0.0, 255.0).astype(np.uint8)
    found = DETECTOR.track(image, 0.0, prior(), ROBOT)
    assert found.fault == ""
    assert np.hypot(*(found.head_m - HEAD)) < 0.004
    assert found.heading_rad == pytest.approx(0.4, abs=0.01)


def test_the_head_of_a_robot_with_unequal_links_is_found() -> None:
    """A third of the links are as long as their default: 0.07 m; the rest are not."""
    links = (*(LinkConfig(length_m=0.04),) * 6, *(LinkConfig(),) * 6, LinkConfig(length_m=0.12))
    robot = RobotConfig(name="uneven", joint_axes="y" * 12, links=links)
    bend = 0.4 * np.sin(0.3 + 0.6 * np.arange(12))
    view = DrawnView(robot, MODEL, VIEW.size_px)
    detector = OverheadDetector(MODEL, view.empty_floor(), robot.body_radius_m, CAMERA.shade)
    body = body_in_world(robot, pose_at(HEAD + np.array([0.03, -0.03]), 0.48), bend)
    believed = BodyPrior(body.link_m[:, :2], body.forward[:, :2])
    found = detector.track(view.picture(POSE, bend), 0.0, believed, robot)
    assert found.fault == ""
    assert np.hypot(*(found.head_m - HEAD)) < 0.004
    assert found.heading_rad == pytest.approx(0.4, abs=0.01)


def test_no_pose_is_told_where_the_robot_is_not() -> None:
    """An empty floor, a robot out of reach, a box in its place, another shape."""
    floor = VIEW.empty_floor()
    assert DETECTOR.track(floor, 0.0, prior(), ROBOT).fault
    assert DETECTOR.track(PICTURE, 0.0, prior(dx=0.5), ROBOT).fault
    filled = floor.copy()
    filled[40:200, 60:280] = 30
    assert DETECTOR.track(filled, 0.0, prior(), ROBOT).fault
    assert DETECTOR.track(PICTURE, 0.0, prior(bend=-BEND), ROBOT).fault


def test_half_a_body_is_not_told_as_a_pose() -> None:
    covered = PICTURE.copy()
    px = MODEL.in_image(HEAD - np.array([0.55, 0.2]), 0.0)
    covered[:, : int(px[0])] = VIEW.empty_floor()[:, : int(px[0])]
    assert DETECTOR.track(covered, 0.0, prior(), ROBOT).fault


def test_a_bumped_camera_is_noticed_and_undone() -> None:
    move = np.array([[1.0, 0.0, 3.0], [0.0, 1.0, -2.6]])
    moved = np.asarray(
        cv2.warpAffine(PICTURE, move, (320, 240), borderMode=cv2.BORDER_REPLICATE), np.uint8
    )
    assert DETECTOR.registered(PICTURE) is DETECTOR
    detector = DETECTOR.registered(moved)
    np.testing.assert_allclose(detector.model.moved_px, (3.0, -2.6), atol=0.25)
    found = detector.track(moved, 0.0, prior(), ROBOT)
    assert found.fault == ""
    assert np.hypot(*(found.head_m - HEAD)) < 0.005
    assert found.bump is not None
    assert found.bump.shift_px == detector.model.moved_px
    there = MODEL.on_plane(np.array([100.0, 80.0]), 0.03)
    px = detector.model.in_image(there, 0.03)
    np.testing.assert_allclose(px, np.array([100.0, 80.0]) + detector.model.moved_px)


def test_light_and_shadow_of_any_colourless_kind_are_floor() -> None:
    """Closed form: a gain everywhere, and a pixel that all channels lose alike."""
    floor = np.full((60, 80, 3), (150, 120, 90), np.uint8)
    image = np.asarray(np.rint(floor * 0.8), np.uint8)
    np.testing.assert_allclose(lit_floor(image, floor, 50.0), image, atol=2)
    shaded, coloured = image.copy(), image.copy()
    shaded[30, 40] = np.rint(image[30, 40] * 0.6)
    coloured[30, 40] = (120, 96, 20)
    assert unexplained(shaded, image, 0.5)[30, 40] < 1.0
    assert unexplained(coloured, image, 0.5)[30, 40] == pytest.approx(52.0, abs=1.0)
    assert unexplained(shaded, image, 0.2)[30, 40] > 10.0
