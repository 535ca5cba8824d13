"""Long films: captured in parts, with bounded memory, and continued after an interruption."""

import tracemalloc
import weakref
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from snakewalk.config.arrays import DeepImage, Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.capture import capturing, film_parts, image_file
from snakewalk.controller.capture.capture import Capture, CaptureFile, load_capture, save_capture
from snakewalk.controller.capture.capturing import capture_recording
from snakewalk.controller.capture.detections import Detections
from snakewalk.controller.capture.film.film_options import CaptureOptions
from snakewalk.controller.capture.film_parts import FilmParts
from snakewalk.controller.capture.image_file import ImageFile, large_array, scaled
from snakewalk.controller.capture.part_folder import PartFolder
from snakewalk.controller.capture.several.animal_films import (
    capture_animals,
    films_of,
    find_animals,
)
from snakewalk.controller.images.body_detector import BodyDetector, Detection, make_detector
from snakewalk.controller.images.silhouette import Polarity
from snakewalk.controller.track.frame_status import FrameStatus
from tests.helpers.film_options import changed, film_options
from tests.oracles.drawn_larva import GROUND, larva
from tests.oracles.rendered_snake import SnakeScene, empty, film, true_midlines
from tests.oracles.skeleton_accuracy import point_error

SCENE = SnakeScene(rows=210, columns=240, length_px=125.0, frames=36, wave_hz=1.0)


