"""What stays beside the robot becomes floor in time; the robot itself never does."""

from dataclasses import replace

import numpy as np
import pytest

from snakewalk.config.arrays import Floats, Image
from snakewalk.config.camera import CameraConfig
from snakewalk.config.loader import load_robot
from snakewalk.controller.cameras.floor_learning import FloorLearning
from snakewalk.controller.cameras.overhead_camera import CameraModel, OverheadDetector
from snakewalk.controller.cameras.pose_tracking import BodyPrior
from snakewalk.controller.kinematics.links import body_in_world, pose_at
from tests.oracles.overhead_scene import DrawnView

pytestmark = pytest.mark.costs("draws and learns a floor over many frames")

ROBOT = load_robot("yaw16")
CAMERA = CameraConfig(width_px=320, height_px=240, field_width_m=3.0, height_m=3.0)
MODEL = CameraModel.straight_down(CAMERA, (0.0, 0.0))
VIEW = DrawnView(ROBOT, MODEL, (CAMERA.width_px, CAMERA.height_px))
FLOOR = VIEW.empty_floor()
FRESH = OverheadDetector(MODEL, FLOOR, ROBOT.body_radius_m, CAMERA.shade)
BEND = 0.4 * np.sin(0.3 + 0.6 * np.arange(ROBOT.joint_count))
HERE, THERE = np.array([0.5, 0.55]), np.array([0.5, -0.35])
BOX = slice(115, 200), slice(125, 195)
LEARN_S = 60.0


def picture(head: Floats, *, box: bool) -> Image:
    """The robot, and a box of another colour under it where it reaches there."""
    out = VIEW.picture(pose_at(head, 0.2), BEND).copy()
    if box:
        bare = np.abs(out[BOX].astype(int) - FLOOR[BOX]).max(axis=2) < 12
        out[BOX][bare] = (60, 120, 190)
    return out


def prior(head: Floats) -> BodyPrior:
    body = body_in_world(ROBOT, pose_at(head + 0.02, 0.25), BEND)
    return BodyPrior(body.link_m[:, :2], body.forward[:, :2])


def watched(image: Image, head: Floats, minutes: float, learn_s: float) -> OverheadDetector:
    """The detector after so long of one picture, a frame every five seconds."""
    detector, learning = FRESH, FloorLearning(ROBOT, learn_s)
    chance = np.random.default_rng(1)
    for time_s in np.arange(0.0, 60.0 * minutes, 5.0):
        noisy = np.clip(image + chance.normal(0.0, 2.0, image.shape), 0.0, 255.0)
        now = np.rint(noisy).astype(np.uint8)
        found = detector.track(now, float(time_s), prior(head), ROBOT)
        detector = learning.after(detector, now, prior(head), found)
    return detector


def off_m(detector: OverheadDetector, head: Floats, *, box: bool) -> float:
    """How far the head is off; infinite where the frame is not used."""
    found = detector.track(picture(head, box=box), 0.0, prior(head), ROBOT)
    return np.inf if found.fault else float(np.hypot(*(found.head_m - head)))


def test_a_box_that_stays_becomes_floor() -> None:
    assert off_m(FRESH, THERE, box=False) < 0.005
    assert off_m(FRESH, THERE, box=True) > 0.005, "the box beside the body spoils the pose"
    learnt = watched(picture(HERE, box=True), HERE, 5.0, LEARN_S)
    assert off_m(learnt, THERE, box=True) < 0.005


@pytest.mark.slow
def test_a_box_that_became_floor_and_is_taken_away_leaves_none_behind() -> None:
    learnt = watched(picture(HERE, box=True), HERE, 5.0, LEARN_S)
    assert off_m(learnt, THERE, box=False) < 0.005
    forgetful = replace(learnt, pictured=None)
    assert off_m(forgetful, THERE, box=False) > 0.005, "what was learnt alone would spoil the pose"


def test_a_floor_that_is_not_to_be_learnt_stays_as_it_was_pictured() -> None:
    assert watched(picture(HERE, box=True), HERE, 2.0, 0.0) is FRESH


@pytest.mark.slow
def test_a_robot_that_stands_still_never_becomes_floor() -> None:
    image = picture(HERE, box=False)
    robot = np.abs(image.astype(int) - FLOOR).max(axis=2) > 25
    learnt = watched(image, HERE, 5.0, 5.0)
    assert learnt is not FRESH
    assert (learnt.background[robot] == FLOOR[robot]).all()
    assert off_m(learnt, HERE, box=False) < 0.005


@pytest.mark.slow
def test_nothing_is_learnt_while_the_robot_is_not_where_it_is_believed() -> None:
    gone = picture(THERE, box=True)
    assert watched(gone, HERE, 5.0, 5.0) is FRESH


def test_a_pose_that_fits_badly_teaches_nothing() -> None:
    image = picture(HERE, box=True)
    learning = FloorLearning(ROBOT, LEARN_S)
    found = FRESH.track(image, 0.0, prior(HERE), ROBOT)
    rough = replace(found, error_m=0.2 * ROBOT.body_radius_m)
    for time_s in np.arange(0.0, 100.0, 5.0):
        at = replace(rough, time_s=float(time_s))
        assert learning.after(FRESH, image, prior(HERE), at) is FRESH


def test_after_a_bump_the_floor_is_learnt_anew_from_the_moved_picture() -> None:
    image = picture(HERE, box=True)
    learning = FloorLearning(ROBOT, LEARN_S)
    detector = FRESH
    found = FRESH.track(image, 0.0, prior(HERE), ROBOT)
    for time_s in np.arange(0.0, 60.0, 5.0):
        at = replace(found, time_s=float(time_s))
        detector = learning.after(detector, image, prior(HERE), at)
    moved = replace(FRESH, background=FLOOR.copy())
    again = learning.after(moved, image, prior(HERE), replace(found, time_s=62.0))
    before = np.abs(detector.background[BOX].astype(int) - FLOOR[BOX]).mean()
    after = np.abs(again.background[BOX].astype(int) - FLOOR[BOX]).mean()
    assert 0.0 < after < 0.25 * before
