"""Doubts that a capture reports: a contradicted head, faint tails, frames that are not used."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from snakewalk.controller.capture.capture import Capture, capture
from snakewalk.controller.capture.capturing import warning_of
from snakewalk.controller.capture.identity import head_end
from snakewalk.controller.capture.options import CaptureOptions
from snakewalk.controller.images.body_detector import make_detector
from snakewalk.controller.track.frame_status import FrameStatus
from tests.oracles.rendered_snake import SnakeScene, film, half_width, true_midlines
from tests.oracles.skeleton_accuracy import point_error

SCENE = SnakeScene(rows=240, columns=320, frames=10, rate_hz=3.75, wave_hz=0.6, length_px=100.0)
OPTIONS = CaptureOptions(Path("film.avi"), Path("track.npz"))


def test_an_animal_that_moves_backwards_has_an_unsure_head() -> None:
    scene = replace(SCENE, frames=20, rate_hz=15.0)
    points = true_midlines(scene)
    radius = np.tile(half_width(scene), (20, 1))
    score, by = head_end(points, radius, 15.0, None, fixed=True)
    assert by == "travel"
    assert score > 0.9
    backwards, by = head_end(points[::-1], radius, 15.0, None, fixed=True)
    assert by == "travel"
    assert -0.3 < backwards < 0.0
    even = np.ones_like(radius)
    assert head_end(points[::-1], even, 15.0, None, fixed=True)[0] < -0.9


def test_a_slow_larva_with_a_faint_tail_is_seen_whole() -> None:
    scene = replace(SCENE, head=1.8, faint=0.15, tip=0.05, taper=0.6, slender=18.0)
    frames, truth = list(film(scene)), true_midlines(scene)
    seen = capture(frames, make_detector(frames[::2]), scene.rate_hz)
    off = np.array([point_error(seen.points_px[k], truth[k]) for k in np.flatnonzero(seen.used)])
    assert seen.used.sum() >= 9
    assert np.nanmedian(seen.length_px) > 0.85 * scene.length_px
    assert (off < 2.0 * seen.expected_px[seen.used]).mean() > 0.9


def captured(status: list[FrameStatus], expected_px: float = 0.5) -> Capture:
    used = np.array([one.has_points for one in status])
    frames = len(status)
    nan = np.where(used, 1.0, np.nan)
    return Capture(
        points_px=np.ones((frames, 101, 2)) * nan[:, None, None],
        radius_px=np.ones((frames, 101)) * nan[:, None],
        length_px=100.0 * nan,
        status=tuple(status),
        expected_px=expected_px * nan,
        distractors=np.zeros(frames),
        margin=nan,
        rate_hz=10.0,
        time_s=np.arange(frames) / 10.0,
        head_by="travel",
        head_sure=0.9,
    )


def test_many_unused_frames_are_reported_with_their_usual_reason() -> None:
    good, bad = FrameStatus.GOOD, FrameStatus.EMPTY
    assert warning_of(OPTIONS, captured([good] * 8 + [bad] * 2)) is None
    assert warning_of(OPTIONS, captured([good] * 3 + [FrameStatus.NOTHING] * 7)) is None
    text = warning_of(OPTIONS, captured([good] * 5 + [bad] * 4 + [FrameStatus.KNOT]))
    assert text is not None
    assert text.startswith("film.avi: 5 of 10 frames are not used")
    assert str(bad) in text


def test_a_large_expected_error_is_reported() -> None:
    rough = [FrameStatus.ROUGH] * 10
    assert warning_of(OPTIONS, captured(rough, 2.0)) is None
    text = warning_of(OPTIONS, captured(rough, 5.0))
    assert text is not None
    assert "off by 5.0% of the body" in text
