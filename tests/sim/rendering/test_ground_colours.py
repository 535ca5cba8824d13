"""Colours of a map lie on the ground where the map has them."""

import numpy as np
import pytest

from snakewalk.config.camera import CameraConfig
from snakewalk.config.heightfield import HeightField
from snakewalk.config.loader import load_robot, load_world
from snakewalk.sim.rendering.top_view import TopView

CAMERA = CameraConfig(width_px=200, height_px=200, field_width_m=4.0, height_m=6.0)


def seen_from_above(ground: HeightField, x_m: float, y_m: float) -> list[int]:
    """Return the colour of a picture at a place; its right is +x, its top +y."""
    view = TopView(
        load_robot("yaw16"), load_world("jacksboro-basin"), CAMERA, (0.0, 0.0), 0, (), ground
    )
    try:
        picture = view.picture(np.array([50.0, 50.0, 0.0, 1.0] + [0.0] * 19))
    finally:
        view.close()
    return [int(each) for each in picture[round(100 - 50 * y_m), round(100 + 50 * x_m)]]


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize(
    ("x_m", "y_m", "channel"), [(-1.0, -1.0, 0), (1.0, -1.0, 1), (-1.0, 1.0, 2)]
)
def test_a_colour_is_drawn_at_its_place(x_m: float, y_m: float, channel: int) -> None:
    """Colours and contour lines were mirrored in y: row 0 of a texture has the largest y."""
    colour = np.zeros((41, 41, 3), np.uint8)
    colour[:20, :20, 0] = colour[:20, 20:, 1] = colour[20:, :20, 2] = 220
    ground = HeightField(np.zeros((41, 41)), 0.1, -2.0, -2.0, colour=colour)
    seen = seen_from_above(ground, x_m, y_m)
    assert int(np.argmax(seen)) == channel
    assert seen[channel] > 100
    assert sum(seen) - seen[channel] < 60


@pytest.mark.slow
def test_high_ground_has_the_colour_of_high_ground() -> None:
    rise = np.linspace(0.0, 0.3, 41)[:, None] * np.ones(41)
    ground = HeightField(rise, 0.1, -2.0, -2.0)
    low, high = (sum(seen_from_above(ground, 0.05, y)) for y in (-1.9, 1.9))
    assert high > low + 30
