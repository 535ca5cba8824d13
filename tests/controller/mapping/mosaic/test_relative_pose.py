"""Matches over scale and the pose that they give, against known truth."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from scipy.ndimage import gaussian_filter
from scipy.spatial.transform import Rotation

from snakewalk.config.errors import InputError
from snakewalk.controller.mapping.elevation_choice import CalibrationChoice
from snakewalk.controller.mapping.mosaic.local_model import LocalModel, project
from snakewalk.controller.mapping.mosaic.relative_pose import (
    RelativePose,
    best_start,
    estimated_motion,
    matches_around,
    pose_error,
    relative_pose,
)
from snakewalk.controller.mapping.mosaic.scale_matches import (
    SCALES,
    ScaleMatches,
    match_over_scale,
    reduced,
)
from snakewalk.controller.mapping.stereo_camera import read_calibration, read_pair
from tests.oracles.ravine import write_positions
from tests.oracles.textured_yard import Yard

K = np.array([[200.0, 0.0, 119.5], [0.0, 200.0, 89.5], [0.0, 0.0, 1.0]])


def wall(size: tuple[int, int] = (180, 240), depth_m: float = 2.0) -> LocalModel:
    """A wall across the view, with a grain of several sizes."""
    rng = np.random.default_rng(1)
    grain = sum(gaussian_filter(rng.normal(size=size), s) * s for s in (1.2, 4.0))
    image = np.clip(128 + 60 * grain / grain.std(), 0, 255).astype(np.uint8)
    u, v = np.meshgrid(np.arange(size[1]), np.arange(size[0]))
    points = np.stack([(u - K[0, 2]) / 200, (v - K[1, 2]) / 200, np.ones(size)], -1) * depth_m
    return LocalModel(points, np.repeat(image[..., None], 3, axis=2), K, 0.1)


def nearer(model: LocalModel, ahead_m: float) -> LocalModel:
    """The wall from ``ahead_m`` farther forward."""
    depth_m = float(model.points_m[0, 0, 2])
    scale = depth_m / (depth_m - ahead_m)
    grow = np.array([[scale, 0.0, (1 - scale) * K[0, 2]], [0.0, scale, (1 - scale) * K[1, 2]]])
    image = cv2.warpAffine(model.image, grow, model.image.shape[1::-1], flags=cv2.INTER_CUBIC)
    return LocalModel(model.points_m / scale, image, K, 0.1)


def test_the_scales_are_those_of_the_paper() -> None:
    assert pytest.approx([1 / (1 - 0.1 * k) for k in range(10)]) == SCALES


def test_a_reduced_picture_has_its_pixels_where_they_belong() -> None:
    v, u = np.mgrid[:60, :90].astype(np.float32)
    for scale in (1.25, 2.0, 3.0):
        small = reduced(3 * u + 2 * v, scale)
        rows, columns = np.mgrid[: small.shape[0], : small.shape[1]]
        inside = (slice(5, -6), slice(5, -6))
        np.testing.assert_allclose(
            small[inside], scale * (3 * columns + 2 * rows)[inside], atol=0.3
        )


@pytest.mark.slow
def test_matches_over_scale_find_what_one_scale_does_not() -> None:
    """Fig. 3: from 2.0 m to 0.9 m the wall grows by 2.2."""
    far = wall()
    near = nearer(far, 1.1)
    found = match_over_scale(far, near)
    truth = (found.first_px - K[:2, 2]) * (2.0 / 0.9) + K[:2, 2]
    exact = np.linalg.norm(found.second_px - truth, axis=1) < 3.0
    shown = ((truth > 20.0) & (truth < np.array([220.0, 160.0]))).all(axis=1)
    assert exact.sum() > 20
    assert exact[shown].mean() > 0.9
    assert np.median(np.abs(np.log(found.scale[exact] / (2.0 / 0.9)))) < 0.12
    alone = match_over_scale(far, near, (1.0,))
    truth = (alone.first_px - K[:2, 2]) * (2.0 / 0.9) + K[:2, 2]
    assert (np.linalg.norm(alone.second_px - truth, axis=1) < 3.0).sum() < 0.1 * exact.sum()
    pose = relative_pose(far, near, found)
    assert -pose.rotation.T @ pose.translation_m == pytest.approx([0, 0, 1.1], abs=0.02)


@pytest.mark.costs("matches whole images")
def test_the_pose_survives_matches_that_are_wrong() -> None:
    model = wall()
    rng = np.random.default_rng(3)
    depth = 1.5 + rng.uniform(0.0, 1.5, model.valid.shape)
    model = LocalModel(model.points_m / 2.0 * depth[..., None], model.image, K, 0.1)
    turn = Rotation.from_rotvec([0.02, -0.08, 0.01]).as_matrix()
    shift = np.array([0.05, -0.02, -0.6])
    places = rng.integers([5, 5], [235, 175], (100, 2))
    seen = project(K, model.points_m[places[:, 1], places[:, 0]] @ turn.T + shift)
    seen[:40] += rng.uniform(20, 60, (40, 2))
    ones = np.ones(100)
    pose = relative_pose(model, model, ScaleMatches(places.astype(float), seen, ones))
    assert pose.inliers.sum() == 60
    assert not pose.inliers[:40].any()
    first = np.eye(3, 4)
    second = np.column_stack([turn.T, -turn.T @ shift])
    place_m, angle_rad = pose_error(pose, first, second)
    assert place_m < 1e-6
    assert angle_rad < 1e-6
    off = RelativePose(turn, shift + turn @ [0.0, 0.003, 0.004], pose.inliers)
    assert pose_error(off, first, second)[0] == pytest.approx(0.005)
    assert pose.back(pose.moved(model.points_m)) == pytest.approx(model.points_m)
    wrong = rng.uniform(0, 170, (60, 2))
    few = ScaleMatches(places[:60].astype(float), wrong, ones[:60])
    with pytest.raises(InputError, match="matches agree on a relative pose"):
        relative_pose(model, model, few)


@pytest.mark.costs("matches whole images")
def test_matches_around_a_motion_are_exact_and_need_no_distance() -> None:
    """The motion is 20 mm off; the patches of the second picture are 1.43 times as large."""
    far = wall()
    near = nearer(far, 0.6)
    off = np.column_stack([Rotation.from_rotvec([0, 0.01, 0]).as_matrix(), [0.0, 0.0, -0.58]])
    around = matches_around(far, near, off, 8)
    truth = (around.first_px - K[:2, 2]) * (2.0 / 1.4) + K[:2, 2]
    assert len(around.scale) > 60
    assert np.median(np.linalg.norm(around.second_px - truth, axis=1)) < 0.2
    motion, matches = estimated_motion(far, near)
    assert len(matches.scale) > 60
    assert motion[:, 3] == pytest.approx([0.0, 0.0, -0.6], abs=0.004)
    assert motion[:, :3] == pytest.approx(np.eye(3), abs=0.004)


@pytest.mark.costs("matches whole images")
def test_a_picture_that_repeats_itself_is_rejected_without_a_distance() -> None:
    """A period is 60 px, 0.6 m: half of the matches are right, half are one period off."""
    model = wall()
    image = np.ascontiguousarray(np.tile(model.image[:, :60], (1, 4, 1)))
    repeated = LocalModel(model.points_m, image, K, 0.1)
    places = np.random.default_rng(4).integers([70, 10], [170, 170], (80, 2)).astype(float)
    seen = places + np.repeat([[0.0, 0.0], [60.0, 0.0]], 40, axis=0)
    matches = ScaleMatches(places, seen, np.ones(80))
    with pytest.raises(InputError, match="they agree on distances of 0"):
        best_start(repeated, repeated, matches)
    found = best_start(repeated, repeated, matches, distance_m=0.5)
    assert found is not None
    assert found[0][:, 3] == pytest.approx([0.6, 0.0, 0.0], abs=0.01)


@pytest.mark.slow
def test_matches_that_do_not_agree_make_no_second_distance(tmp_path: Path) -> None:
    """Around 0.47 m four fifths as many points of this wall match, but half of them disagree."""
    yard = Yard.quarry(52)
    stations = yard.stations(2)
    file = write_positions(tmp_path, yard, stations, yard.pairs(stations), yard.distortion)
    calibration = read_calibration(tmp_path / "calib.json", CalibrationChoice(unit="m"))
    models = []
    for k in range(2):
        left, right = (file.parent / f"{k}-{side}.png" for side in ("left", "right"))
        models.append(LocalModel.of_pair(read_pair(calibration, left, right), 128))
    motion, _ = estimated_motion(*models)
    true_m = np.linalg.norm(stations[1].at_m - stations[0].at_m)
    assert np.linalg.norm(motion[:, 3]) == pytest.approx(true_m, rel=0.01)
