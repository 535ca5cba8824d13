"""Frames drawn with known truth: the fit, both ends, gaps, latency."""

from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from snakewalk.config.camera import CameraConfig
from snakewalk.config.loader import load_robot
from snakewalk.config.world import FrictionConfig
from snakewalk.controller.cameras.camera_pose import CameraPose, PriorAt
from snakewalk.controller.cameras.overhead_camera import (
    CameraModel,
    LineDetection,
    OverheadDetector,
)
from snakewalk.controller.cameras.pose_fit import fit_both_ends
from snakewalk.controller.kinematics.links import body_in_world, pose_at
from snakewalk.controller.pose.dead_reckoning import DeadReckoning
from snakewalk.controller.track.frame_status import FrameStatus
from snakewalk.drivers.types import BodyPose, JointState
from tests.oracles.overhead_scene import DrawnView

ROBOT = load_robot("yaw16")
CAMERA = CameraConfig()
MODEL = CameraModel.straight_down(CAMERA, (0.0, 0.0))
VIEW = DrawnView(ROBOT, MODEL, (CAMERA.width_px, CAMERA.height_px))
DETECTOR = OverheadDetector(MODEL, VIEW.empty_floor(), ROBOT.body_radius_m, CAMERA.shade)
NUMBER = np.arange(ROBOT.joint_count)


def wave(amplitude: float, phase: float, step: float = 0.6) -> np.ndarray:
    return amplitude * np.sin(phase + step * NUMBER)


def turn_between(one: float, other: float) -> float:
    return abs(np.arctan2(np.sin(one - other), np.cos(one - other)))


def state_at(time_s: float, joints: np.ndarray) -> JointState:
    count = len(joints)
    still, none = np.zeros(count), np.zeros(count, dtype=np.uint8)
    read = np.ones(count, dtype=bool)
    return JointState(time_s, joints, still, still, still, still, none, none, still, read, still)


@pytest.mark.fast_cases(4)
@pytest.mark.parametrize("heading", [0.0, 1.3, -2.6])
@pytest.mark.parametrize("bend", [wave(0.45, 0.3), wave(0.3, 2.0, 0.45), np.full(16, 0.12)])
def test_head_and_heading_are_found_to_a_third_of_a_pixel(heading: float, bend: np.ndarray) -> None:
    head = 0.5 * np.array([np.cos(heading), np.sin(heading)])
    pose = pose_at(head, heading)
    seen = DETECTOR.detect(VIEW.picture(pose, bend), 0.0)
    assert seen.status is FrameStatus.GOOD
    fits = fit_both_ends(ROBOT, seen.line_m, bend)
    near = min(fits, key=lambda fit: np.hypot(*(fit.head_m - head)))
    assert np.hypot(*(near.head_m - head)) < 0.0031  # 9.4 mm a pixel
    assert turn_between(near.heading_rad, heading) < 0.006
    links = body_in_world(ROBOT, pose, bend).link_m[:, :2]
    assert np.hypot(*(near.links_m - links).T).max() < 0.006


def test_the_joints_tell_the_head_from_the_tail_where_the_shape_has_two_ends() -> None:
    coiled_in_front = np.where(NUMBER < 8, 0.25, 0.0)
    pose = pose_at(np.array([0.4, 0.2]), 0.5)
    line = DETECTOR.detect(VIEW.picture(pose, coiled_in_front), 0.0).line_m
    for seen in (line, line[::-1]):
        better = min(fit_both_ends(ROBOT, seen, coiled_in_front), key=lambda fit: fit.error_m)
        np.testing.assert_allclose(better.head_m, (0.4, 0.2), atol=0.005)


def test_one_bad_stretch_of_the_line_hardly_moves_the_fit() -> None:
    bend = wave(0.4, 0.0)
    links = body_in_world(ROBOT, pose_at(np.zeros(2), 0.0), bend).link_m[:, :2]
    line = np.column_stack(
        [np.interp(np.linspace(-0.5, 16.5, 171), np.arange(17), axis) for axis in links.T]
    )
    line[80:100, 1] += 0.05 * np.sin(np.linspace(0.0, np.pi, 20))
    bent = fit_both_ends(ROBOT, line, bend)[0]
    assert np.hypot(*bent.head_m) < 0.008


def test_a_hidden_tail_does_not_pull_a_bent_body_back() -> None:
    bend = wave(0.4, 0.0)
    whole = detection(0.0, pose_at(np.zeros(2), 0.0), bend).line_m[::-1]
    cut = whole[:-6]  # 42 mm: the middle moves by 21 mm
    assert np.hypot(*fit_both_ends(ROBOT, cut, bend)[0].head_m) < 0.006


@dataclass
class ScriptedCamera:
    """A camera that hands over a list of frames, each ``delay_s`` after it was taken."""

    frames: list[LineDetection]
    delay_s: float = 1.0 / 30.0
    start: LineDetection | None = None
    handed: int = field(default=0)

    def first(self) -> LineDetection:
        return self.start or self.frames[0]

    def arrived(self, now_s: float, prior_at: PriorAt) -> list[LineDetection]:
        due = [one for one in self.frames if one.time_s + self.delay_s <= now_s]
        new = due[self.handed :]
        self.handed = len(due)
        return new


