"""Images of 16 bit keep their depth, and frames of a video the times that it says."""

import struct
from fractions import Fraction
from pathlib import Path

import cv2
import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.controller.capture.capture import load_capture
from snakewalk.controller.capture.capturing import capture_recording
from snakewalk.controller.images.body_detector import make_detector
from snakewalk.controller.images.video import frame_numbers_of, frame_times, in_8_bits, open_footage
from snakewalk.controller.track.choice import Choice
from snakewalk.controller.track.frame_status import FrameStatus
from snakewalk.controller.track.readers.load import load_track
from tests.helpers.film_options import film_options
from tests.oracles.rendered_snake import SnakeScene, empty, film, true_midlines
from tests.oracles.skeleton_accuracy import point_error

SCENE = SnakeScene(rows=210, columns=240, length_px=125.0, frames=8, wave_hz=1.0, noise=0.0)
DIM = 0.012
"""Of the contrast: in 8 bit a body one level above its ground, in 16 bit three hundred."""


def dim_counts(frame: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A camera of 16 bit that sees the scene at a hundredth of its contrast, with its noise."""
    counts = 20000.0 + DIM * 257.0 * frame.astype(float) + rng.normal(0.0, 6.0, frame.shape)
    return np.rint(counts).astype(np.uint16)


@pytest.fixture(scope="module")
def deep(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("deep")
    rng = np.random.default_rng(1)
    for number, frame in enumerate(film(SCENE)):
        cv2.imwrite(str(folder / f"{number}.tif"), dim_counts(frame, rng))
    cv2.imwrite(str(folder.parent / "ground16.png"), dim_counts(empty(SCENE), rng))
    return folder


def test_sixteen_bits_are_kept(deep: Path) -> None:
    footage = open_footage(deep, 30.0)
    assert footage.deep is not None
    frame = next(footage.read())
    assert frame.dtype == np.float32
    raw = cv2.imread(str(deep / "0.tif"), cv2.IMREAD_UNCHANGED)
    back = np.asarray(frame) / footage.deep.gain + footage.deep.black
    assert np.abs(back - raw).max() < 0.51, "every count can be told from the next"
    assert np.ptp(raw // 256) <= 2, "8 bit would hold nothing"
    assert 0.0 < frame.min() < frame.max() < 255.0
    shown = in_8_bits(frame)
    assert shown.dtype == np.uint8
    assert np.abs(shown.astype(float) - frame).max() <= 0.5
    background = footage.image(deep.parent / "ground16.png")
    found = make_detector(footage.spread(8), background).detect(frame)
    assert found.skeleton.status is FrameStatus.GOOD
    line = found.skeleton.points_px
    truth = true_midlines(SCENE)[0]
    assert min(point_error(line[::way], truth) for way in (1, -1)) < 0.01 * SCENE.length_px


def test_a_deep_film_is_captured_and_a_threshold_is_in_its_own_counts(
    deep: Path, tmp_path: Path
) -> None:
    facts = capture_recording(
        film_options(
            deep, tmp_path / "t.npz", rate_hz=30.0, background=deep.parent / "ground16.png",
            threshold=150.0, sheet=tmp_path / "s.png", steps=tmp_path / "steps.png",
            overlay=tmp_path / "o.avi", review=tmp_path / "r.html",
        )
    )  # fmt: skip
    assert facts.verdicts == {str(FrameStatus.ROUGH): 8}, "a film of 8 frames"
    assert cv2.imread(str(tmp_path / "s.png")).max() > 200


def test_images_of_8_bit_stay_whole_numbers(tmp_path: Path) -> None:
    cv2.imwrite(str(tmp_path / "0.png"), next(film(SCENE)))
    footage = open_footage(tmp_path, 30.0)
    assert footage.deep is None
    assert next(footage.read()).dtype == np.uint8


def test_times_of_an_even_rate_are_that_rate_s_and_uneven_ones_are_kept() -> None:
    rounded = np.rint(1000.0 * np.arange(300) / 30.0) / 1000.0
    time_s, rate_hz = frame_times(rounded.tolist(), 30.0)
    assert rate_hz == 30.0
    assert np.array_equal(time_s, np.arange(300) / 30.0)
    time_s, rate_hz = frame_times((1.0 + np.arange(300) / 25.0).tolist(), 30.0)
    assert rate_hz == pytest.approx(25.0)
    assert time_s[-1] == pytest.approx(299 / 25.0)
    uneven = np.cumsum(np.random.default_rng(0).uniform(0.02, 0.06, 300))
    time_s, rate_hz = frame_times(uneven.tolist(), 30.0)
    assert np.allclose(time_s, uneven - uneven[0])
    assert rate_hz == pytest.approx(1.0 / np.median(np.diff(uneven)))
    for none in ([float("nan")] * 5, [0.0] * 5, [0.0, 2.0, 1.0]):
        time_s, rate_hz = frame_times(none, 30.0)
        assert np.array_equal(time_s, np.arange(len(none)) / 30.0)


def test_a_film_of_variable_rate_becomes_a_track_with_its_times(tmp_path: Path) -> None:
    av = pytest.importorskip("av", reason="the extra view is not installed")
    path = tmp_path / "phone.mp4"
    at_ms = np.array([0, 20, 75, 95, 150, 170, 225, 245])
    with av.open(str(path), "w") as made:
        stream = made.add_stream("mpeg4", rate=30)
        stream.width, stream.height, stream.pix_fmt = 240, 210, "yuv420p"
        stream.time_base = stream.codec_context.time_base = Fraction(1, 1000)
        for frame, pts in zip(film(SCENE), at_ms, strict=True):
            shot = av.VideoFrame.from_ndarray(frame, format="gray").reformat(format="yuv420p")
            shot.pts, shot.time_base = int(pts), Fraction(1, 1000)
            made.mux(stream.encode(shot))
        made.mux(stream.encode())
    cv2.imwrite(str(tmp_path / "ground.png"), empty(SCENE))
    options = film_options(path, tmp_path / "t.npz", background=tmp_path / "ground.png")
    facts = capture_recording(options)
    assert not facts.rate_assumed
    held = load_capture(tmp_path / "t.npz").captured
    assert np.allclose(held.time_s, 1e-3 * at_ms)
    track = load_track(str(tmp_path / "t.npz"))
    assert track.uneven
    assert track.time_s[-1] == pytest.approx(0.245, abs=0.5 / track.rate_hz)
    assert not load_track(str(tmp_path / "t.npz"), Choice(rate=30.0)).uneven


def test_all_pages_of_a_stack_are_frames(tmp_path: Path) -> None:
    pages = [np.full((20, 30), value, dtype=np.uint8) for value in (10, 60, 110, 160)]
    stack = tmp_path / "stack.tif"
    assert cv2.imwritemulti(str(stack), pages)
    footage = open_footage(stack, 5.0)
    assert footage.count == 4
    assert [int(frame[0, 0]) for frame in footage.read()] == [10, 60, 110, 160]
    folder = tmp_path / "folder"
    folder.mkdir()
    for number in (1, 2):
        cv2.imwritemulti(str(folder / f"{number}.tif"), [p + np.uint8(number) for p in pages])
    both = open_footage(folder)
    assert [int(f[0, 0]) for f in both.read()] == [11, 61, 111, 161, 12, 62, 112, 162]
    assert both.missing == 0
    deep = tmp_path / "deep.tif"
    assert cv2.imwritemulti(str(deep), [p.astype(np.uint16) * 16 for p in pages])
    levels = [float(frame[0, 0]) for frame in open_footage(deep).read()]
    assert np.allclose(np.diff(levels), levels[1] - levels[0])
    assert levels[1] > levels[0]


def test_missing_numbers_are_counted_and_keep_their_time(tmp_path: Path) -> None:
    for number in (8, 9, 10, 13, 14):
        cv2.imwrite(str(tmp_path / f"shot_{number}.png"), np.full((20, 30), number, np.uint8))
    footage = open_footage(tmp_path, 10.0)
    assert footage.missing == 2
    assert [at for _, at in footage.timed()] == pytest.approx([0.0, 0.1, 0.2, 0.5, 0.6])
    even = [Path(f"{number:03}.png") for number in range(0, 60, 10)]
    assert frame_numbers_of(even) is None
    assert frame_numbers_of([*even[:3], Path("other.png")]) is None


@pytest.mark.parametrize("height", [None, 2_000_000])
def test_an_image_that_is_empty_or_says_too_many_rows_is_one_line(
    height: int | None, tmp_path: Path
) -> None:
    for k in range(2):
        cv2.imwrite(str(tmp_path / f"{k}.bmp"), np.zeros((4, 4, 3), np.uint8))
    whole = (tmp_path / "1.bmp").read_bytes()
    broken = b"" if height is None else whole[:22] + struct.pack("<i", height) + whole[26:]
    (tmp_path / "1.bmp").write_bytes(broken)
    with pytest.raises(InputError, match=r"1\.bmp: is not a readable image"):
        list(open_footage(tmp_path).read())
