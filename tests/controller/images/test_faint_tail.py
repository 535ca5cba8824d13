"""Drawn larvae: two dark eyes, a trunk, a tail fainter than the noise of a pixel."""

import cv2
import numpy as np
import pytest

from snakewalk.config.arrays import Floats, Image
from snakewalk.controller.images.body_detector import BodyDetector
from snakewalk.controller.images.faint_tail import follow_tail
from snakewalk.controller.images.medial_axis import skeleton_of
from snakewalk.controller.images.silhouette import Polarity
from snakewalk.controller.track.frame_status import FrameStatus

GROUND = 200.0
EYES = np.array([[40.0, 94.0], [40.0, 106.0]])
EYE = np.array([3.0, 0.0])
NOISE = 10.0
TAIL_LEVELS = 32.0


def _drawn(points: Floats, width_px: float) -> Floats:
    """(200, 240) coverage of a line."""
    fine = np.zeros((800, 960), dtype=np.uint8)
    line = np.rint((points + 0.5) * 4.0 - 0.5).astype(np.int32)
    cv2.polylines(fine, [line], False, 255, round(4.0 * width_px))
    return np.asarray(cv2.resize(fine, (240, 200), interpolation=cv2.INTER_AREA) / 255.0)


def _tail(bend: float) -> Floats:
    """(80, 2) from the trunk at x = 70, y = 100; ``bend`` in rad over its length."""
    angle = bend * np.linspace(0.0, 1.0, 80) ** 2
    steps = np.column_stack([np.cos(angle), np.sin(angle)])
    return np.asarray(np.array([70.0, 100.0]) + np.cumsum(steps, axis=0))


def _larva(bend: float, seed: int = 0) -> Image:
    image = np.full((200, 240), GROUND)
    for eye in EYES:
        image -= 130.0 * _drawn(np.vstack([eye - EYE, eye + EYE]), 9.0)
    image -= 110.0 * _drawn(np.array([[42.0, 100.0], [72.0, 100.0]]), 8.0)
    image -= TAIL_LEVELS * _drawn(_tail(bend), 3.0)
    image = cv2.GaussianBlur(image, (0, 0), 0.8)
    image += np.random.default_rng(seed).normal(0.0, NOISE, image.shape)
    return np.asarray(np.clip(np.rint(image), 0, 255), dtype=np.uint8)


def _detector() -> BodyDetector:
    background = np.full((200, 240), round(GROUND), dtype=np.uint8)
    return BodyDetector(background, Polarity.DARK, "given")


@pytest.mark.parametrize("bend", [0.0, 1.5, -2.5])
def test_a_larva_is_one_line_from_between_the_eyes_to_the_tip_of_its_tail(bend: float) -> None:
    found = _detector().detect(_larva(bend))
    line = found.skeleton.points_px
    assert found.skeleton.status is FrameStatus.GOOD
    assert found.tip_error_px > 0.0
    line = line if line[0, 0] < line[-1, 0] else line[::-1]
    assert np.hypot(*(line[:20] - EYES.mean(axis=0)).T).min() < 1.5
    assert np.hypot(*(line[-1] - _tail(bend)[-1])) < 5.0
    away = np.hypot(*(line[50:, None] - _tail(bend)[None]).transpose(2, 0, 1)).min(axis=1)
    assert np.median(away) < 1.0


def test_bare_ground_has_no_tail() -> None:
    rng = np.random.default_rng(1)
    level = rng.normal(0.0, NOISE, (200, 240)).astype(np.float32)
    away_px = np.full(level.shape, 100.0)
    line = np.column_stack([np.arange(40.0, 90.0), np.full(50, 100.0)])
    followed = [
        follow_tail(level, line + np.array([k, 0.0]), 1.5, away_px, 1.0) for k in range(0, 100, 5)
    ]
    assert sum(one is not None for one in followed) <= 1


def test_the_axis_ends_between_two_eyes_that_are_joined_to_the_trunk() -> None:
    body = np.zeros((200, 240), dtype=np.uint8)
    cv2.line(body, (42, 100), (150, 100), 1, 7)
    for y in (90, 110):
        cv2.circle(body, (40, y), 7, 1, -1)
    cv2.line(body, (45, 92), (45, 108), 1, 5)
    found = skeleton_of(body > 0)
    assert found.status is FrameStatus.GOOD
    assert np.abs(found.points_px[:, 1] - 100.0).max() < 1.5
