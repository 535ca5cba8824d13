"""Frames in which a body lies on itself without a hole, or something small is with it."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from snakewalk.controller.capture.small_body.blur_estimate import (
    axis_error_px,
    edge_blur_px,
)
from snakewalk.controller.capture.stages.outlier_frames import mark_outliers
from snakewalk.controller.images.body_detector import make_detector
from snakewalk.controller.images.medial_axis import Skeleton, no_skeleton
from snakewalk.controller.track.frame_status import FrameStatus
from tests.helpers.captured import capture
from tests.oracles.rendered_snake import SnakeScene, empty, film

SCENE = SnakeScene(rows=240, columns=320, length_px=140.0, frames=20, wave_hz=0.6)
ODD = [8, 9, 10]


def straight(length: float, radius: float, jitter: float = 0.0) -> Skeleton:
    at = np.linspace(0.0, 1.0, 101)
    points = np.column_stack([length * at, np.zeros(101)])
    return Skeleton(points, np.full(101, radius + jitter), length, FrameStatus.GOOD)


def usual(count: int = 12) -> list[Skeleton]:
    return [straight(100.0 + 0.3 * (k % 3), 4.0, 0.05 * (k % 4)) for k in range(count)]


def test_usual_frames_are_kept_and_the_unusual_ones_named() -> None:
    bodies = usual()
    area = np.full(len(bodies), 800.0)
    assert [one.status for one in mark_outliers(bodies, area)] == [FrameStatus.GOOD] * 12
    bodies[3] = straight(88.0, 4.0)
    bodies[4] = straight(112.0, 4.0)
    thick = bodies[5].radius_px.copy()
    thick[40:60] = 7.0  # a part of the body beside itself
    bodies[5] = replace(bodies[5], radius_px=thick)
    area[6], area[7] = 600.0, 1000.0
    bodies[9] = no_skeleton(FrameStatus.CUT)
    found = [one.status for one in mark_outliers(bodies, area)]
    assert found[3:8] == [
        FrameStatus.SHORT,
        FrameStatus.LARGER,
        FrameStatus.SHORT,
        FrameStatus.SHORT,
        FrameStatus.LARGER,
    ]
    assert found[9] is FrameStatus.CUT
    assert found[:3] + found[8:9] + found[10:] == [FrameStatus.GOOD] * 6


def test_a_faint_tail_may_be_seen_in_part() -> None:
    bodies = usual()
    bodies[3], bodies[4] = straight(88.0, 4.0), straight(70.0, 4.0)
    found = [one.status for one in mark_outliers(bodies, np.full(12, 800.0), tailed={3, 4})]
    assert found[3:5] == [FrameStatus.GOOD, FrameStatus.SHORT]


def test_a_body_whose_length_changes_all_the_time_is_not_dropped() -> None:
    bodies = [straight(100.0 + 8.0 * np.sin(k), 4.0) for k in range(30)]
    found = mark_outliers(bodies, np.full(30, 800.0))
    assert all(one.status is FrameStatus.GOOD for one in found)


def with_something(draw: object) -> tuple[list[np.ndarray], np.ndarray]:
    frames = list(film(SCENE))
    first = make_detector(frames[::4], empty(SCENE))
    for k in ODD:
        line = first.detect(frames[k]).skeleton.points_px
        draw(frames[k], line)  # type: ignore[operator]
    return frames, empty(SCENE)


@pytest.mark.nightly("a further film: 2 s of CPU")
def test_a_small_animal_that_touches_the_body_is_noticed() -> None:
    def beside(frame: np.ndarray, line: np.ndarray) -> None:
        ahead = line[50] - line[44]
        side = np.array([-ahead[1], ahead[0]]) / np.hypot(*ahead)
        pair = np.stack([line[40] + 8.0 * side, line[62] + 8.0 * side])
        cv2.polylines(frame, [np.rint(pair).astype(np.int32)], False, 60, 7)

    frames, ground = with_something(beside)
    seen = capture(frames, make_detector(frames[::4], ground), SCENE.rate_hz)
    assert np.flatnonzero(~seen.good).tolist() == ODD
    assert all(seen.status[k] is FrameStatus.COIL for k in ODD)


def test_a_small_animal_elsewhere_is_counted_and_the_body_still_used() -> None:
    def apart(frame: np.ndarray, line: np.ndarray) -> None:
        away = np.array([160.0, 120.0])
        away = away + (away - line.mean(axis=0)) * 0.9
        tail = away + np.array([18.0, 4.0])
        pair = np.rint(np.stack([away, tail])).astype(np.int32)
        cv2.polylines(frame, [pair], False, 60, 7)

    frames, ground = with_something(apart)
    seen = capture(frames, make_detector(frames[::4], ground), SCENE.rate_hz)
    assert seen.used.all()
    assert np.flatnonzero(seen.with_distractors).tolist() == ODD
    assert (seen.distractors[ODD] < 0.4).all()


@pytest.mark.slow
def test_a_tail_folded_on_the_body_without_a_hole_is_noticed() -> None:
    frames, ground = with_something(lambda frame, line: None)
    bare = make_detector(frames[::4], ground)
    for k in ODD:
        line = bare.detect(frames[k]).skeleton.points_px
        # the last fifth is taken away and laid beside the body, without a gap
        image = ground.copy()
        kept = np.rint(line[:80] * 16.0).astype(np.int32)
        cv2.polylines(image, [kept], False, 60, 9, cv2.LINE_AA, 4)
        ahead = np.gradient(line, axis=0)
        side = np.column_stack([-ahead[:, 1], ahead[:, 0]]) / np.hypot(*ahead.T)[:, None]
        fold = np.rint((line + 7.0 * side)[58:79] * 16.0).astype(np.int32)
        cv2.polylines(image, [fold], False, 60, 8, cv2.LINE_AA, 4)
        frames[k] = image
    seen = capture(frames, bare, SCENE.rate_hz)
    assert np.flatnonzero(~seen.used).tolist() == ODD


def test_edge_blur_is_that_of_a_blurred_step() -> None:
    step = np.zeros((80, 80), dtype=np.float32)
    step[20:60, 20:60] = 100.0
    for blur in (2.0, 4.0):
        level = np.asarray(cv2.GaussianBlur(step, (0, 0), blur), dtype=np.float32)
        assert abs(edge_blur_px(level, 50.0) - blur) < 0.3 * blur
    assert edge_blur_px(step, 50.0) < 0.8
    assert axis_error_px(3.0, 100.0) > axis_error_px(1.0, 100.0) > 0.3


def test_a_body_with_its_other_end_first_is_not_thicker_than_the_others() -> None:
    taper = np.linspace(5.0, 2.0, 101)
    bodies = [replace(one, radius_px=taper) for one in usual()]
    bodies[7] = bodies[7].reversed()
    found = mark_outliers(bodies, np.full(12, 800.0))
    assert all(one.status is FrameStatus.GOOD for one in found)
