"""Printed markers: the floor from them, a bumped camera, a marker that was kicked."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from snakewalk.config.arrays import Floats, Image
from snakewalk.config.camera import CameraConfig
from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_world
from snakewalk.controller.cameras.camera_pose import CameraPose
from snakewalk.controller.cameras.lens import Lens
from snakewalk.controller.cameras.markers.floor_markers import (
    Markers,
    find_markers,
    fit_floor,
    picture_move,
)
from snakewalk.controller.cameras.overhead_camera import (
    CameraModel,
    LineDetection,
)
from snakewalk.controller.cameras.pose_tracking import BodyPrior, TrackedPose
from snakewalk.controller.cameras.rendered_camera import floor_prints
from snakewalk.controller.kinematics.links import body_in_world, pose_at
from snakewalk.controller.pose.dead_reckoning import DeadReckoning
from snakewalk.drivers.types import JointState
from snakewalk.sim.rendering.offscreen import OffscreenError
from snakewalk.sim.rendering.top_view import TopView
from tests.oracles.marked_floor import (
    CAMERA,
    DETECTOR,
    FLOOR,
    PLACES,
    ROBOT,
    TRUE,
    VIEW,
)
from tests.oracles.overhead_scene import DrawnView

MODEL = DETECTOR.model
BEND = 0.4 * np.sin(0.3 + 0.6 * np.arange(ROBOT.joint_count))
HEAD = np.array([0.5, 0.15])
PICTURE = VIEW.picture(pose_at(HEAD, 0.4), BEND)
MATRIX = TRUE.matrix((320, 240))


def corners(places: dict[int, tuple[float, float]], side_m: float = 0.15) -> dict[int, Floats]:
    """Where the corners of these markers are, without any picture."""
    half = 0.5 * side_m * np.array([[-1, 1], [1, 1], [1, -1], [-1, -1]])
    return {name: TRUE.in_image(np.array(at) + half, 0.0) for name, at in places.items()}


def turn(pan: float, tilt: float, roll: float) -> Floats:
    rotation, _ = cv2.Rodrigues(np.radians([pan, tilt, roll]))
    return np.asarray(MATRIX @ rotation @ np.linalg.inv(MATRIX))


def moved(seen: Markers, move: Floats) -> dict[int, Floats]:
    return {
        name: np.asarray(cv2.perspectiveTransform(px[:, None], move)[:, 0], dtype=float)
        for name, px in seen.items()
    }


def bumped(picture: Image, move: Floats) -> Image:
    found = cv2.warpPerspective(picture, move, (320, 240), borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(found, dtype=np.uint8)


def prior() -> BodyPrior:
    body = body_in_world(ROBOT, pose_at(HEAD + np.array([0.03, -0.03]), 0.48), BEND)
    return BodyPrior(body.link_m[:, :2], body.forward[:, :2])


@pytest.mark.parametrize(("gain", "noise"), [(1.0, 0.0), (0.65, 0.0), (1.5, 0.0), (1.0, 15.0)])
def test_markers_are_found_to_a_tenth_of_a_pixel_in_any_light(gain: float, noise: float) -> None:
    grey = FLOOR * gain + np.random.default_rng(5).normal(0.0, noise + 1e-9, FLOOR.shape)
    seen = find_markers(np.clip(np.rint(grey), 0.0, 255.0).astype(np.uint8))
    assert set(seen) <= set(PLACES)
    assert len(seen) >= 4
    for name, px in seen.items():
        off = (px - corners(PLACES)[name]).mean(axis=0)
        assert np.abs(off).max() < (0.15 if gain <= 1.0 else 0.3), "bleached white has no edge"


def test_the_floor_of_exact_corners_is_exact() -> None:
    """Closed form; with the camera matrix known the lens's place is told, too."""
    fit = fit_floor(corners(PLACES), PLACES, None)
    np.testing.assert_allclose(fit.floor_from_px, TRUE.floor_from_px, atol=1e-6)
    assert fit.rms_m < 1e-6
    assert fit.side_m == pytest.approx(dict.fromkeys(PLACES, 0.15))
    lens = Lens((320, 240), MATRIX, np.zeros(5))
    fit = fit_floor(corners(PLACES), PLACES, lens)
    assert fit.lens_m == pytest.approx([0.0, 0.0, 3.0], abs=1e-4)
    np.testing.assert_allclose(fit.floor_from_px, TRUE.floor_from_px, atol=1e-5)


