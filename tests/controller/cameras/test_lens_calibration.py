"""Boards warped through a known lens: the corners, the lens, its file, and what is refused."""

import json
from pathlib import Path
from typing import get_args

import cv2
import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.controller.cameras.calibration_board import BoardPattern, BoardView, CalibrationBoard
from snakewalk.controller.cameras.lens import Lens
from snakewalk.controller.cameras.lens_calibration import LensCalibration, calibrate_lens
from tests.oracles.board_view import board_picture, board_pictures, lens_rays

MATRIX = np.array([[420.0, 0.0, 325.0], [0.0, 424.0, 236.0], [0.0, 0.0, 1.0]])
LENS = Lens((640, 480), MATRIX, np.array([-0.3, 0.09, 0.001, -0.0008, 0.0]))
BOARD = CalibrationBoard("charuco")
RAYS = lens_rays(LENS)


@pytest.fixture(scope="module", params=get_args(BoardPattern))
def found(request: pytest.FixtureRequest) -> LensCalibration:
    board = CalibrationBoard(request.param)
    views = [board.find(one) for one in board_pictures(board, LENS, 12, rays=RAYS)]
    views += [None, board.find(np.full((480, 640), 128, np.uint8))]
    return calibrate_lens(views, LENS.size_px)


def test_the_lens_is_found_within_its_own_errors(found: LensCalibration) -> None:
    assert found.rms_px < 0.25
    apart = found.lens.matrix - LENS.matrix
    assert np.abs(apart[[0, 1], [0, 1]]).max() < 4.0 * found.focal_error_px < 4.0
    assert np.abs(apart[:2, 2]).max() < 4.0 * found.centre_error_px < 4.0
    u, v = np.meshgrid(np.linspace(40.0, 600.0, 15), np.linspace(30.0, 450.0, 11))
    there = np.stack([u, v], axis=-1)
    focal, middle = LENS.matrix[[0, 1], [0, 1]], LENS.matrix[:2, 2]
    slopes = [
        (one.undistorted(there) - one.matrix[:2, 2]) / one.matrix[[0, 1], [0, 1]]
        for one in (found.lens, LENS)
    ]
    off = focal * (slopes[0] - slopes[1])
    off -= off.mean(axis=(0, 1))  # a centre that is off is a camera that is turned
    assert np.sqrt(np.mean(off**2)) < 0.5, "pixels, over nearly all of the picture"
    assert np.abs(LENS.undistorted(there) - middle).max() > 290.0
    assert np.isnan(found.view_rms_px[-2:]).all()


def test_distortion_and_its_inverse_agree() -> None:
    u, v = np.meshgrid(np.linspace(0.0, 639.0, 9), np.linspace(0.0, 479.0, 7))
    there = np.stack([u, v], axis=-1)
    back = LENS.distorted(LENS.undistorted(there))
    np.testing.assert_allclose(back, there, atol=1e-4)
    assert np.abs(LENS.undistorted(there) - there).max() > 20.0


def test_the_file_holds_what_was_written(found: LensCalibration, tmp_path: Path) -> None:
    file = tmp_path / "lens.yml"
    found.lens.write(file, found.rms_px, 16)
    back = Lens.read(file)
    np.testing.assert_array_equal(back.matrix, found.lens.matrix)
    np.testing.assert_array_equal(back.distortion, found.lens.distortion)
    assert back.size_px == (640, 480)


def test_a_view_of_another_board_is_left_out() -> None:
    """Squares of another size in one picture: its residual stands out."""
    views = [BOARD.find(one) for one in board_pictures(BOARD, LENS, 8, rays=RAYS)]
    wrong = views[4]
    assert wrong is not None
    bent = wrong.corners_px + 6.0 * np.sin(wrong.corners_px / 40.0)
    views[4] = type(wrong)(bent, wrong.corners_m)
    found = calibrate_lens(views, LENS.size_px)
    assert np.flatnonzero(np.isnan(found.view_rms_px)).tolist() == [4]
    assert found.rms_px < 0.25


def test_a_board_that_is_never_tilted_is_remarked() -> None:
    views = []
    for k in range(6):
        place = np.array([0.02 * k - 0.07, 0.03 * (k % 3) - 0.03, 0.35])
        views.append(BOARD.find(board_picture(BOARD, LENS, np.zeros(3), place, seed=k, rays=RAYS)))
    remarks = " ".join(calibrate_lens(views, LENS.size_px).remarks)
    assert "never tilted" in remarks
    assert "hold the board into its corners" in remarks


