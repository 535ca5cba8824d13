"""Masks with known axes, and bodies that lie on themselves."""

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from snakewalk.controller.images.medial_axis import skeleton_of
from snakewalk.controller.track.frame_status import FrameStatus

Floats = NDArray[np.float64]


def tube(points: Floats, width_px: int, size: tuple[int, int] = (300, 400)) -> NDArray[np.bool_]:
    canvas = np.zeros(size, dtype=np.uint8)
    line = np.rint(points * 16.0).astype(np.int32)
    cv2.polylines(canvas, [line], False, 1, width_px, cv2.LINE_8, 4)
    return canvas > 0


def arc(radius: float, start: float, stop: float) -> Floats:
    t = np.linspace(start, stop, 200)
    return np.column_stack([200.0 + radius * np.cos(t), 150.0 + radius * np.sin(t)])


@pytest.mark.parametrize("width_px", [3, 6, 15, 30])
def test_the_axis_of_a_bar_is_its_middle(width_px: int) -> None:
    mask = np.zeros((100, 400), dtype=bool)
    mask[40 : 40 + width_px, 30:370] = True
    found = skeleton_of(mask)
    assert found.status is FrameStatus.GOOD
    assert np.abs(found.points_px[:, 1] - (39.5 + width_px / 2)).max() < 0.6
    ends = np.sort(found.points_px[[0, -1], 0])
    assert np.allclose(ends, [29.5, 369.5], atol=1.0 + 0.05 * width_px)
    assert found.length_px == pytest.approx(340.0, abs=2.0 + 0.1 * width_px)
    assert np.allclose(found.radius_px[20:80], width_px / 2, atol=0.12 * width_px + 0.3)


def test_the_axis_of_an_arc_is_an_arc_of_equal_chords() -> None:
    found = skeleton_of(tube(arc(100.0, 0.3, 3.2), 13))
    assert found.status is FrameStatus.GOOD
    away = np.hypot(*(found.points_px - [200.0, 150.0]).T)
    assert np.median(np.abs(away - 100.0)) < 0.3
    assert np.abs(away - 100.0).max() < 2.0  # at the round ends
    assert np.ptp(np.hypot(*np.diff(found.points_px, axis=0).T)) < 1e-6


def test_a_spur_on_the_side_is_pruned() -> None:
    body = tube(np.array([[40.0, 150.0], [360.0, 150.0]]), 15)
    body |= tube(np.array([[200.0, 150.0], [200.0, 164.0]]), 5)
    found = skeleton_of(body)
    assert found.status is FrameStatus.GOOD
    assert np.abs(found.points_px[:, 1] - 150.0).max() < 3.0


@pytest.mark.parametrize("turn", range(0, 360, 37))
def test_turning_the_image_turns_the_skeleton(turn: int) -> None:
    s = np.linspace(-1.0, 1.0, 200)
    body = np.column_stack([110.0 * s, 30.0 * np.sin(4.0 * s)])
    c, si = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    found = skeleton_of(tube(body @ [[c, si], [-si, c]] + [200.0, 150.0], 11))
    assert found.status is FrameStatus.GOOD
    back = (found.points_px - [200.0, 150.0]) @ [[c, -si], [si, c]]
    error = np.abs(back[:, 1] - 30.0 * np.sin(4.0 * np.clip(back[:, 0] / 110.0, -1.1, 1.1)))
    assert np.median(error) < 0.5


def test_a_ring_is_a_loop() -> None:
    assert skeleton_of(tube(arc(70.0, 0.0, 6.4), 14)).status is FrameStatus.LOOP


def test_a_body_that_crosses_itself_is_a_loop() -> None:
    t = np.linspace(-2.2, 2.2, 300)
    curve = np.column_stack([200.0 + 30.0 * (t**3 - 3.0 * t), 60.0 + 40.0 * t * t])
    assert skeleton_of(tube(curve, 9)).status is FrameStatus.LOOP


def test_a_head_laid_against_the_side_branches() -> None:
    body = tube(np.array([[40.0, 150.0], [360.0, 150.0]]), 13)
    body |= tube(np.array([[200.0, 150.0], [230.0, 240.0]]), 13)
    assert skeleton_of(body).status is FrameStatus.BRANCH


def test_what_is_no_body_has_a_verdict_and_no_points() -> None:
    nothing = skeleton_of(np.zeros((50, 50), dtype=bool))
    assert nothing.status is FrameStatus.NOTHING
    disc = np.hypot(*np.mgrid[-50:50, -50:50]) < 30
    blob = skeleton_of(disc)
    assert blob.status is FrameStatus.BLOB
    assert np.isnan(blob.points_px).all()
    assert blob.points_px.shape == (101, 2)
