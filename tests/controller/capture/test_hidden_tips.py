"""Expected errors of bodies whose tips the blur or the noise hides."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from snakewalk.controller.capture.capture import Capture
from snakewalk.controller.capture.small_body.film_fit import (
    FittedFilm,
    with_tip_errors,
)
from snakewalk.controller.capture.staged_film import with_statuses
from snakewalk.controller.images.body_detector import BodyDetector
from snakewalk.controller.images.medial_axis import Skeleton, no_skeleton
from snakewalk.controller.images.silhouette import Polarity
from snakewalk.controller.track.frame_status import FrameStatus
from tests.helpers.captured import capture
from tests.oracles.rendered_snake import SnakeScene, empty, film, true_midlines
from tests.oracles.skeleton_accuracy import point_error, swapped

SCENE = SnakeScene(rows=320, columns=400, frames=6, rate_hz=3.0, wave_hz=0.6, length_px=180.0)
HIDDEN: dict[str, dict[str, Any]] = {
    "a long, pointed tail": {"tip": 0.0, "taper": 0.8},
    "a pointed tail in a blurred picture": {"tip": 0.0, "blur_px": 2.0, "length_px": 140.0},
    "a thin body": {"slender": 45.0, "length_px": 150.0},
}
SEEN: dict[str, dict[str, Any]] = {"plain": {}, "a blunt tail": {"taper": 0.12}}


def filmed(change: dict[str, Any]) -> tuple[Capture, list[float]]:
    scene = replace(SCENE, seed=4, **change)
    seen = capture(film(scene), BodyDetector(empty(scene), Polarity.DARK, "given"), scene.rate_hz)
    off = []
    for found, true in zip(seen.points_px[seen.used], true_midlines(scene)[seen.used], strict=True):
        off.append(point_error(found[::-1] if swapped(found, true) else found, true))
    return seen, off


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("kind", HIDDEN)
def test_the_expected_error_contains_a_hidden_tip(kind: str) -> None:
    seen, off = filmed(HIDDEN[kind])
    assert len(off) >= 5
    assert (off < 2.0 * seen.expected_px[seen.used]).all()


def test_frames_with_a_hidden_tail_are_rough() -> None:
    seen, off = filmed(HIDDEN["a long, pointed tail"])
    assert min(off) > 0.015 * SCENE.length_px
    assert set(seen.status) == {FrameStatus.ROUGH}


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("kind", SEEN)
def test_tips_that_are_seen_leave_frames_good(kind: str) -> None:
    seen, off = filmed(SEEN[kind])
    assert seen.good.all()
    assert (off < 2.0 * seen.expected_px).all()
    assert np.median(seen.expected_px) < 0.007 * SCENE.length_px


def test_a_frame_without_points_leaves_the_errors_of_the_others_known() -> None:
    line = np.column_stack([np.linspace(10.0, 110.0, 101), np.full(101, 20.0)])
    body = Skeleton(line, np.full(101, 3.0), 100.0, FrameStatus.GOOD)
    ends = np.array([[10.0, 20.0, 0.0], [116.0, 20.0, 0.0]])
    lost = no_skeleton(FrameStatus.SHORT)
    film_of_two = FittedFilm((body, lost), np.array([0.5, 0.5]), None)
    seen = with_tip_errors(film_of_two, [ends, ends], np.zeros(2, dtype=bool))
    assert seen.expected_px[0] == pytest.approx(np.hypot(0.85 * 0.5, 0.5 * 0.7 * 6.0))
    assert with_statuses(seen.skeletons, seen.expected_px)[0].status is FrameStatus.ROUGH
    reversed_ends = with_tip_errors(film_of_two, [ends[::-1]] * 2, np.zeros(2, dtype=bool))
    assert reversed_ends.expected_px[0] == pytest.approx(seen.expected_px[0])
