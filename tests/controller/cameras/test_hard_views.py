"""Drawn frames with a hard shadow, a cover, bands or blocks: the pose and its uncertainty."""

from collections.abc import Iterator
from dataclasses import replace

import cv2
import numpy as np
import pytest

from snakewalk.config.arrays import Floats, Image
from snakewalk.config.camera import CameraConfig
from snakewalk.config.loader import load_robot
from snakewalk.controller.cameras.floor_light import banded_floor
from snakewalk.controller.cameras.overhead_camera import CameraModel, OverheadDetector
from snakewalk.controller.cameras.pose_fit import fit_both_ends
from snakewalk.controller.cameras.pose_tracking import BodyPrior, TrackedPose
from snakewalk.controller.images.compression import compression_of, without_blocks
from snakewalk.controller.kinematics.links import body_in_world, pose_at
from snakewalk.drivers.types import BodyPose
from tests.oracles.overhead_scene import DrawnView
from tests.oracles.view_effects import Effect, View, bands, cloth, hand, jpeg, sensed, shadow

ROBOT = load_robot("yaw16")
CAMERA = CameraConfig(width_px=320, height_px=240, field_width_m=3.0, height_m=3.0)
MODEL = CameraModel.straight_down(CAMERA, (0.0, 0.0))
DRAWN = DrawnView(ROBOT, MODEL, (CAMERA.width_px, CAMERA.height_px))
DETECTOR = OverheadDetector(MODEL, DRAWN.empty_floor(), ROBOT.body_radius_m, CAMERA.shade)
POSES = 8


def poses(seed: int) -> Iterator[tuple[BodyPose, Floats, Image, np.random.Generator]]:
    """Poses in the middle of the view, with their joint angles and frames."""
    for k in range(POSES):
        chance = np.random.default_rng((seed, k))
        bend = chance.uniform(0.2, 0.5) * np.sin(
            chance.uniform(0.0, 6.3) + chance.uniform(0.4, 0.8) * np.arange(ROBOT.joint_count)
        )
        heading = float(chance.uniform(-3.1, 3.1))
        back = 0.5 * ROBOT.length_m * np.array([np.cos(heading), np.sin(heading)])
        pose = pose_at(chance.uniform((-0.6, -0.3), (0.6, 0.3)) + back, heading)
        yield pose, bend, DRAWN.picture(pose, bend, k + 1), chance


def expected(pose: BodyPose, bend: Floats, chance: np.random.Generator) -> BodyPrior:
    """A place that is up to 40 mm off each way, and 0.1 rad."""
    head = pose.head_in_world_m[:2] + chance.uniform(-0.04, 0.04, 2)
    body = body_in_world(ROBOT, pose_at(head, pose.heading_rad + chance.uniform(-0.1, 0.1)), bend)
    return BodyPrior(body.link_m[:, :2], body.forward[:, :2])


def off(pose: BodyPose, head_m: Floats, heading_rad: float) -> Floats:
    """(3,) distance of a pose from the truth."""
    turn = heading_rad - pose.heading_rad
    turn = float(np.arctan2(np.sin(turn), np.cos(turn)))
    return np.append(head_m - pose.head_in_world_m[:2], turn)


def tracked(effect: Effect, seed: int) -> list[tuple[Floats, TrackedPose]]:
    """Errors (3,) and results of the poses under a disturbance."""
    results = []
    for pose, bend, frame, chance in poses(seed):
        image = sensed(effect(View.of(ROBOT, MODEL, pose, bend, frame), chance))
        found = DETECTOR.track(image, 0.0, expected(pose, bend, chance), ROBOT)
        results.append((off(pose, found.head_m, found.heading_rad), found))
    return results


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize(
    "effect",
    [shadow(0.2), cloth, hand, bands(0.6, hard=True), jpeg(20)],
    ids=["shadow", "cloth", "hand", "bands", "jpeg"],
)
def test_a_pose_in_a_hard_view_is_used_and_right(effect: Effect) -> None:
    results = tracked(effect, 5)
    used = [np.hypot(*error[:2]) for error, found in results if not found.fault]
    assert len(used) >= POSES - 1
    assert max(used) < 0.01


def test_the_truth_lies_within_two_standard_deviations() -> None:
    """In about 95 % of the coordinates of disturbed poses."""
    within = []
    for effect in (cloth, jpeg(30)):
        for error, found in tracked(effect, 6):
            if not found.fault:
                within += list(np.abs(error) < 2.0 * np.sqrt(np.diag(found.covariance)))
    assert np.mean(within) >= 0.9
    assert len(within) > 3 * 2 * (POSES - 2)