def test_a_camera_that_looks_aslant_through_a_lens_is_placed_by_its_markers() -> None:
    """Its height and foot are found, those of the table do not count."""
    lens = Lens((320, 240), MATRIX, np.array([-0.2, 0.02, 0.0, 0.0, 0.0]))
    turned, _ = cv2.Rodrigues(np.radians([180.0 - 20.0, 0.0, 0.0]))
    there = np.array([0.1, -1.0, 3.0])
    px_from_floor = MATRIX @ np.column_stack([turned[:, :2], -turned @ there])
    aslant = CameraModel(np.linalg.inv(px_from_floor), there[:2], 3.0, lens)
    view = DrawnView(ROBOT, aslant, (320, 240), noise=1.0, markers_m=PLACES, marker_side_m=0.22)
    found = CameraModel.from_markers(CAMERA, (9.0, 9.0), lens, view.empty_floor())
    np.testing.assert_allclose([*found.foot_m, found.height_m], there, atol=0.02)
    place = np.array([0.4, 0.3])
    seen = found.on_plane(aslant.in_image(place, 0.03), 0.03)
    np.testing.assert_allclose(seen, place, atol=0.004)


def test_a_place_that_was_measured_wrongly_is_named() -> None:
    wrong = {**(CAMERA.markers_m or {}), "7": (1.3, 0.75)}
    with pytest.raises(InputError, match=r"marker \d+ lies \d+ mm from where it must be"):
        CameraModel.from_markers(
            CAMERA.model_copy(update={"markers_m": wrong}), (0, 0), None, FLOOR
        )


def test_too_few_markers_and_markers_on_a_line_are_refused() -> None:
    three = {name: px for name, px in corners(PLACES).items() if name in (0, 3, 7)}
    with pytest.raises(
        InputError, match=r"3 of 5 markers are seen, 4 are needed; not seen: 12, 20"
    ):
        fit_floor(three, PLACES, None)
    row = {name: (0.3 * k, 0.0) for k, name in enumerate(PLACES)}
    with pytest.raises(InputError, match="lie on a line"):
        fit_floor(corners(row), row, None)


@pytest.mark.parametrize(
    "markers",
    [{"0": (0, 0), "1": (1, 0), "2": (1, 1)}, {"x": (0, 0)}, {"50": (0, 0)}],
)
def test_a_table_of_markers_that_cannot_be_is_refused(markers: dict[str, object]) -> None:
    with pytest.raises(ValueError, match="markers_m"):
        CameraConfig.model_validate({"markers_m": markers})


def test_a_turn_of_the_camera_is_told_exactly() -> None:
    move = turn(0.3, -0.4, 0.8)
    there = corners(PLACES)
    found = picture_move(there, moved(there, move), TRUE.floor_from_px, MATRIX, None)
    assert found is not None
    np.testing.assert_allclose(found.present_from_earlier, move, atol=1e-6)
    assert found.bump.undone
    assert found.bump.turn_rad == pytest.approx(np.radians(0.8), abs=1e-3)
    assert not found.bump.left_out


def test_a_kicked_marker_is_left_out_by_its_number() -> None:
    there = corners(PLACES)
    now = moved(there, turn(0.3, 0.2, 0.0))
    now[7] = now[7] + np.array([6.0, 2.0])
    found = picture_move(there, now, TRUE.floor_from_px, MATRIX, None)
    assert found is not None
    assert found.bump.left_out == (7,)
    assert "marker 7 was moved on the floor" in str(found.bump)
    np.testing.assert_allclose(
        cv2.perspectiveTransform(there[7][:, None], found.present_from_earlier)[:, 0],
        now[7] - [6.0, 2.0], atol=1e-6,
    )  # fmt: skip