@pytest.fixture(scope="module")
def frames(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of images."""
    folder = tmp_path_factory.mktemp("frames")
    for number, frame in enumerate(film(SCENE)):
        cv2.imwrite(str(folder / f"{number}.png"), frame)
    cv2.imwrite(str(folder.with_name("ground.png")), empty(SCENE))
    return folder


def options_of(frames: Path, folder: Path) -> CaptureOptions:
    """Options with a known background, which need no time to learn it."""
    ground = frames.with_name("ground.png")
    return film_options(frames, folder / "t.npz", rate_hz=30.0, background=ground)


@pytest.fixture
def short_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    """Parts of 10 frames."""
    monkeypatch.setattr(capturing, "PART_FRAMES", 10)


@pytest.mark.slow
@pytest.mark.usefixtures("short_parts")
def test_an_interrupted_capture_is_continued(
    frames: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[int] = []
    add, most = FilmParts.add, [10**6]

    def counted(self: FilmParts, frame: DeepImage, detection: Detection, at_s: float) -> None:
        if len(seen) == most[0]:
            raise KeyboardInterrupt
        seen.append(0)
        add(self, frame, detection, at_s)

    monkeypatch.setattr(FilmParts, "add", counted)
    options = options_of(frames, tmp_path)
    capture_recording(options)
    plain = load_capture(options.output)
    assert not (tmp_path / "t.npz.part").exists()
    options.output.unlink()

    seen.clear()
    most[0] = 25
    with pytest.raises(KeyboardInterrupt) as stop:
        capture_recording(options)
    assert "continue by --resume" in stop.value.__notes__[0]
    assert not options.output.exists()
    with pytest.raises(InputError, match="holds an interrupted capture; continue it with --resume"):
        capture_recording(options)
    with pytest.raises(InputError, match="its capture has other values of threshold"):
        capture_recording(changed(options, resume=True, threshold=20.0))

    seen.clear()
    most[0] = 10**6
    capture_recording(changed(options, resume=True))
    assert len(seen) == 16, "two parts of 10 frames were finished"
    assert load_capture(options.output).fingerprint == plain.fingerprint
    assert not (tmp_path / "t.npz.part").exists()
    options.output.unlink()
    with pytest.raises(InputError, match="there is nothing to continue; leave --resume out"):
        capture_recording(changed(options, resume=True))


@pytest.mark.slow
def test_a_resting_larva_has_the_same_line_after_an_interruption(tmp_path: Path) -> None:
    """Frames before the part that is continued show its tail more clearly."""
    frames = [larva(0.0, number, tail_levels=20.0) for number in range(26)]
    ground = np.full_like(frames[0], round(GROUND))
    detector = BodyDetector(ground, Polarity.DARK, "given")
    animals = find_animals(frames, frames, detector, requested_count=1, name="larva")

    def captured(folder: Path, on_progress: Callable[[], None], *, resume: bool) -> Floats:
        parts = PartFolder(folder, {})
        films = films_of(animals, 30.0, "larva", parts, resume=resume, part_frames=10)
        assert films[0].done_frames == 10 * resume
        (animal,) = capture_animals(
            lambda first: frames[first:], detector, animals, films, on_progress=on_progress
        )
        assert animal.captured is not None
        return animal.captured.points_px

    steps = iter(range(15))

    def interrupt() -> None:
        if next(steps, None) is None:
            raise KeyboardInterrupt

    complete = captured(tmp_path / "complete.part", lambda: None, resume=False)
    folder = tmp_path / "interrupted.part"
    with pytest.raises(KeyboardInterrupt):
        captured(folder, interrupt, resume=False)
    assert np.array_equal(captured(folder, lambda: None, resume=True), complete, equal_nan=True)


@pytest.mark.nightly("a further film: 3 s of CPU")
@pytest.mark.usefixtures("short_parts")
def test_parts_are_joined_with_the_head_first_in_all(frames: Path, tmp_path: Path) -> None:
    facts = capture_recording(options_of(frames, tmp_path))
    assert facts.frames_used == 36
    held = load_capture(tmp_path / "t.npz").captured
    truth = true_midlines(SCENE)
    assert max(point_error(held.points_px[k], truth[k]) for k in range(36)) < 2.0
    assert held.head_by == "travel"
    assert held.margin.min() > 0.1
    assert np.allclose(held.time_s, np.arange(36) / 30.0)


def test_a_part_without_the_animal_has_no_points() -> None:
    ground = empty(SCENE)
    detector = make_detector([ground], ground)
    parts = FilmParts(30.0, 36, "film", part_frames=8)
    for k, image in enumerate(film(SCENE)):
        shown = ground if 10 <= k < 28 else image
        parts.add(shown, replace(detector, polarity=Polarity.DARK).detect(shown))
    captured = parts.done()
    assert len(captured.status) == 36
    assert captured.used[:10].all()
    assert captured.used[28:].all()
    assert not captured.used[10:28].any()


@pytest.mark.costs("a film in parts")
def test_frames_of_finished_parts_do_not_stay_in_memory() -> None:
    """The second half of a film keeps no more frames alive than the first."""
    ground = empty(SCENE)
    detector = replace(make_detector([ground], ground), polarity=Polarity.DARK)
    images = list(film(SCENE))[:24]
    parts = FilmParts(30.0, len(images), "film", part_frames=4)
    frames: list[weakref.ref[DeepImage]] = []
    alive = []
    for image in images:
        shown = image.copy()
        frames.append(weakref.ref(shown))
        parts.add(shown, detector.detect(shown))
        del shown
        alive.append(sum(one() is not None for one in frames))
    half = len(alive) // 2
    assert max(alive[half:]) <= max(alive[:half]) <= 8
    assert len(parts.finished) >= 3


@pytest.mark.nightly("a further film: 3 s of CPU")
def test_a_finished_part_leaves_no_points_in_memory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each further frame needs less memory than a fifth of its points."""

    def part_of(found: Detections, rate_hz: float, **_: object) -> Capture:
        count = len(found.skeletons)
        shifted = np.arange(101.0)[:, None] + np.arange(count, dtype=float)[:, None, None]
        return Capture(
            points_px=np.repeat(shifted, 2, axis=2),
            radius_px=np.full((count, 101), 3.0),
            length_px=np.full(count, 141.4),
            status=(FrameStatus.GOOD,) * count,
            expected_px=np.full(count, 0.5),
            distractors=np.zeros(count),
            margin=np.ones(count),
            rate_hz=rate_hz,
            time_s=np.arange(count) / rate_hz,
            head_by="travel",
            head_sure=0.9,
        )

    monkeypatch.setattr(film_parts, "captured_from", part_of)

    def peak_bytes(frames: int) -> int:
        folder = PartFolder(tmp_path / f"{frames}.part", {})
        parts = FilmParts(30.0, frames, "film", folder=folder, part_frames=500)
        tracemalloc.start()
        for _ in range(frames):
            parts.skip(FrameStatus.NOTHING)
        captured = parts.done()
        _, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        save_capture(tmp_path / "film.npz", CaptureFile(captured, "film", m_per_px=0.5))
        held = load_capture(tmp_path / "film.npz").captured
        assert (held.points_px[:, 3, 0] - 3.0 == np.arange(frames) % 1500).all()
        return peak

    more = (peak_bytes(6000) - peak_bytes(3000)) / 3000
    assert more < 101 * 2 * 8 / 5


def test_large_arrays_lie_in_a_file_and_keep_their_values(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    points = np.random.default_rng(1).normal(size=(1100, 3, 2))
    wanted = points * [2.0, -2.0] + [0.0, 5.0]
    assert (scaled(points, (2.0, -2.0), (0.0, 5.0), None) == wanted).all()
    monkeypatch.setattr(image_file, "IN_MEMORY_BYTES", 0)
    tracemalloc.start()
    large = large_array((200_000, 2), tmp_path)
    assert tracemalloc.get_traced_memory()[1] < 200_000
    tracemalloc.stop()
    large[:] = 1.5
    assert large.sum() == 600_000.0
    assert (scaled(points, (2.0, -2.0), (0.0, 5.0), tmp_path) == wanted).all()
    assert not list(tmp_path.iterdir()), "the file has no name"


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
@pytest.mark.parametrize("shape", [(5, 7), (5, 7, 3)])
def test_an_image_file_keeps_every_bit(dtype: type, shape: tuple[int, ...]) -> None:
    chance = np.random.default_rng(2)
    images = [(chance.random(shape) * 250.0).astype(dtype) for _ in range(3)]
    file = ImageFile()
    stored = [file.add(one) for one in images]
    for one, image in zip(stored[::-1], images[::-1], strict=True):
        read = file.read(one)
        assert read.dtype == image.dtype
        assert (read == image).all()


@pytest.mark.slow
def test_a_film_of_fewer_than_20_frames_has_no_good_frame() -> None:
    scene = replace(SCENE, frames=20)
    detector = make_detector(list(film(scene)), empty(scene))
    statuses = []
    for count in (20, 19):
        parts = FilmParts(30.0, count, "film")
        for frame in list(film(scene))[:count]:
            parts.add(frame, detector.detect(frame))
        captured = parts.done()
        statuses.append(set(captured.status))
        expected = captured.expected_px / captured.length_px
    assert statuses == [{FrameStatus.GOOD}, {FrameStatus.ROUGH}]
    assert np.nanmin(expected) >= 0.01