def test_a_hidden_part_makes_a_pose_less_certain() -> None:
    plain, covered = (tracked(effect, 7) for effect in (lambda view, chance: view.frame, cloth))
    assert np.mean([found.sigma_m for _, found in covered]) > np.mean(
        [found.sigma_m for _, found in plain]
    )
    assert max(found.sigma_m for _, found in plain) < 0.01


def test_a_line_gives_a_pose_with_its_uncertainty() -> None:
    within = []
    for pose, bend, frame, _ in poses(8):
        fits = fit_both_ends(ROBOT, DETECTOR.detect(frame, 0.0).line_m, bend)
        errors = [off(pose, fit.head_m, fit.heading_rad) for fit in fits]
        best = int(np.argmin([np.hypot(*error[:2]) for error in errors]))
        within += list(np.abs(errors[best]) < 2.0 * np.sqrt(np.diag(fits[best].covariance)))
    assert np.mean(within) > 0.85


def test_a_colourless_body_beside_a_hard_shadow_is_not_used_wrongly() -> None:
    """A grey body has no colour by which it differs from a shadow: right, or rejected."""
    floor = cv2.cvtColor(DETECTOR.background, cv2.COLOR_BGR2GRAY)
    detector = replace(DETECTOR, background=np.dstack([floor] * 3))
    errors = []
    for pose, bend, frame, chance in poses(9):
        grey = np.dstack([cv2.cvtColor(frame, cv2.COLOR_BGR2GRAY)] * 3)
        image = sensed(shadow(0.2)(View.of(ROBOT, MODEL, pose, bend, grey), chance))
        found = detector.track(image, 0.0, expected(pose, bend, chance), ROBOT)
        if not found.fault:
            errors.append(float(np.hypot(*off(pose, found.head_m, found.heading_rad)[:2])))
    assert max(errors, default=0.0) < 0.01


def test_bands_of_rows_are_light_and_smooth_light_is_not_a_band() -> None:
    floor = np.random.default_rng(1).integers(100, 160, (120, 160, 3)).astype(np.uint8)
    light = np.where(np.arange(120) // 20 % 2, 0.5, 1.0)[:, None, None]
    banded = np.asarray(np.rint(floor * light), np.uint8)
    np.testing.assert_allclose(banded_floor(banded, floor), banded, atol=2)
    gradient = np.linspace(0.7, 1.3, 120)[:, None, None]
    smooth = np.asarray(np.rint(floor * gradient), np.uint8)
    assert banded_floor(smooth, floor) is floor


@pytest.mark.parametrize("quality", [5, 10, 20, 50])
def test_compression_is_noticed_even_if_most_blocks_have_one_level(quality: int) -> None:
    floor = np.full((240, 320, 3), 140.0)
    floor += np.random.default_rng(3).normal(0.0, 3.0, floor.shape)
    floor[60:75, 40:240] = 60.0
    coded = cv2.imencode(".jpg", sensed(floor), [cv2.IMWRITE_JPEG_QUALITY, quality])[1]
    assert compression_of(np.asarray(cv2.imdecode(coded, cv2.IMREAD_COLOR))) is not None
    assert compression_of(sensed(floor)) is None


def test_a_frame_without_noise_is_not_taken_for_a_compressed_one() -> None:
    x, y = np.meshgrid(np.arange(320.0), np.arange(240.0))
    ramp = np.floor(100.0 + 0.11 * x + 0.07 * y)
    assert compression_of(sensed(np.dstack([ramp] * 3))) is None


@pytest.mark.parametrize("quality", [5, 10, 15, 20, 30])
def test_a_compressed_frame_shows_its_quality_and_is_closer_without_blocks(quality: int) -> None:
    pose, bend, frame, chance = next(poses(11))
    view = View.of(ROBOT, MODEL, pose, bend, frame)
    coded = sensed(jpeg(quality)(view, chance))
    found = compression_of(coded)
    assert found is not None
    assert found.quality == quality
    smooth = without_blocks(coded, found)
    near = np.full(frame.shape[:2], 255, np.uint8)
    cv2.polylines(near, [np.rint(view.axis_px).astype(np.int32)], False, 0)
    close = cv2.distanceTransform(near, cv2.DIST_L2, 5) < 12.0
    before, after = (
        float(np.square(one[close].astype(float) - frame[close]).mean()) for one in (coded, smooth)
    )
    assert after < 0.97 * before


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("quality", [8, 10, 14, 18])
def test_no_pose_of_a_strongly_compressed_frame_is_used_and_wrong(quality: int) -> None:
    """Rejected frames state the compression, its quality and the remedy."""
    results = tracked(jpeg(quality), 12)
    used = [np.hypot(*error[:2]) for error, found in results if not found.fault]
    assert max(used, default=0.0) < 0.01
    faults = [found.fault for _, found in results if found.fault]
    assert all(f"JPEG quality about {quality}); set the camera's" in one for one in faults)
    assert quality > 16 or len(faults) == POSES
