"""What frames say of a camera: latency in closed form, markers, light, a bump."""

from dataclasses import replace

import numpy as np
import pytest

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.cameras.camera_check import CameraCheck
from snakewalk.controller.cameras.camera_latency import LatencyFit, fit_latency
from snakewalk.controller.cameras.overhead_camera import LineDetection, OverheadDetector
from snakewalk.controller.kinematics.links import body_in_world, pose_at
from snakewalk.controller.track.frame_status import FrameStatus
from tests.oracles.marked_floor import CAMERA, DETECTOR, FLOOR, ROBOT, TRUE, VIEW

JOINT_S = np.arange(0.0, 8.0, 0.02)


def joints(time_s: float) -> Floats:
    """Three joints at the head move unevenly."""
    angle = 0.15 * (np.sin(3.8 * time_s) + np.sin(6.1 * time_s))
    return np.where(np.arange(ROBOT.joint_count) < 3, angle, 0.05)


def line(taken_s: float, told_s: float, chance: np.random.Generator) -> LineDetection:
    """The body as it was at one time, while it slides and turns, told later from either end."""
    where = pose_at(np.array([0.3 * taken_s, np.sin(taken_s)]), 0.8 * taken_s)
    links = body_in_world(ROBOT, where, joints(taken_s)).link_m[:, :2]
    ahead = 0.5 * (links[0] - links[1]), 0.5 * (links[-1] - links[-2])
    points = np.vstack([links[0] + ahead[0], links, links[-1] + ahead[1]])
    arc = np.concatenate([[0.0], np.hypot(*np.diff(points, axis=0).T).cumsum()])
    even = np.linspace(0.0, arc[-1], 101)
    found = np.stack([np.interp(even, arc, one) for one in points.T], axis=1)
    found += chance.normal(0.0, 0.002, found.shape)
    return LineDetection(told_s, found[:: chance.choice([-1, 1])], FrameStatus.GOOD)


def fitted(delay_s: float, joint_rad: Floats | None = None, frames: int = 150) -> LatencyFit:
    chance = np.random.default_rng(4)
    lines = [line(t, t + delay_s, chance) for t in np.linspace(0.1, 7.3, frames)]
    known = np.stack([joints(t) for t in JOINT_S]) if joint_rad is None else joint_rad
    return fit_latency(ROBOT, lines, JOINT_S, known)


@pytest.mark.parametrize("delay_s", [0.0, 0.033, 0.12, 0.4])
def test_the_latency_is_found_wherever_the_body_slides(delay_s: float) -> None:
    fit = fitted(delay_s)
    assert fit.fault == ""
    assert fit.latency_s == pytest.approx(delay_s, abs=0.004)
    assert fit.error_s < 0.005


def test_what_tells_no_latency_is_told() -> None:
    assert "did not move" in fitted(0.1, np.zeros((len(JOINT_S), ROBOT.joint_count))).fault
    assert "20 frames" in fitted(0.1, frames=20).fault
    other = np.where(
        np.arange(ROBOT.joint_count) > 12, 0.3 * np.sin(1.7 * JOINT_S[:, None] ** 1.3), 0.0
    )
    assert "does not move as the joints do" in fitted(0.1, other).fault
    late = fitted(0.1, np.full((len(JOINT_S), ROBOT.joint_count), np.nan))
    assert "read 0 times" in late.fault


def test_frames_markers_light_and_a_bump_are_reported() -> None:
    check = CameraCheck(CAMERA, ROBOT, DETECTOR)
    with pytest.raises(InputError, match="no frame"):
        check.report()
    covered = FLOOR.copy()
    covered[:60, :60] = 150  # number 12
    for k in range(11):
        frame = covered if k >= 6 else FLOOR
        lit = np.roll(frame, 4, axis=1).astype(float) * (1.1 if k % 2 else 1.0)
        check.add_frame(np.clip(lit, 0.0, 255.0).astype(np.uint8), 0.3 * k + 0.2 * (k > 8))
    found = check.report()
    assert (found.frames, found.size_px) == (11, (320, 240))
    assert found.duration_s == pytest.approx(3.2)
    assert found.rate_hz == pytest.approx(10.0 / 3.2)
    assert found.gap_max_s == pytest.approx(0.5)
    assert found.seen[12] == pytest.approx(6.0 / 11.0)
    assert found.seen[0] == found.seen[7] == 1.0
    assert found.floor is not None
    assert found.bump is not None
    assert found.bump.away_px == pytest.approx(4.0, abs=0.2)
    assert found.light_spread == pytest.approx(0.1, abs=0.02)
    assert found.latency is None


@pytest.mark.slow
def test_the_body_is_followed_in_a_window_from_frame_to_frame() -> None:
    """Drawn frames, 80 ms late."""
    view = replace(VIEW, noise=2.0, markers_m={})
    detector = OverheadDetector(TRUE, view.empty_floor(), ROBOT.body_radius_m, 0.5)
    check = CameraCheck(CAMERA.model_copy(update={"markers_m": None}), ROBOT, detector)
    for k, time_s in enumerate(np.arange(0.0, 3.2, 0.05)):
        for read in (0.0, 0.025):
            check.add_joints(time_s + read, joints(time_s + read))
        if time_s >= 0.08:
            image = view.picture(pose_at(np.array([0.6, 0.1]), 0.2), joints(time_s - 0.08), k)
            check.add_frame(image, time_s)
    fit = check.report().latency
    assert fit is not None
    assert fit.fault == ""
    assert fit.latency_s == pytest.approx(0.08, abs=0.012)
