"""The file of a lens: what is written is read, and each fault is named."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.cameras.lens import Lens, projected

MATRIX = np.array([[610.0, 0.0, 320.0], [0.0, 600.0, 240.0], [0.0, 0.0, 1.0]])
DISTORTION = np.array([-0.2, 0.05, 1e-3, -1e-3, 0.01])


def stored(file: Path, matrix: Floats, size_px: tuple[int, int] | None = (640, 480)) -> Path:
    store = cv2.FileStorage(str(file), cv2.FILE_STORAGE_WRITE)
    if size_px is not None:
        store.write("image_width", size_px[0])
        store.write("image_height", size_px[1])
    store.write("camera_matrix", matrix)
    store.write("distortion_coefficients", DISTORTION)
    store.release()
    return file


@pytest.mark.parametrize("ending", ["yml", "xml", "json"])
def test_a_lens_is_read_as_it_was_written(ending: str, tmp_path: Path) -> None:
    file = tmp_path / f"lens.{ending}"
    Lens((640, 480), MATRIX, DISTORTION).write(file, 0.2, 12)
    lens = Lens.read(file)
    assert lens.size_px == (640, 480)
    np.testing.assert_allclose(lens.matrix, MATRIX)
    np.testing.assert_allclose(lens.distortion, DISTORTION)


def test_a_centre_beside_the_picture_is_one_of_a_lens(tmp_path: Path) -> None:
    aside = MATRIX - [[0.0, 0.0, 500.0], [0.0] * 3, [0.0] * 3]
    assert Lens.read(stored(tmp_path / "lens.yml", aside)).matrix[0, 2] == -180.0


@pytest.mark.parametrize(
    ("matrix", "size_px", "fault"),
    [
        (np.diag([-610.0, 600.0, 1.0]), (640, 480), "no focal length above 0"),
        (np.diag([610.0, -600.0, 1.0]), (640, 480), "no focal length above 0"),
        (np.array([[0.0, 9.0, 0.0], [9.0, 9.0, 0.0], [0.0, 0.0, 1.0]]), (640, 480), "no focal"),
        (np.diag([610.0, 600.0, 0.0]), (640, 480), "no focal length above 0"),
        (np.eye(2), (640, 480), "camera_matrix is not 3 x 3 numbers"),
        (MATRIX, None, "image_width and image_height are needed"),
        (MATRIX, (640, 0), "image_width and image_height are needed"),
    ],
)
def test_a_file_without_a_lens_is_rejected(
    matrix: Floats, size_px: tuple[int, int] | None, fault: str, tmp_path: Path
) -> None:
    file = stored(tmp_path / "lens.yml", matrix, size_px)
    with pytest.raises(InputError, match=fault) as rejected:
        Lens.read(file)
    assert len(rejected.value.faults) == 1


def test_a_homography_moves_points_as_opencv_does() -> None:
    homography = np.array([[0.9, 0.2, 5.0], [-0.1, 1.1, 7.0], [1e-3, -2e-3, 1.0]])
    points = np.array([[0.0, 0.0], [10.0, 5.0], [-20.0, 40.0]])
    expected = cv2.perspectiveTransform(points[None], homography)[0]
    np.testing.assert_allclose(projected(homography, points), expected, rtol=1e-12)


def test_distortion_and_its_inverse_lead_back() -> None:
    lens = Lens((640, 480), MATRIX, DISTORTION)
    points = np.array([[320.0, 240.0], [100.0, 60.0], [600.0, 470.0]])
    away = lens.distorted(points)
    np.testing.assert_allclose(away[0], points[0], atol=1e-9)
    assert np.hypot(*(away - points)[1:].T).min() > 1.0
    np.testing.assert_allclose(lens.undistorted(away), points, atol=1e-4)