def detection(time_s: float, pose: BodyPose, bend: np.ndarray) -> LineDetection:
    """Exact, without an image: the line through the links, its ends in either order."""
    body = body_in_world(ROBOT, pose, bend)
    links, half = body.link_m[:, :2], 0.5 * ROBOT.mean_link_length_m * body.forward[:, :2]
    corners = np.vstack([links[0] + half[0], links, links[-1] - half[-1]])
    at = np.concatenate([[0.0], np.arange(17) + 0.5, [17.0]])
    line = np.column_stack([np.interp(np.linspace(0, 17, 171), at, axis) for axis in corners.T])
    return LineDetection(time_s, line[::-1].copy(), FrameStatus.GOOD)


def camera_pose(
    camera: ScriptedCamera, said: list[str], start=(0.0, 0.0), heading=0.0
) -> CameraPose:
    friction = FrictionConfig()
    return CameraPose(ROBOT, camera, DeadReckoning(ROBOT, friction, start, heading), said.append)


def test_a_late_frame_is_laid_to_the_joints_of_its_own_time() -> None:
    """The true body moves just as dead reckoning says, but from elsewhere: the pose is exact."""
    reckoning = DeadReckoning(ROBOT, FrictionConfig(), (0.7, -0.4), 1.1)
    states = [state_at(0.02 * k, wave(0.4, 0.08 * k)) for k in range(60)]
    true = [reckoning(state) for state in states]
    frames = [detection(states[k].time_s, true[k], states[k].position_rad) for k in range(0, 60, 3)]
    pose = camera_pose(ScriptedCamera(frames), [], start=(0.5, -0.5), heading=0.8)
    for state, truth in zip(states, true, strict=True):
        found = pose(state)
        np.testing.assert_allclose(found.head_in_world_m[:2], truth.head_in_world_m[:2], atol=0.004)
        assert turn_between(found.heading_rad, truth.heading_rad) < 0.01
        assert found.head_in_world_m[2] == ROBOT.body_radius_m
    assert pose.used == pose.frames == 21  # the first one was looked at alone before


def test_a_body_laid_straight_has_its_head_where_the_run_says() -> None:
    straight = np.zeros(16)
    truth = pose_at(np.array([0.1, 0.05]), 0.1)
    pose = camera_pose(ScriptedCamera([detection(0.0, truth, straight)]), [])
    found = pose(state_at(0.0, straight))
    np.testing.assert_allclose(found.head_in_world_m[:2], (0.1, 0.05), atol=1e-3)
    assert turn_between(found.heading_rad, 0.1) < 1e-3


def test_a_body_laid_the_wrong_way_round_is_found_at_its_first_bend() -> None:
    bend = np.where(NUMBER < 8, 0.25, 0.0)
    truth = pose_at(np.array([-1.1, 0.0]), 3.0)
    pose = camera_pose(ScriptedCamera([detection(0.0, truth, bend)]), [])
    found = pose(state_at(0.0, bend))
    np.testing.assert_allclose(found.head_in_world_m[:2], (-1.1, 0.0), atol=4e-3)


def test_frames_that_cannot_be_used_are_bridged_and_told() -> None:
    bend = wave(0.3, 0.0)
    truth = pose_at(np.array([0.3, 0.3]), 0.4)
    nothing = np.full((101, 2), np.nan)
    frames = [detection(0.0, truth, bend)]
    frames += [LineDetection(k / 30.0, nothing, FrameStatus.CUT) for k in range(1, 20)]
    frames += [detection(k / 30.0, truth, bend) for k in range(20, 30)]
    said: list[str] = []
    pose = camera_pose(ScriptedCamera(frames, start=frames[0]), said, heading=0.4)
    for k in range(50):
        found = pose(state_at(0.02 * k, bend))
        np.testing.assert_allclose(found.head_in_world_m[:2], (0.3, 0.3), atol=1e-3)
    assert len(said) == 2
    assert "lost the body: cut by the edge of the image; dead reckoning" in said[0]
    assert "has the body again" in said[1]
    assert pose.frames - pose.used == 19


def test_something_else_than_the_robot_is_not_believed() -> None:
    bend = wave(0.4, 0.0)
    truth = pose_at(np.zeros(2), 0.0)
    good = detection(0.0, truth, bend)
    stick = replace(good, time_s=0.1, line_m=np.linspace((1.0, 1.0), (1.0, 2.2), 101))
    said: list[str] = []
    pose = camera_pose(ScriptedCamera([good, stick]), said)
    for k in range(30):
        found = pose(state_at(0.02 * k, bend))
    np.testing.assert_allclose(found.head_in_world_m[:2], (0.0, 0.0), atol=1e-3)
    assert pose.frames - pose.used == 1
    assert "off the measured joints" in said[0]


def test_a_body_over_the_edge_is_said_to_be_cut() -> None:
    pose = pose_at(np.array([3.4, 0.0]), 0.0)
    seen = DETECTOR.detect(VIEW.picture(pose, wave(0.2, 0.0)), 0.0)
    assert seen.status is FrameStatus.CUT
    assert np.isnan(seen.line_m).all()
