"""Distortion of an uncalibrated lens from drawn floors with printed markers."""

import numpy as np
import pytest

from snakewalk.config.arrays import Image
from snakewalk.config.camera import CameraConfig
from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot
from snakewalk.controller.cameras.camera_check import CameraCheck
from snakewalk.controller.cameras.camera_findings import camera_findings
from snakewalk.controller.cameras.lens import Lens
from snakewalk.controller.cameras.markers.floor_markers import find_markers
from snakewalk.controller.cameras.markers.lens_residual import marker_distortion
from snakewalk.controller.cameras.overhead_camera import CameraModel, OverheadDetector
from snakewalk.controller.cameras.pose_tracking import BodyPrior
from snakewalk.controller.kinematics.links import body_in_world, pose_at
from tests.oracles.overhead_scene import DrawnView

ROBOT = load_robot("yaw16")
FIVE = {0: (-1.2, -0.85), 3: (1.2, -0.85), 7: (1.2, 0.85), 12: (-1.2, 0.8), 20: (0.0, 0.8)}
FOUR = {name: FIVE[name] for name in (0, 3, 7, 12)}
POSE, BEND = pose_at(np.array([0.5, 0.15]), 0.4), 0.4 * np.sin(0.3 + 0.6 * np.arange(16))


def camera(width_px: int) -> CameraConfig:
    return CameraConfig(
        width_px=width_px, height_px=width_px * 3 // 4, field_width_m=3.0, height_m=3.0,
        markers_m={str(name): place for name, place in FIVE.items()},
    )  # fmt: skip


def view(
    width_px: int, k1: float, places: dict[int, tuple[float, float]], seed: int = 0
) -> DrawnView:
    """A floor through a lens with k1; the places of its markers were measured to 2 mm."""
    size_px = width_px, width_px * 3 // 4
    plain = CameraModel.straight_down(camera(width_px), (0.0, 0.0))
    lens = Lens(size_px, plain.matrix(size_px), np.array([k1, 0.0, 0.0, 0.0, 0.0]))
    model = CameraModel.straight_down(camera(width_px), (0.0, 0.0), lens)
    chance = np.random.default_rng(seed)
    true = {name: tuple(chance.normal(place, 0.002)) for name, place in places.items()}
    return DrawnView(ROBOT, model, size_px, markers_m=true, seed=seed)


def distortion_of(picture: Image, places: dict[int, tuple[float, float]]) -> float:
    found = marker_distortion(find_markers(picture), places, picture.shape[1::-1], 0.15)
    assert found is not None
    return found.error_m if found.is_certain else 0.0


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("places", [FIVE, FOUR], ids=["five", "four"])
@pytest.mark.parametrize("width_px", [320, 640])
def test_a_sound_lens_gives_no_warning(
    width_px: int, places: dict[int, tuple[float, float]]
) -> None:
    for seed in range(3):
        assert distortion_of(view(width_px, 0.0, places, seed).empty_floor(), places) == 0.0


@pytest.mark.parametrize("width_px", [320, 640])
def test_a_lens_that_distorts_is_reported(width_px: int) -> None:
    assert distortion_of(view(width_px, -0.1, FIVE).empty_floor(), FIVE) > 0.01


def test_a_pose_through_an_uncalibrated_lens_is_less_certain() -> None:
    drawn = view(640, -0.1, FIVE)
    floor = drawn.empty_floor()
    model = CameraModel.from_markers(camera(640), (0.0, 0.0), None, floor)
    assert model.distortion is not None
    assert "snakewalk pose lens" in str(model.distortion)
    body = body_in_world(ROBOT, POSE, BEND)
    prior = BodyPrior(body.link_m[:, :2], body.forward[:, :2])
    detector = OverheadDetector(model, floor, ROBOT.body_radius_m, 0.5)
    found = detector.track(drawn.picture(POSE, BEND), 0.0, prior, ROBOT)
    error_m = found.head_m - POSE.head_in_world_m[:2]
    assert (np.abs(error_m) < 2.0 * np.sqrt(np.diag(found.covariance)[:2])).all()
    assert found.sigma_m > 0.4 * model.distortion.error_m


def test_markers_that_a_strong_lens_misplaces_name_the_calibration() -> None:
    floor = view(640, -0.5, FIVE).empty_floor()
    with pytest.raises(InputError, match="snakewalk pose lens"):
        CameraModel.from_markers(camera(640), (0.0, 0.0), None, floor)


def test_the_check_of_the_camera_reports_the_lens() -> None:
    for k1, remedy in ((0.0, ""), (-0.1, "snakewalk pose lens")):
        check = CameraCheck(camera(640), ROBOT, None)
        check.add_frame(view(640, k1, FIVE).empty_floor(), 0.0)
        findings = camera_findings(check.report(), camera(640), {})
        floor = next(one for one in findings if one.check == "floor")
        assert floor.grade == ("warn" if k1 else "ok")
        assert remedy in floor.remedy
