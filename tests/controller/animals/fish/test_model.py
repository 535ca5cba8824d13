"""The deformable model: length, angles, rigid head, projections."""

import cv2
import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.controller.animals.fish.model import STATIONS, fish_model
from snakewalk.controller.animals.fish.postures import (
    fit_angles,
    midline_angles,
    skeleton,
    tangents,
)
from snakewalk.controller.animals.fish.raster import Window, draw_area, draw_pieces, side_outline

CARP = fish_model("carp", 100.0)
ANGLES = np.array([0.2, -0.3, 0.25, 0.4])


def test_length_stays_and_each_angle_turns_all_that_lies_behind_it() -> None:
    line = CARP.midline(np.array([5.0, -7.0]), 0.4, ANGLES)
    assert np.hypot(*np.diff(line[:, :2], axis=0).T).sum() == pytest.approx(100.0)
    heads = CARP.tangents_rad(0.4, ANGLES)
    assert heads[-1] == pytest.approx(0.4 - ANGLES.sum())
    # [TH]: the head, a fifth of the fish and more, does not bend
    assert np.ptp(heads[: int(0.2 * STATIONS)]) == 0.0


def test_a_positive_angle_turns_the_head_side_to_the_left() -> None:
    bent = CARP.midline(np.zeros(2), 0.0, np.array([0.5, 0.0, 0.0, 0.0]))
    assert bent[0, 0] > 0.0  # the head looks along x
    assert bent[-1, 1] > 10.0  # so the tail lies to its left, behind


def test_base_of_the_head_is_where_it_was_asked_to_be() -> None:
    for pitch in (0.0, 0.3):
        line = CARP.midline(np.array([5.0, -7.0, 2.0]), 0.4, np.zeros(4), pitch)
        at = 2 / 7 * (STATIONS - 1)
        low = int(at)
        base = line[low] * (low + 1 - at) + line[low + 1] * (at - low)
        np.testing.assert_allclose(base, [5.0, -7.0, 2.0], atol=1e-9)
        assert line[0, 2] - 2.0 == pytest.approx(100.0 * 2 / 7 * np.sin(pitch))


@pytest.mark.parametrize("build", ["carp", "eel"])
def test_angles_come_back_from_tangents_and_from_points(build: str) -> None:
    at = fish_model(build).joints_at
    rng = np.random.default_rng(0)
    angles, head = rng.normal(0.0, 0.2, (5, len(at))), rng.normal(0.0, 2.0, 5)
    bodies = tangents(head, angles, at)
    found_head, found = fit_angles(bodies, at)
    np.testing.assert_allclose(found, angles, atol=1e-9)
    np.testing.assert_allclose(found_head, head, atol=1e-9)
    points = skeleton(np.zeros((5, 2)), bodies, at[0], 1.0)
    one, spine = midline_angles(points[0], at)
    np.testing.assert_allclose(spine, angles[0], atol=0.02)
    assert np.cos(one - head[0]) > 0.999


def test_areas_of_both_projections_are_those_of_the_solid() -> None:
    window = Window(0, 0, 240, 160, 1.0)
    canvas = np.zeros(window.shape, dtype=np.uint8)
    line = CARP.midline(np.array([140.0, -80.0, -80.0]), 0.0, np.zeros(4))
    draw_area(canvas, window, CARP.outline(line))
    width = 2.0 * np.trapezoid(CARP.half_width, dx=100.0 / (STATIONS - 1)) * 100.0
    assert canvas.sum() / 255.0 == pytest.approx(width + 0.7 * 200.0, rel=0.04)  # cv2's rim
    draw_pieces(canvas, window, side_outline(CARP, line, 0.0))
    height = 2.0 * np.trapezoid(CARP.half_height, dx=100.0 / (STATIONS - 1)) * 100.0
    assert canvas.sum() / 255.0 == pytest.approx(height, rel=0.12)
    # towards the side camera: as wide as the widest section, no longer
    line = CARP.midline(np.array([140.0, -80.0, -80.0]), np.pi / 2, np.zeros(4))
    draw_pieces(canvas, window, side_outline(CARP, line, np.pi / 2))
    _, _, wide, _ = cv2.boundingRect((canvas > 127).astype(np.uint8))
    assert wide == pytest.approx(2.0 * CARP.half_width.max() * 100.0, abs=2.0)


def test_an_unknown_build_is_refused() -> None:
    with pytest.raises(InputError, match="carp and eel"):
        fish_model("shark")
