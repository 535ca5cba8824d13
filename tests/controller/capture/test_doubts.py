"""Doubts that a capture reports: a contradicted head, faint tails, frames that are not used."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from snakewalk.config.errors import InputError
from snakewalk.controller.capture.capture import Capture, UnusableFilmError
from snakewalk.controller.capture.capturing import (
    capture_recording,
    check_chance_finds,
    in_doubt,
    warning_of,
)
from snakewalk.controller.capture.coil_film import CoilFilm
from snakewalk.controller.capture.detections import Detections
from snakewalk.controller.capture.identity import align_ends
from snakewalk.controller.capture.stages.head import head_end
from snakewalk.controller.capture.verification.film_check import has_faint_continuation
from snakewalk.controller.capture.verification.frame_store import FrameStore
from snakewalk.controller.images.body_detector import BodyDetector, make_detector
from snakewalk.controller.images.medial_axis import Skeleton, no_skeleton
from snakewalk.controller.images.silhouette import Polarity
from snakewalk.controller.track.frame_status import FrameStatus
from tests.helpers.captured import capture
from tests.helpers.film_options import film_options
from tests.oracles.rendered_snake import (
    SnakeScene,
    coverage,
    empty,
    film,
    half_width,
    true_midlines,
)
from tests.oracles.skeleton_accuracy import point_error

SCENE = SnakeScene(rows=240, columns=320, frames=10, rate_hz=3.75, wave_hz=0.6, length_px=100.0)
OPTIONS = film_options(Path("film.avi"), Path("track.npz"))


NO_CONTRAST = np.zeros((0, 101))


def test_an_animal_that_moves_backwards_has_an_unsure_head() -> None:
    scene = replace(SCENE, frames=20, rate_hz=15.0)
    points = true_midlines(scene)
    radius = np.tile(half_width(scene), (20, 1))
    score, _ = head_end(points, radius, NO_CONTRAST, 15.0, None, fixed=True)
    assert score > 0.85
    backwards, _ = head_end(points[::-1], radius, NO_CONTRAST, 15.0, None, fixed=True)
    assert abs(backwards) < 0.5
    even = np.ones_like(radius)
    motion, by = head_end(points[::-1], even, NO_CONTRAST, 15.0, None, fixed=True)
    assert by in {"travel", "wave"}
    assert motion == pytest.approx(2.0 * 0.12 - 1.0, abs=0.03), "12 % of the films move backwards"


def test_signs_of_the_form_are_one_another_s_repetition() -> None:
    """A weak wave, a taper, and dark eyes; the same signs of the other end have the other score."""
    turn = np.concatenate([np.arange(24.0), 23.0 - np.arange(16.0)])[:, None] * 0.4
    angle = 0.8 * np.sin(2.0 * np.pi * np.linspace(0.0, 1.0, 101) + turn)
    points = np.cumsum(np.stack([np.cos(angle), np.sin(angle)], axis=2), axis=1)
    thick_first = np.tile(np.linspace(5.0, 2.5, 101), (40, 1))
    dark_first = np.tile(np.linspace(60.0, 20.0, 101), (8, 1))
    values = (points, thick_first, dark_first)
    scores = []
    for way in (1, -1):
        turned = [value[:, ::way] for value in values]
        scores.append(head_end(*turned, 15.0, None, fixed=False))
    assert scores[0][0] == pytest.approx(-scores[1][0])
    assert scores[0][1] == scores[1][1] == "eyes"
    alike = np.ones_like(thick_first)
    score, by = head_end(points, alike, NO_CONTRAST, 15.0, None, fixed=False)
    assert by == "wave"
    assert -0.9 < score < 0.0
    without_eyes, _ = head_end(points, thick_first, NO_CONTRAST, 15.0, None, fixed=False)
    assert score < without_eyes < scores[0][0]


@pytest.mark.slow
def test_a_slow_larva_with_a_faint_tail_is_seen_whole() -> None:
    scene = replace(SCENE, head=1.8, faint=0.15, tip=0.05, taper=0.6, slender=18.0)
    frames, truth = list(film(scene)), true_midlines(scene)
    seen = capture(frames, make_detector(frames[::2]), scene.rate_hz)
    off = np.array([point_error(seen.points_px[k], truth[k]) for k in np.flatnonzero(seen.used)])
    assert seen.used.sum() >= 7  # the others are as short as a frame without its tail
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
    assert warning_of(OPTIONS, captured([good] * 16 + [bad] * 4)) is None
    assert warning_of(OPTIONS, captured([good] * 6 + [FrameStatus.NOTHING] * 14)) is None
    text = warning_of(OPTIONS, captured([good] * 10 + [bad] * 8 + [FrameStatus.KNOT] * 2))
    assert text is not None
    assert text.startswith("film.avi: 10 of 20 frames are not used")
    assert str(bad) in text
    text = warning_of(OPTIONS, captured([good] * 10 + [FrameStatus.SEVERAL] * 10))
    assert text is not None
    assert "(several animals: give --animals N or --animals auto); look at --sheet" in text


def test_a_large_expected_error_is_reported() -> None:
    rough = [FrameStatus.ROUGH] * 20
    assert warning_of(OPTIONS, captured(rough, 1.2)) is None
    text = warning_of(OPTIONS, captured(rough, 5.0))
    assert text is not None
    assert "off by 5.0% of the body" in text


def test_good_frames_among_broken_outlines_are_rough() -> None:
    good, broken = FrameStatus.GOOD, FrameStatus.PART
    plain = captured([good] * 6 + [broken] * 4)
    assert in_doubt(plain) is plain
    doubtful = in_doubt(captured([good] * 4 + [broken] * 6))
    assert not doubtful.good.any()
    assert doubtful.used.sum() == 4
    assert (doubtful.expected_px[:4] == 10.0).all()
    assert np.isnan(doubtful.expected_px[4:]).all()
    coils = captured([good] * 4 + [FrameStatus.COIL_ALONE] * 6)
    assert in_doubt(coils) is coils


def test_a_length_that_changes_in_a_film_with_unsolved_frames_is_in_doubt() -> None:
    """Two animals in contact look like one long body, whose length falls as they slide."""
    seen = captured([FrameStatus.GOOD] * 8 + [FrameStatus.COIL_ALONE] * 12)
    joined = replace(
        seen, length_px=seen.length_px * np.append(np.linspace(1.3, 1.0, 8), np.ones(12))
    )
    doubtful = in_doubt(joined)
    assert not doubtful.good.any()
    assert doubtful.expected_px[0] > 0.1 * joined.length_px[0]
    larva = captured([FrameStatus.GOOD] * 20)
    stretches = replace(larva, length_px=larva.length_px * np.linspace(1.3, 1.0, 20))
    assert in_doubt(stretches) is stretches


def test_few_used_frames_on_a_noisy_ground_are_unclear() -> None:
    good = no_skeleton(FrameStatus.GOOD)
    broken, empty_frame = (no_skeleton(one) for one in (FrameStatus.PART, FrameStatus.NOTHING))
    found = Detections()
    assert not found.is_unclear([])
    found.noise = [0.5] * 10
    assert found.is_unclear([good] * 4 + [broken] * 6)
    assert not found.is_unclear([good] * 5 + [broken] * 5)
    assert not found.is_unclear([good] * 2 + [empty_frame] * 8)
    found.noise = [0.28] * 10
    noisy = [good] * 4 + [broken] * 6
    assert not found.is_unclear(noisy), "noise of 8 grey levels leaves all frames good"


TAILS: dict[str, tuple[dict[str, Any], bool]] = {
    "the tail is too faint": ({"head": 1.8, "faint": 0.07, "taper": 0.6}, True),
    "pointed": ({"tip": 0.0}, False),
    "shadow": ({"shadow": 0.4}, False),
    "stains": ({"stains": 40.0}, False),
}


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("kind", TAILS)
def test_a_tail_that_was_not_found_is_noticed_over_the_film(kind: str) -> None:
    change, expected = TAILS[kind]
    scene = replace(SCENE, frames=8, rate_hz=3.0, **change)
    detector = BodyDetector(empty(scene), Polarity.DARK, "given", search_faint_parts=False)
    store, found = FrameStore(), []
    for number, frame in enumerate(film(scene)):
        body = detector.detect(frame).skeleton
        assert body.status is FrameStatus.GOOD
        store.put(number, frame, body.points_px, body.length_px)
        found.append(body)
    assert has_faint_continuation(align_ends(found), store) is expected


@pytest.mark.nightly("a further film: 6 s of CPU")
def test_an_animal_as_bright_as_its_ground_is_rejected_with_that_reason(tmp_path: Path) -> None:
    scene = replace(SCENE, rows=220, columns=260)
    rng = np.random.default_rng(4)
    mottled = rng.normal(0.0, 45.0, (scene.rows, scene.columns))
    pattern = 3.5 * gaussian_filter(mottled, 1.0)
    folder = tmp_path / "mottled"
    folder.mkdir()
    for k, line in enumerate(true_midlines(scene)):
        body = coverage(scene, line)
        frame = scene.ground + body * pattern + rng.normal(0.0, 3.0, body.shape)
        cv2.imwrite(str(folder / f"{k:02d}.png"), np.clip(frame, 0.0, 255.0).astype(np.uint8))
    with pytest.raises(InputError, match="the animal is about as bright as its ground"):
        capture_recording(film_options(folder, tmp_path / "track.npz", rate_hz=4.0))
    assert not (tmp_path / "track.npz").exists()


CHANCE: dict[str, tuple[list[FrameStatus], int, bool]] = {
    "few rough ones": ([FrameStatus.ROUGH], 3, True),
    "few good ones": ([FrameStatus.GOOD], 3, False),
    "many rough ones": ([FrameStatus.ROUGH], 8, False),
}


@pytest.mark.slow_cases(1, "3 cases of 1.0 s of CPU")
@pytest.mark.slow
@pytest.mark.parametrize("kind", CHANCE)
def test_a_few_rough_frames_of_an_unclear_outline_are_no_result(kind: str, tmp_path: Path) -> None:
    used, count, rejected = CHANCE[kind]
    status = (*used * count, *[FrameStatus.SEVERAL] * (14 - count), *[FrameStatus.NOTHING] * 9)
    scene = replace(SCENE, frames=8, rate_hz=3.0)
    seen = capture(film(scene), BodyDetector(empty(scene), Polarity.DARK, "given"), 3.0)
    length = np.where([one.has_points for one in status], 100.0, np.nan)
    altered = replace(seen, status=status, length_px=length)
    options = film_options(tmp_path / "film.avi", tmp_path / "track.npz")
    if not rejected:
        check_chance_finds(options, altered)
        return
    with pytest.raises(InputError, match="only 3 of 23 frames show a complete body"):
        check_chance_finds(options, altered)


def test_a_hidden_light_band_at_the_tail_is_part_of_the_expected_error() -> None:
    larva: dict[str, Any] = {"head": 1.8, "tip": 0.05, "taper": 0.6, "bands": 5}
    scene = replace(SCENE, rows=300, columns=360, frames=6, **larva)
    truth = true_midlines(scene)
    detector = BodyDetector(empty(scene), Polarity.DARK, "given")
    seen = capture(film(scene), detector, scene.rate_hz)
    off = []
    for k in np.flatnonzero(seen.used):
        line = seen.points_px[k]
        off.append(min(point_error(line[::way], truth[k]) for way in (1, -1)))
    assert len(off) >= 5
    assert np.median(off) > 0.03 * scene.length_px
    assert (np.array(off) < 2.0 * seen.expected_px[seen.used]).all()
    assert not seen.good.any()


def test_a_film_whose_coils_leave_no_body_is_rejected(monkeypatch: pytest.MonkeyPatch) -> None:
    def lost(skeletons: tuple[Skeleton, ...], *_: object) -> CoilFilm:
        away = tuple(no_skeleton(FrameStatus.COIL_ALONE) for _ in skeletons)
        return CoilFilm(away, np.full(len(away), np.nan))

    monkeypatch.setattr("snakewalk.controller.capture.coil_film.solve_coils", lost)
    frames = list(film(replace(SCENE, frames=5)))
    with pytest.raises(UnusableFilmError, match="the body is never completely visible"):
        capture(frames, BodyDetector(empty(SCENE), Polarity.DARK, "given"), SCENE.rate_hz)
