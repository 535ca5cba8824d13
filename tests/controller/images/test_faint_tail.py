"""Drawn larvae: two dark eyes, a trunk, a tail fainter than the noise of a pixel."""

import cv2
import numpy as np
import pytest

from snakewalk.controller.images.body_detector import BodyDetector
from snakewalk.controller.images.faint_tail import follow_tail
from snakewalk.controller.images.medial_axis import skeleton_of
from snakewalk.controller.images.silhouette import Polarity
from snakewalk.controller.track.frame_status import FrameStatus
from tests.oracles.drawn_larva import EYES, GROUND, NOISE, larva, tail_line


def _detector() -> BodyDetector:
    background = np.full((200, 240), round(GROUND), dtype=np.uint8)
    return BodyDetector(background, Polarity.DARK, "given")


@pytest.mark.parametrize("bend", [0.0, 1.5, -2.5])
def test_a_larva_is_one_line_from_between_the_eyes_to_the_tip_of_its_tail(bend: float) -> None:
    found = _detector().detect(larva(bend))
    line = found.skeleton.points_px
    assert found.skeleton.status is FrameStatus.GOOD
    assert found.tip is not None
    line = line if line[0, 0] < line[-1, 0] else line[::-1]
    assert np.hypot(*(line[:20] - EYES.mean(axis=0)).T).min() < 1.5
    assert np.hypot(*(line[-1] - tail_line(bend)[-1])) < 5.0
    away = np.hypot(*(line[50:, None] - tail_line(bend)[None]).transpose(2, 0, 1)).min(axis=1)
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
