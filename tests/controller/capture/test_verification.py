"""Finished skeletons against their own frames; bodies whose parts differ in contrast or width."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from snakewalk.controller.capture.verification.film_check import (
    agreeing_ends,
    possible_form,
    verified,
)
from snakewalk.controller.capture.verification.frame_store import FrameStore
from snakewalk.controller.images.body_detector import BodyDetector
from snakewalk.controller.images.medial_axis import Skeleton
from snakewalk.controller.images.silhouette import Polarity
from snakewalk.controller.track.frame_status import FrameStatus
from snakewalk.controller.track.resample import equal_arc_length
from tests.oracles.rendered_snake import SnakeScene, empty, film, half_width, true_midlines
from tests.oracles.skeleton_accuracy import point_error, swapped

SCENE = SnakeScene(
    rows=260, columns=320, length_px=130.0, frames=8, rate_hz=4.0, wave_hz=0.6, shadow=0.2,
    light=0.2,
)  # fmt: skip
TRUTH = true_midlines(SCENE)
MIDDLE = np.array([160.0, 130.0])


@pytest.fixture(scope="module")
def store() -> FrameStore:
    kept = FrameStore()
    for k, frame in enumerate(film(SCENE)):
        kept.put(k, frame, np.array([[0.0, 0.0], [319.0, 259.0]]), 10.0)
    return kept


def body(line: np.ndarray, status: FrameStatus = FrameStatus.GOOD, part: float = 1.0) -> Skeleton:
    length = float(np.hypot(*np.diff(line, axis=0).T).sum())
    radius = np.interp(np.linspace(0.0, part, 101), np.linspace(0.0, 1.0, 101), half_width(SCENE))
    return Skeleton(line, radius, length, status)


def bodies() -> list[Skeleton]:
    return [body(line) for line in TRUTH]


def test_true_midlines_are_kept(store: FrameStore) -> None:
    assert [one.status for one in verified(bodies(), store)[0]] == [FrameStatus.GOOD] * 8


def test_a_line_on_empty_ground_is_rejected(store: FrameStore) -> None:
    found = bodies()
    away = 2.0 * (MIDDLE - TRUTH[3].mean(axis=0))  # to the other side of the circle
    found[3] = body(TRUTH[3] + away)
    seen = [one.status for one in verified(found, store)[0]]
    assert seen[3] is FrameStatus.EMPTY
    assert seen.count(FrameStatus.GOOD) == 7


def test_lines_on_empty_ground_in_every_frame_are_rejected(store: FrameStore) -> None:
    found = [body(line + 2.0 * (MIDDLE - line.mean(axis=0))) for line in TRUTH]
    assert {one.status for one in verified(found, store)[0]} == {FrameStatus.EMPTY}


def test_half_a_body_goes_on_beyond_its_tip_even_if_every_frame_shows_it(store: FrameStore) -> None:
    found = [body(equal_arc_length(line[:55], 100), part=0.54) for line in TRUTH]
    assert {one.status for one in verified(found, store)[0]} == {FrameStatus.PART}


def test_a_jump_across_a_gap_is_rejected(store: FrameStore) -> None:
    found = bodies()
    line = TRUTH[2].copy()
    side = np.array([line[60, 1] - line[40, 1], line[40, 0] - line[60, 0]])
    bow = np.sin(np.linspace(0.0, np.pi, 31))[:, None] * 0.6 * side
    line[35:66] += bow
    found[2] = replace(body(line, FrameStatus.COIL), length_px=130.0)
    assert verified(found, store)[0][2].status is FrameStatus.EMPTY


def test_a_body_much_shorter_than_the_film_s_is_rejected(store: FrameStore) -> None:
    found = bodies()
    found[5] = body(equal_arc_length(TRUTH[5][:90], 100), FrameStatus.COIL)
    assert verified(found, store)[0][5].status is FrameStatus.LENGTH


def test_knots_that_the_width_does_not_allow() -> None:
    turn = np.linspace(0.0, 2.5 * np.pi, 101)
    wide = 2.0 * float(np.median(half_width(SCENE)))
    small = 0.3 * wide * np.column_stack([np.cos(turn), np.sin(turn)])
    line = equal_arc_length(np.vstack([TRUTH[0][:50] - TRUTH[0][49] + small[0], small]), 100)
    assert not possible_form(body(line, FrameStatus.COIL))
    large = 2.0 * wide * np.column_stack([np.cos(turn), np.sin(turn) + 0.02 * turn])
    loop = equal_arc_length(large, 100)
    assert possible_form(body(loop, FrameStatus.COIL))
    assert not possible_form(body(loop, FrameStatus.GOOD))


def test_a_stretch_with_exchanged_ends_is_put_right() -> None:
    scene = replace(SCENE, rate_hz=30.0, frames=9)
    found = [body(line) for line in true_midlines(scene)]
    wrong = [one.reversed() if k in {4, 5, 6} else one for k, one in enumerate(found)]
    right = agreeing_ends(wrong)
    assert all(
        np.array_equal(one.points_px, true.points_px)
        for one, true in zip(right, found, strict=True)
    )


KINDS: dict[str, tuple[dict[str, Any], float]] = {
    "pointed tail": ({"length_px": 180.0, "tip": 0.0, "rows": 320, "columns": 400}, 0.006),
    "bands": ({"length_px": 140.0, "bands": 6}, 0.01),
    "faint tail": ({"length_px": 140.0, "faint": 0.3}, 0.01),
    "wide head, faint tail": (
        {"head": 1.8, "faint": 0.15, "tip": 0.05, "slender": 18.0, "taper": 0.6, "length_px": 90.0},
        0.08,
    ),
}


@pytest.mark.parametrize("kind", KINDS)
def test_bodies_of_uneven_contrast_or_width_are_found_whole(kind: str) -> None:
    change, most = KINDS[kind]
    scene = replace(SnakeScene(rows=300, columns=360, frames=3, rate_hz=3.0, wave_hz=0.6), **change)
    detector = BodyDetector(empty(scene), Polarity.DARK, "given")
    for frame, true in zip(film(scene), true_midlines(scene), strict=True):
        found = detector.detect(frame).skeleton
        assert found.status is FrameStatus.GOOD
        line = found.points_px[::-1] if swapped(found.points_px, true) else found.points_px
        assert point_error(line, true) < most * scene.length_px