def test_two_markers_tell_nothing_and_markers_that_disagree_stop_the_pose() -> None:
    there = corners(PLACES)
    two = {name: there[name] for name in (0, 7)}
    assert picture_move(there, two, TRUE.floor_from_px, MATRIX, None) is None
    away = {name: px + 9.0 * np.array([np.cos(k), np.sin(2.0 * k)])
            for k, (name, px) in enumerate(there.items())}  # fmt: skip
    found = picture_move(there, away, TRUE.floor_from_px, MATRIX, None)
    assert found is not None
    assert not found.bump.undone
    lost = replace(DETECTOR, bump=found.bump).track(PICTURE, 0.0, prior(), ROBOT)
    assert "set the camera up again" in lost.fault


@pytest.mark.parametrize(
    "move", [turn(0.72, 0.0, 0.0), turn(0.0, -0.72, 0.0), turn(0.2, 0.3, 1.0), np.eye(3)],
    ids=["4 px", "4 px down", "turned", "none"],
)  # fmt: skip
def test_a_bumped_camera_goes_on_by_its_markers(move: Floats) -> None:
    """A shift of 4 px is 38 mm on this floor: not undone, the head would be off by as much."""
    image = bumped(PICTURE, move)
    detector = DETECTOR.registered(image)
    still = np.array_equal(move, np.eye(3))
    assert (detector is DETECTOR) == still
    found = detector.track(image, 0.0, prior(), ROBOT)
    assert found.fault == ""
    assert np.hypot(*(found.head_m - HEAD)) < 0.005
    if not still:
        assert found.bump is not None
        assert f"its picture has moved by {found.bump.away_px:.1f} px" in str(found.bump)
        assert detector.registered(image) is detector, "once is enough"
        back = detector.registered(PICTURE).track(PICTURE, 0.0, prior(), ROBOT)
        assert str(back.bump) == "the camera is again where it was set up"
        assert np.hypot(*(back.head_m - HEAD)) < 0.005


class Frames:
    """A camera whose second look comes after a bump."""

    def first(self) -> LineDetection:
        return DETECTOR.detect(PICTURE, 0.0)

    def arrived(self, now_s: float, prior_at: object) -> list[TrackedPose]:
        image = bumped(PICTURE, turn(0.72, 0.0, 0.0))
        return [DETECTOR.registered(image).track(image, now_s, prior(), ROBOT)]


def test_the_run_says_once_that_the_camera_was_bumped() -> None:
    said: list[str] = []
    reckoning = DeadReckoning(ROBOT, load_world("flat").friction, (0.5, 0.15), 0.4)
    camera = CameraPose(ROBOT, Frames(), reckoning, said.append)
    z, byte = np.zeros(ROBOT.joint_count), np.zeros(ROBOT.joint_count, np.uint8)
    for time_s in (0.0, 0.02):
        state = JointState(time_s, BEND, z, z, z, z, byte, byte, z, np.ones(16, bool), z)
        pose = camera(state)
    assert np.hypot(*(pose.head_in_world_m[:2] - HEAD)) < 0.006
    assert said == [
        f"the camera was bumped: its picture has moved by {4.0:.1f} px, which is undone"
    ]


def test_the_simulated_floor_shows_its_markers_where_they_lie() -> None:
    try:
        view = TopView(ROBOT, load_world("flat"), CAMERA, (0.0, 0.0), prints=floor_prints(CAMERA))
    except OffscreenError as error:
        pytest.skip(str(error))
    floor = view.empty_floor()
    view.close()
    model = CameraModel.from_markers(CAMERA, (0.0, 0.0), None, floor)
    px = np.stack(np.meshgrid(np.linspace(20, 300, 5), np.linspace(20, 220, 4)), axis=-1)
    off = np.hypot(*np.moveaxis(model.on_plane(px, 0.0) - TRUE.on_plane(px, 0.0), -1, 0))
    assert off.max() < 0.004