def test_too_few_views_are_refused() -> None:
    views = [BOARD.find(one) for one in board_pictures(BOARD, LENS, 3, rays=RAYS)]
    with pytest.raises(InputError, match="found in 3 of 5 pictures"):
        calibrate_lens([*views, None, None], LENS.size_px)


@pytest.mark.parametrize("squares", [(3, 9), (6, 6), (21, 8)])
def test_a_board_that_is_none_is_refused(squares: tuple[int, int]) -> None:
    with pytest.raises(InputError, match="squares"):
        CalibrationBoard("charuco", squares)


@pytest.mark.parametrize(
    ("content", "line"),
    [
        ("nonsense", "FileStorage"),
        ("%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\n", "holds no camera_matrix"),
    ],
)
def test_a_file_that_is_no_lens_is_refused(content: str, line: str, tmp_path: Path) -> None:
    file = tmp_path / "lens.yml"
    file.write_text(content)
    with pytest.raises(InputError, match=line):
        Lens.read(file)


def test_plain_lists_of_json_are_read(tmp_path: Path) -> None:
    file = tmp_path / "lens.json"
    lens = {
        "image_width": 640,
        "image_height": 480,
        "camera_matrix": [[500.0, 0.0, 320.0], [0.0, 500.0, 240.0], [0.0, 0.0, 1.0]],
        "distortion_coefficients": [0.1, 0.0, 0.0, 0.0, 0.0],
    }
    file.write_text(json.dumps(lens))
    found = Lens.read(file)
    assert found.size_px == (640, 480)
    np.testing.assert_array_equal(found.matrix, lens["camera_matrix"])
    np.testing.assert_array_equal(found.distortion, lens["distortion_coefficients"])
    file.write_text(json.dumps(lens | {"camera_matrix": np.ravel(lens["camera_matrix"]).tolist()}))
    np.testing.assert_array_equal(Lens.read(file).matrix, found.matrix)
    for wrong in ("abc", [1.0, 2.0], {"a": 1}):
        file.write_text(json.dumps(lens | {"camera_matrix": wrong}))
        with pytest.raises(InputError, match="camera_matrix is not 3 x 3 numbers"):
            Lens.read(file)
    file.write_text(json.dumps(lens | {"image_width": [640, 480]}))
    with pytest.raises(InputError, match="image_width and image_height are needed"):
        Lens.read(file)


def test_numbers_that_are_no_lens_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "lens.yml"
    Lens((640, 480), -MATRIX, np.zeros(3)).write(file, 0.1, 9)
    with pytest.raises(InputError) as refused:
        Lens.read(file)
    assert len(refused.value.faults) == 2


def test_the_printed_board_has_its_size() -> None:
    picture = BOARD.picture(300.0)
    np.testing.assert_allclose(
        np.array(picture.shape[::-1]) / 300.0 * 0.0254, BOARD.size_m, rtol=2e-3
    )
    assert BOARD.find(cv2.copyMakeBorder(picture, 40, 40, 40, 40, 0, value=255)) is not None


def test_coverage_and_tilt_are_those_of_the_views() -> None:
    """Corners by projection, without pictures: the part of the picture, and the largest angle."""
    x, y = np.meshgrid(np.arange(7) * 0.02 - 0.06, np.arange(5) * 0.02 - 0.04)
    corners_m = np.column_stack([x.ravel(), y.ravel()])
    solid = np.column_stack([corners_m, np.zeros(len(corners_m))])
    views = []
    for tilt_deg, about in ((0.0, 0), (20.0, 0), (35.0, 1), (15.0, 1), (25.0, 0), (10.0, 1)):
        turn = np.zeros(3)
        turn[about] = np.radians(tilt_deg)
        place = np.array([0.01 * len(views) - 0.03, 0.0, 0.4])
        seen, _ = cv2.projectPoints(solid, turn, place, MATRIX, LENS.distortion)
        views.append(BoardView(seen.reshape(-1, 2), corners_m))
    found = calibrate_lens(views, LENS.size_px)
    cells = {(int(6 * u / 640.0), int(6 * v / 480.0)) for view in views for u, v in view.corners_px}
    assert found.coverage == pytest.approx(len(cells) / 36.0)
    assert found.tilt_deg == pytest.approx(35.0, abs=0.5)
    assert found.rms_px < 0.01
