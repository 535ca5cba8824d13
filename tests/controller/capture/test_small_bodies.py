"""Bodies of few pixels: their points, what is said of their error, and the pictures behind both."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from snakewalk.controller.capture.capture import Capture
from snakewalk.controller.capture.identity import margins
from snakewalk.controller.capture.small_body.crop import bends_of, crop_body, reversed_body
from snakewalk.controller.capture.small_body.film_body import Patch, film_body, fit_frame
from snakewalk.controller.capture.small_body.film_fit import fit_film
from snakewalk.controller.capture.small_body.ribbon import (
    BENDS,
    FRAME,
    STATIONS,
    Grid,
    Ribbon,
    curve_of,
    curve_slopes,
    gram,
)
from snakewalk.controller.images.body_detector import BodyDetector
from snakewalk.controller.images.medial_axis import no_skeleton
from snakewalk.controller.images.silhouette import Polarity
from snakewalk.controller.images.thin_body_fit import fitted
from snakewalk.controller.track.frame_status import FrameStatus
from tests.helpers.captured import capture
from tests.helpers.tiers import slow_after
from tests.oracles.rendered_snake import SnakeScene, film, true_midlines
from tests.oracles.skeleton_accuracy import point_error, swapped

SMALL = SnakeScene(rows=120, columns=140, length_px=36.0, frames=10, wave_hz=0.6, rate_hz=12.0)
DETECTOR = BodyDetector(None, Polarity.DARK, "a smooth surface through each frame")


def watch(scene: SnakeScene) -> tuple[Capture, np.ndarray]:
    """A film seen, and the error of every point's mean, of the length, of the used frames."""
    seen = capture(film(scene), DETECTOR, scene.rate_hz)
    truth = true_midlines(scene)
    used = np.flatnonzero(seen.used)
    assert not any(swapped(seen.points_px[k], truth[k]) for k in used)
    errors = np.full(scene.frames, np.nan)
    errors[used] = [point_error(seen.points_px[k], truth[k]) / scene.length_px for k in used]
    return seen, errors


@pytest.mark.slow_cases(1, "4 cases of 1.5 s of CPU")
@pytest.mark.costs("a film of small bodies")
@pytest.mark.parametrize(
    "change",
    slow_after(
        1,
        [
            {},
            {"blur_px": 2.0},
            {"shadow": 0.3},
            {"noise": 6.0, "blur_px": 1.2, "light": 0.3, "shadow": 0.25},
            {"taper": 0.12},
        ],
    ),
    ids=["plain", "blurred", "shadow", "all", "blunt"],
)
def test_corresponding_points_are_within_a_hundredth(change: dict[str, Any]) -> None:
    seen, errors = watch(replace(SMALL, **change))
    assert seen.used.all()
    assert np.median(errors) < 0.01
    assert np.median(seen.expected_px) / SMALL.length_px == pytest.approx(
        float(np.median(errors)), rel=0.8
    )


@pytest.mark.slow
def test_a_body_too_blurred_and_noisy_for_its_size_is_told_rough_and_keeps_its_points() -> None:
    scene = replace(SMALL, length_px=20.0, noise=8.0, blur_px=1.5)
    seen, errors = watch(scene)
    rough = np.array([one is FrameStatus.ROUGH for one in seen.status])
    assert rough.mean() > 0.5
    assert not seen.good.any()
    assert np.isfinite(seen.points_px[rough]).all()

    assert np.median(errors[rough]) < 0.04
    assert (seen.expected_px[rough] > 0.01 * seen.length_px[rough]).all()


@pytest.mark.slow
def test_the_length_is_the_same_in_every_frame_and_chords_are_equal() -> None:
    seen, _ = watch(SMALL)
    assert np.ptp(seen.length_px) < 0.01
    chords = np.hypot(*np.diff(seen.points_px, axis=1).transpose(2, 0, 1))
    assert np.ptp(chords, axis=1).max() < 1e-6


def picture_and_parameters() -> tuple[Ribbon, np.ndarray, np.ndarray, tuple[int, int]]:
    rng = np.random.default_rng(5)
    widths = np.log(0.7 + 0.2 * rng.random(len(STATIONS)))
    body = np.concatenate([[20.0, np.log(1.1)], widths, [30.0, 0.7, 0.5, np.log(1.6)]])
    bends = 0.6 * rng.normal(size=BENDS)
    frame = np.concatenate([[14.0, 12.0], bends, [110.0], [1.0, 2.0, -1.0]])
    return Ribbon(Grid(30, 3)), frame, body, (25, 28)


@pytest.mark.parametrize("shaded", [False, True])
def test_slopes_of_the_picture_are_its_differences(shaded: bool) -> None:
    ribbon, frame, body, shape = picture_and_parameters()
    body = body if shaded else body[:-4]
    both = np.concatenate([frame, body])

    def shown(values: np.ndarray) -> np.ndarray:
        return ribbon.picture(values[:FRAME], values[FRAME:], shape)[0]

    _, slopes = ribbon.picture(frame, body, shape)
    for k, slope in enumerate(slopes):
        step = 1e-5 * np.eye(len(both))[k]
        ratio = (shown(both + step) - shown(both - step)) / 2e-5
        assert np.abs(slope - ratio).max() < 2e-3 * max(1.0, np.abs(ratio).max()), k


