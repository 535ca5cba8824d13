"""Faint tails of a film: noisy visible lengths, and a background that contains a resting animal."""

import cv2
import numpy as np
import pytest

from snakewalk.config.arrays import Image
from snakewalk.controller.capture.several.animal_films import with_bare_ground
from snakewalk.controller.capture.several.blobs import detector_of_several
from snakewalk.controller.capture.verification.steady_tails import with_steady_tails
from snakewalk.controller.images.background import background_candidates, median_background
from snakewalk.controller.images.body_detector import BodyDetector
from snakewalk.controller.images.faint_tail import TailTip
from snakewalk.controller.images.medial_axis import Skeleton, no_skeleton
from snakewalk.controller.images.silhouette import Polarity
from snakewalk.controller.track.frame_status import FrameStatus

FRAMES = 40
TRUE_PX = 100.0
TIPS = dict.fromkeys(range(FRAMES), TailTip(1.5, 0.0))


def _body(length_px: float) -> Skeleton:
    points = np.column_stack([np.linspace(0.0, length_px, 101), np.zeros(101)])
    return Skeleton(points, np.full(101, 3.0), length_px, FrameStatus.GOOD)


def test_noisy_lengths_are_nearer_to_the_truth_and_keep_the_head() -> None:
    own_px = TRUE_PX + np.random.default_rng(1).normal(0.0, 3.0, FRAMES)
    bodies = [_body(float(length)) for length in own_px]
    steady, errors = with_steady_tails(bodies, TIPS)
    steady_px = np.array([body.length_px for body in steady])
    before, after = (np.abs(px - TRUE_PX).mean() for px in (own_px, steady_px))
    assert after < 0.75 * before
    assert np.mean(np.abs(steady_px - TRUE_PX) < 2.0 * np.array(list(errors.values()))) > 0.9
    assert all(np.allclose(body.points_px[0], 0.0) for body in steady)
    chords = np.hypot(*np.diff(steady[0].points_px, axis=0).T)
    assert chords == pytest.approx(np.full(100, chords[0]))


def test_a_tail_that_is_seen_half_is_expected_to_be_off() -> None:
    lengths = [TRUE_PX + 0.5 * (-1.0) ** k for k in range(FRAMES)]
    lengths[20] = 0.8 * TRUE_PX
    bodies = [_body(length) for length in lengths]
    steady, errors = with_steady_tails(bodies, TIPS)
    assert steady[20].length_px == pytest.approx(90.0, abs=1.0)
    assert errors[20] > 5.0 > 2.5 > errors[19]


def test_frames_without_a_followed_tail_do_not_change() -> None:
    bodies = [_body(90.0), no_skeleton(FrameStatus.PART), _body(110.0)]
    steady, errors = with_steady_tails(bodies, {1: TIPS[1]})
    assert steady == bodies
    assert not errors


def _plate(moved: float, tail: float = 40.0) -> Image:
    """Two animals with dark bodies and faint tails; the first one rests, then moves down."""
    image = np.full((160, 240), 200.0)
    for x, y in ((40.0, 40.0 + moved), (60.0 + 3.0 * moved, 130.0)):
        for first, last, levels, width in ((0.0, 24.0, 100.0, 8), (24.0, 70.0, tail, 4)):
            line = np.rint([[x + first, y], [x + last, y]]).astype(np.int32)
            cover = cv2.line(np.zeros(image.shape, np.uint8), line[0], line[1], 255, width)
            image = np.minimum(image, 200.0 - levels * (cover / 255.0))
    noise = np.random.default_rng(int(image.sum())).normal(0.0, 2.0, image.shape)
    return np.asarray(np.clip(np.rint(image + noise), 0, 255), dtype=np.uint8)


def test_an_animal_that_rests_in_half_of_the_frames_leaves_the_background_bare() -> None:
    frames = [_plate(float(max(0, k - 9)) * 4.0) for k in range(20)]
    detector = detector_of_several(frames)
    bare = with_bare_ground(detector, frames).background
    assert bare is not None
    tail = (slice(38, 43), slice(70, 105))
    assert median_background(frames)[tail].mean() < 192.0
    assert abs(float(bare[tail].mean()) - 200.0) < 2.0


def test_a_tail_too_faint_to_be_followed_leaves_the_background_bare() -> None:
    """It rests in 14 of 20 frames, and no frame's outline contains it."""
    frames = [_plate(float(max(0, k - 13)) * 6.0, tail=6.0) for k in range(20)]
    (median, *_), (lighter, polarity, _), _ = background_candidates(frames)
    assert polarity is Polarity.DARK
    detector = BodyDetector(lighter, polarity, "lighter")
    bare = with_bare_ground(detector, frames).background
    assert bare is not None
    tail = (slice(39, 42), slice(80, 105))
    ground = float(np.median(bare))
    assert median[tail].mean() < 196.0
    assert abs(float(bare[tail].mean()) - ground) < 2.0
