"""Pixels to floor and back: closed forms, corners, parallax."""

import numpy as np
import pytest
from pydantic import ValidationError

from snakewalk.config.camera import CameraConfig
from snakewalk.config.errors import InputError
from snakewalk.controller.cameras.lens import Lens
from snakewalk.controller.cameras.overhead_camera import CameraModel


def test_the_middle_of_the_image_is_the_floor_below_the_lens() -> None:
    model = CameraModel.straight_down(CameraConfig(turn_rad=0.7), (1.5, -2.0))
    for z_m in (0.0, 0.03, 1.0):
        np.testing.assert_allclose(model.on_plane(np.array([319.5, 239.5]), z_m), (1.5, -2.0))


def test_a_pixel_is_the_field_over_the_width_and_the_image_s_y_runs_down() -> None:
    model = CameraModel.straight_down(CameraConfig(field_width_m=6.4), (0.0, 0.0))
    np.testing.assert_allclose(model.on_plane(np.array([419.5, 139.5]), 0.0), (1.0, 1.0))
    turned = CameraModel.straight_down(
        CameraConfig(field_width_m=6.4, turn_rad=np.pi / 2), (0.0, 0.0)
    )
    np.testing.assert_allclose(turned.on_plane(np.array([419.5, 139.5]), 0.0), (-1.0, 1.0))


def test_a_point_above_the_floor_is_seen_too_far_out_and_brought_back() -> None:
    """A pinhole at (0, 0, 4): a point at height 1 and x = 1.5 covers the floor at 1.5 * 4 / 3."""
    camera = CameraConfig(height_m=4.0, field_width_m=6.4)
    model = CameraModel.straight_down(camera, (0.0, 0.0))
    px = model.in_image(np.array([1.5, 0.0]), 1.0)
    np.testing.assert_allclose(model.on_plane(px, 0.0), (2.0, 0.0), atol=1e-12)
    np.testing.assert_allclose(model.on_plane(px, 1.0), (1.5, 0.0), atol=1e-12)


def test_a_lens_that_distorts_is_undone_with_corners_and_without() -> None:
    """Where the pinhole without distortion is known, the distorted picture means the same."""
    config = CameraConfig(height_m=4.0, field_width_m=6.4)
    plain = CameraModel.straight_down(config, (0.3, 0.1))
    matrix = np.array([[400.0, 0.0, 319.5], [0.0, 400.0, 239.5], [0.0, 0.0, 1.0]])
    lens = Lens((640, 480), matrix, np.array([-0.3, 0.08, 0.0, 0.0, 0.0]))
    bent = CameraModel.straight_down(config, (0.3, 0.1), lens)
    places = np.array([[0.3, 0.1], [2.4, 1.5], [-1.9, -1.6]])
    px = bent.in_image(places, 0.03)
    assert np.hypot(*(px - plain.in_image(places, 0.03)).T)[1:].min() > 10.0
    np.testing.assert_allclose(bent.on_plane(px, 0.03), places, atol=1e-6)
    corners = ((-1.0, -1.0), (2.0, -1.0), (2.0, 1.5), (-1.0, 1.5))
    seen = tuple((float(x), float(y)) for x, y in bent.in_image(np.array(corners), 0.0))
    given = config.model_copy(update={"corners_m": corners, "corners_px": seen})
    found = CameraModel.from_corners(given, (0.3, 0.1), lens)
    np.testing.assert_allclose(found.on_plane(px, 0.03), places, atol=1e-4)


@pytest.mark.parametrize("z_m", [0.0, 0.03])
def test_four_corners_undo_a_camera_that_looks_aslant(z_m: float) -> None:
    """A pinhole off to the side, tilted by 0.5 rad: projected here by hand, in three dimensions."""
    lens = np.array([0.5, -2.5, 5.0])
    tilt = 0.5
    right = np.array([1.0, 0.0, 0.0])
    ahead = np.array([0.0, np.sin(tilt), -np.cos(tilt)])
    down = np.cross(ahead, right)

    def seen(place: np.ndarray) -> np.ndarray:
        ray = place - lens
        return 319.5 + 600.0 * ray @ right / (ray @ ahead), 239.5 + 600.0 * ray @ down / (
            ray @ ahead
        )

    corners = ((-1.0, -1.0), (2.0, -1.0), (2.0, 1.5), (-1.0, 1.5))
    camera = CameraConfig(
        height_m=5.0,
        corners_m=corners,
        corners_px=tuple(seen(np.array([*corner, 0.0])) for corner in corners),
    )
    model = CameraModel.from_corners(camera, (0.5, -2.5))
    for x, y in ((0.0, 0.0), (1.7, 1.2), (-0.8, 0.9)):
        px = np.array(seen(np.array([x, y, z_m])))
        np.testing.assert_allclose(model.on_plane(px, z_m), (x, y), atol=1e-4)
        np.testing.assert_allclose(model.in_image(np.array([x, y]), z_m), px, atol=0.02)


def test_corners_on_a_line_are_refused() -> None:
    camera = CameraConfig(
        corners_px=((0, 0), (100, 0), (200, 0), (0, 200)),
        corners_m=((0, 0), (1, 0), (1, 1), (0, 1)),
    )
    with pytest.raises(InputError, match="corners_px: three of the four places lie on a line"):
        CameraModel.from_corners(camera, (0.0, 0.0))


def test_corners_of_one_kind_alone_are_refused() -> None:
    with pytest.raises(ValidationError, match="given together"):
        CameraConfig(corners_px=((0, 0), (1, 0), (1, 1), (0, 1)))


def test_four_corners_without_a_lens_state_the_distortion_of_a_wide_one() -> None:
    """Exact corners in the picture of a distorting lens: the places between them are off."""
    config = CameraConfig(height_m=4.0, field_width_m=6.4)
    matrix = np.array([[400.0, 0.0, 319.5], [0.0, 400.0, 239.5], [0.0, 0.0, 1.0]])
    lens = Lens((640, 480), matrix, np.array([-0.3, 0.08, 0.0, 0.0, 0.0]))
    bent = CameraModel.straight_down(config, (0.3, 0.1), lens)
    corners = ((-2.0, -1.5), (2.5, -1.5), (2.5, 1.7), (-2.0, 1.7))
    seen = tuple((float(x), float(y)) for x, y in bent.in_image(np.array(corners), 0.0))
    given = config.model_copy(update={"corners_m": corners, "corners_px": seen})
    model = CameraModel.from_corners(given, (0.3, 0.1))
    places = np.stack(np.meshgrid(np.linspace(-2.0, 2.5), np.linspace(-1.5, 1.7)), axis=-1)
    off_m = np.linalg.norm(model.on_plane(bent.in_image(places, 0.0), 0.0) - places, axis=-1).max()
    assert off_m > 0.1
    assert model.distortion is not None
    assert off_m < 2.0 * np.sqrt(model.distortion.covariance[0, 0])
    assert "four corners" in str(model.distortion)
    assert CameraModel.from_corners(given, (0.3, 0.1), lens).distortion is None