def test_the_picture_holds_the_area_of_the_body() -> None:
    ribbon, frame, body, shape = picture_and_parameters()
    frame[2 : 2 + BENDS] = 0.3  # straight
    cover = ribbon.cover(frame, body, shape)
    wide = np.trapezoid(
        np.exp(np.interp(np.linspace(0, 1, 4001), STATIONS, body[2:-4])), dx=1 / 4e3
    )
    assert cover.sum() == pytest.approx(2.0 * wide * 20.0, rel=0.01)


def test_the_line_has_its_length_its_middle_and_its_slopes() -> None:
    _, frame, _, _ = picture_and_parameters()
    line = curve_of(frame, 20.0, 40)
    steps = np.hypot(*np.diff(line, axis=0).T)
    assert np.allclose(steps, 0.5)
    assert np.allclose(0.5 * (line[1:] + line[:-1]).mean(axis=0), frame[:2])
    slopes = curve_slopes(frame, 20.0)
    longer = (curve_of(frame, 20.0 + 1e-5, 40) - curve_of(frame, 20.0 - 1e-5, 40)) / 2e-5
    assert np.allclose(slopes[:, :, -1], longer, atol=1e-6)
    for k in range(2 + BENDS):
        step = 1e-5 * np.eye(FRAME)[k]
        moved = (curve_of(frame + step, 20.0, 40) - curve_of(frame - step, 20.0, 40)) / 2e-5
        assert np.allclose(slopes[:, :, k], moved, atol=1e-6)


def test_reversed_body_is_the_same_line_from_its_other_end() -> None:
    _, frame, _, _ = picture_and_parameters()
    line, other = curve_of(frame, 20.0), curve_of(reversed_body(frame), 20.0)
    assert np.allclose(other, line[::-1], atol=1e-9)
    angle = np.abs(np.exp(1j * bends_of(line)) - np.exp(1j * frame[2 : 2 + BENDS]))
    assert angle.max() < 0.05


def test_products_in_parts_are_the_products() -> None:
    rows = np.random.default_rng(1).normal(size=(40, 1003))
    assert np.allclose(gram(rows), rows @ rows.T)


def test_a_body_outside_its_patch_tells_nothing_and_leaves_the_others_their_fit() -> None:
    ribbon, frame, body, shape = picture_and_parameters()
    picture, _ = ribbon.picture(frame, body, shape)
    patch = Patch(picture, np.ones(shape))
    outside = frame.copy()
    outside[:2] += 500.0
    shared, frames = film_body([patch] * 3, [frame, frame, outside], body)
    assert np.allclose(frames[0][:2], frame[:2], atol=0.3)
    assert np.allclose(frames[2][:2], outside[:2])
    lost = fit_frame(patch, outside, shared)
    assert np.sqrt(np.diag(lost.inverse)[:2]).min() > 100.0


def test_a_faint_line_is_found_from_a_wrong_guess() -> None:
    _, frame, body, _ = picture_and_parameters()
    frame[2 : 2 + BENDS] = 0.7 * np.sin(np.linspace(0.0, 6.0, BENDS))
    cover = Ribbon(Grid(60, 1)).cover(frame, body, (25, 28))
    level = np.asarray(100.0 * cover, dtype=np.float32)
    true = curve_of(frame, 20.0)
    found = fitted((true - true.mean(axis=0)) * 0.9 + true.mean(axis=0), level, 3.0)
    assert found is not None
    curve, left = found
    assert left < 0.05
    away = np.hypot(*(curve[:, None] - true[None, ::4]).transpose(2, 0, 1)).min(axis=0)
    assert np.median(away) < 0.1


def test_what_is_no_line_is_not_fitted_as_one() -> None:
    rng = np.random.default_rng(2)
    line = np.column_stack([np.linspace(4.0, 24.0, 60), np.full(60, 12.0)])
    assert fitted(line, rng.normal(0.0, 20.0, (25, 28)).astype(np.float32), 3.0) is None


@pytest.mark.slow
def test_a_stretch_from_the_wrong_end_is_turned_and_a_lost_frame_found() -> None:
    truth = true_midlines(SMALL)
    bodies, cut_outs = [], {}
    for k, image in enumerate(film(SMALL)):
        detection = DETECTOR.detect(image)
        body = detection.skeleton
        wrong = k >= 8  # after a doubt
        bodies.append(body.reversed() if swapped(body.points_px, truth[k]) != wrong else body)
        cut_outs[k] = crop_body(image, detection.background, body.points_px)
    bodies[4] = no_skeleton(FrameStatus.BLOB)
    expected = np.full(len(bodies), np.nan)
    refined = fit_film(bodies, cut_outs, margins(bodies), expected, fixed=True)
    assert refined.body is not None
    assert [one.status for one in refined.skeletons] == [FrameStatus.GOOD] * len(bodies)
    for body, true in zip(refined.skeletons, truth, strict=True):
        assert point_error(body.points_px, true) < 0.015 * SMALL.length_px


def test_sharp_long_bodies_are_left_as_they_are() -> None:
    scene = replace(SMALL, rows=160, columns=180, length_px=110.0, blur_px=0.5, frames=8)
    detections = [(image, DETECTOR.detect(image)) for image in film(scene)]
    bodies = [detection.skeleton for _, detection in detections]
    cut_outs = {
        k: crop_body(image, detection.background, detection.skeleton.points_px)
        for k, (image, detection) in enumerate(detections)
    }
    refined = fit_film(bodies, cut_outs, margins(bodies), np.full(8, np.nan), fixed=True)
    assert refined.body is None
    assert all(a.points_px is b.points_px for a, b in zip(refined.skeletons, bodies, strict=True))
    assert (refined.expected_px < 1.1).all()
