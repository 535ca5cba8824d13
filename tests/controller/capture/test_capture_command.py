"""``snakewalk animal capture``: films in, a track out; bad input in one line."""

import json
import os
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.controller.capture.capturing import capture_recording
from snakewalk.controller.capture.film.scale import scale_of_marker
from snakewalk.controller.capture.plots.capture import trail_picture
from snakewalk.controller.capture.recording import examine
from snakewalk.controller.images.silhouette import Polarity
from snakewalk.controller.images.video import open_footage
from snakewalk.controller.track.analysis import analyse
from snakewalk.controller.track.frame_status import FrameStatus
from snakewalk.controller.track.readers.arrays import save_track
from snakewalk.controller.track.readers.load import load_track
from tests.helpers.command import snakewalk
from tests.helpers.film_options import changed, film_options
from tests.oracles.rendered_snake import SnakeScene, empty, film, true_midlines

SCENE = SnakeScene(rows=160, columns=200, length_px=70.0, frames=12, wave_hz=1.0, rate_hz=15.0)


def write_film(path: Path, frames: Iterable[np.ndarray]) -> Path:
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 15.0, (200, 160))
    for frame in frames:
        writer.write(cv2.cvtColor(frame, cv2.COLOR_GRAY2BGR))
    writer.release()
    return path


@pytest.fixture(scope="module")
def swim(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_film(tmp_path_factory.mktemp("films") / "swim.avi", film(SCENE))


@pytest.mark.nightly("a further film: 4 s of CPU")
def test_a_trail_holds_the_darkest_value_of_each_pixel(swim: Path, tmp_path: Path) -> None:
    trail = tmp_path / "trail.png"
    done = snakewalk(
        "animal",
        "capture",
        str(swim),
        "-o",
        str(tmp_path / "t.npz"),
        "--trail",
        str(trail),
        "--json",
    )
    assert done.returncode == 1, done.stderr
    assert json.loads(done.stdout)["animal"] == "dark"
    frames = np.stack([np.asarray(one) for one in open_footage(swim).read()])
    darkest = np.broadcast_to(frames.min(axis=0).reshape(160, 200, -1), (160, 200, 3))
    drawn = cv2.imread(str(trail))
    same = (drawn == darkest).all(axis=2)
    assert 0.9 < same.mean() < 1.0  # skeletons cover the rest
    shadow = np.median(drawn) - darkest.mean(axis=2) > 30.0
    assert (shadow & same).sum() > 100  # and the animal is around them
    done = snakewalk(
        "animal",
        "capture",
        str(swim),
        "-o",
        str(tmp_path / "u.npz"),
        "--cropped",
        "--trail",
        str(trail),
    )
    assert done.returncode == 2
    assert "--cropped and --trail" in done.stderr


@pytest.mark.parametrize("polarity", list(Polarity))
def test_a_trail_shows_dark_and_light_animals(polarity: Polarity, tmp_path: Path) -> None:
    frames = np.full((5, 40, 60), 100, np.uint8)
    for k in range(5):
        frames[k, 5:9, 10 * k : 10 * k + 8] = 20
        frames[k, 30:34, 10 * k : 10 * k + 8] = 220
    used = np.ones(5, bool)
    captured = SimpleNamespace(used=used, points_px=np.tile([[1.0, 20.0], [9.0, 20.0]], (5, 1, 1)))
    trail_picture(tmp_path / "t.png", iter(frames), captured, polarity)  # type: ignore[arg-type]
    drawn = cv2.imread(str(tmp_path / "t.png"))[..., 0]
    dark, light = polarity is not Polarity.LIGHT, polarity is not Polarity.DARK
    assert (drawn[6, 12:18] == (20 if dark else 100)).all()
    assert (drawn[31, 12:18] == (220 if light else 100)).all()


@pytest.mark.costs("a film from its frames to the pictures")
def test_a_film_becomes_a_track_with_sheet_and_overlay(swim: Path, tmp_path: Path) -> None:
    track, sheet, overlay = (tmp_path / name for name in ("t.npz", "s.png", "o.avi"))
    done = snakewalk(
        "animal", "capture", str(swim), "-o", str(track), "--length-m", "0.35",
        "--sheet", str(sheet), "--overlay", str(overlay), "--json",
    )  # fmt: skip
    assert done.returncode == 1, "a film of 12 frames has no good frame"
    facts = json.loads(done.stdout)
    assert facts["frames"] == facts["frames_used"] == 12
    assert facts["verdicts"] == {str(FrameStatus.ROUGH): 12}, "a film of 12 frames"
    assert "fewer than 20 frames" in facts["warning"]
    assert facts["length_m"] == pytest.approx(0.35)
    loaded = load_track(str(track))
    assert loaded.rate_hz == 15.0
    assert loaded.length_m == pytest.approx(0.35, rel=0.02)
    truth = true_midlines(SCENE) * [1.0, -1.0]
    step = -np.diff(truth, axis=1)
    angles = np.unwrap(np.arctan2(step[..., 1], step[..., 0]), axis=1)
    error = np.angle(np.exp(1j * (loaded.angles_rad - angles)))
    assert np.median(np.abs(error)) < 0.08
    with np.load(track) as held:
        assert held["verdict"].tolist() == [str(FrameStatus.ROUGH)] * 12
        assert held["points_px"].shape == (12, 101, 2)
        assert held["head_margin"].shape == (12,)
    sheet_px = cv2.imread(str(sheet)).shape
    assert sheet_px[1:] == (1200, 3)
    assert sheet_px[0] <= 2 * (200 + 30), "two rows, with a status below each"
    assert open_footage(overlay).count == 12
    assert sorted(p.name for p in tmp_path.iterdir()) == ["o.avi", "s.png", "t.npz"]


@pytest.mark.slow
def test_nothing_is_overwritten_without_force(tmp_path: Path) -> None:
    swim = write_film(tmp_path / "short.avi", film(replace(SCENE, frames=6)))
    track = tmp_path / "t.npz"
    track.write_bytes(b"mine")
    with pytest.raises(InputError, match=r"t\.npz: exists; --force overwrites it"):
        capture_recording(film_options(swim, track))
    assert track.read_bytes() == b"mine"
    capture_recording(film_options(swim, track, force=True))
    assert load_track(str(track)).frames == 6


def test_a_fault_leaves_nothing_behind(swim: Path, tmp_path: Path) -> None:
    folder = tmp_path / "out"
    folder.mkdir()
    whole = swim.read_bytes()
    cut = tmp_path / "cut.avi"
    cut.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(InputError, match=r"ends after \d+ of 12 frames"):
        capture_recording(film_options(cut, folder / "t.npz"))
    assert list(folder.iterdir()) == []


@pytest.fixture
def same_scheduling() -> Iterator[None]:
    """SVT-AV1 gives a superuser's process real-time priority, above all others, and keeps it."""
    before = os.sched_getscheduler(0), os.sched_getparam(0)
    yield
    os.sched_setscheduler(0, *before)


@pytest.mark.usefixtures("same_scheduling")
def test_a_codec_that_opencv_lacks_is_read_by_pyav(tmp_path: Path) -> None:
    av = pytest.importorskip("av", reason="the extra view is not installed")
    path = tmp_path / "swim.mp4"
    wanted = list(film(replace(SCENE, frames=4)))
    try:
        with av.open(str(path), "w") as made:
            stream = made.add_stream(
                "libsvtav1", rate=25, options={"svtav1-params": "enable-tpl-la=0"}
            )
            stream.width, stream.height, stream.pix_fmt = 200, 160, "yuv420p"
            for frame in wanted:
                made.mux(stream.encode(av.VideoFrame.from_ndarray(frame, format="gray")))
            made.mux(stream.encode())
    except (av.error.FFmpegError, ValueError):
        pytest.skip("this PyAV encodes no AV1")
    footage = open_footage(path)
    assert (footage.count, footage.rate_hz, footage.rate_assumed) == (4, 25.0, False)
    by_av = replace(footage, decoded_by_av=True)
    for seen, frame in zip(by_av.read(), wanted, strict=True):
        grey = seen if seen.ndim == 2 else seen.mean(axis=2)
        assert np.abs(grey.astype(float) - frame).mean() < 12.0
    assert len(by_av.spread(2)) == 2
    with pytest.raises(InputError, match="ends after 4 of 40 frames"):
        list(replace(by_av, count=40).read())
    if not cv2.VideoCapture(str(path)).read()[0]:
        assert footage.decoded_by_av


def test_a_folder_of_images_is_taken_in_the_order_of_its_numbers(tmp_path: Path) -> None:
    for number, frame in enumerate(film(SCENE)):
        cv2.imwrite(str(tmp_path / f"frame{number}.png"), frame)
    (tmp_path / "notes.txt").write_text("not an image")
    footage = open_footage(tmp_path, 25.0)
    assert footage.count == 12
    assert footage.rate_hz == 25.0
    assert [f.name for f in footage.files][:3] == ["frame0.png", "frame1.png", "frame2.png"]
    assert footage.files[-1].name == "frame11.png"
    assert np.array_equal(next(footage.read()), next(film(SCENE)))


@pytest.mark.slow
def test_a_given_background_is_used(swim: Path, tmp_path: Path) -> None:
    ground = tmp_path / "ground.png"
    cv2.imwrite(str(ground), empty(SCENE))
    facts = capture_recording(film_options(swim, tmp_path / "t.npz", background=ground))
    assert facts.background == "given"
    assert facts.frames_used == 12


def test_markers_give_the_scale(tmp_path: Path) -> None:
    family = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    image = np.full((200, 300), 230, dtype=np.uint8)
    image[60:120, 80:140] = cv2.aruco.generateImageMarker(family, 7, 60)
    assert scale_of_marker("0.05", image) == pytest.approx(0.05 / 60.0, rel=0.02)
    assert scale_of_marker("10,20,40,60,0.2", image) == pytest.approx(0.2 / 50.0)
    for wrong in ("", "big", "0", "-1", "1,2,3", "5,5,5,5,1", "nan"):
        with pytest.raises(InputError, match="--marker"):
            scale_of_marker(wrong, image)
    with pytest.raises(InputError, match="no ArUco or AprilTag marker"):
        scale_of_marker("0.05", image[:, 150:])


@pytest.mark.slow
def test_the_steps_show_the_animal_as_large_as_the_panel(tmp_path: Path) -> None:
    """It was 64 of 300 pixels wide in a film of the whole arena, under its own dots."""
    arena = tmp_path / "arena"
    arena.mkdir()
    for number, frame in enumerate(film(replace(SCENE, rows=240, columns=480, frames=4))):
        cv2.imwrite(str(arena / f"{number}.png"), frame)
    steps = tmp_path / "steps.png"
    capture_recording(film_options(arena, tmp_path / "t.npz", rate_hz=30.0, steps=steps))
    sheet = cv2.imread(str(steps), cv2.IMREAD_GRAYSCALE)
    assert sheet is not None
    high, wide = sheet.shape
    panel = sheet[: high - 18, 308:608]
    assert wide == 5 * 300 + 4 * 8
    assert panel.any(axis=0).sum() > 0.6 * panel.shape[1]


def test_help_has_an_example() -> None:
    done = snakewalk("animal", "capture", "--help")
    assert done.returncode == 0
    assert "snakewalk animal capture film.mp4" in " ".join(done.stdout.split())


def test_bad_files_end_with_exit_code_2_and_one_line(tmp_path: Path) -> None:
    junk = tmp_path / "junk.mp4"
    junk.write_bytes(b"no film" * 50)
    done = snakewalk("animal", "capture", str(junk), "-o", str(tmp_path / "t.npz"))
    assert done.returncode == 2
    told = [line for line in done.stderr.splitlines() if line.strip()]
    assert len(told) == 1
    assert "junk.mp4: OpenCV cannot read a frame" in told[0]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"recording": "absent.mp4"}, "absent.mp4: no such video"),
        ({"recording": "empty.mp4"}, "is an empty file"),
        ({"recording": "bare"}, "holds no images"),
        ({"output": "track.txt"}, "a track ends in .npz, .csv, .wcon"),
        ({"output": "no/folder/t.npz"}, "no/folder: no such folder"),
        ({"overlay": "o.gif"}, "an overlay film ends in"),
        ({"sheet": "s.doc"}, "a picture ends in"),
        ({"length_m": 0.2, "marker": "0.05"}, "leave one out"),
        ({"rate_hz": 0.0}, "frame rate must be above 0"),
        ({"head": "left"}, "expected X,Y"),
        ({"head": "200,10"}, "outside the images, which have 200 x 160 pixels"),
        ({"head": "10,-1"}, "outside the images"),
        ({"head": "5,5", "roi": "40,30,120,100"}, "outside --roi and --mask"),
        ({"background": "junk.png"}, "is not a readable image"),
    ],
)
def test_bad_options_are_told_before_any_work(
    swim: Path, tmp_path: Path, change: dict[str, object], said: str
) -> None:
    (tmp_path / "empty.mp4").touch()
    (tmp_path / "junk.png").write_bytes(b"junk")
    (tmp_path / "bare").mkdir()
    paths = {"recording", "output", "overlay", "sheet", "background"}
    given = {k: tmp_path / str(v) if k in paths else v for k, v in change.items()}
    options = changed(film_options(swim, tmp_path / "t.npz"), **given)  # type: ignore[arg-type]
    with pytest.raises(InputError, match=said):
        capture_recording(options)
    assert not (tmp_path / "t.npz").exists()


@pytest.mark.nightly("a further film: 4 s of CPU")
def test_grey_frames_of_a_colour_film_are_as_large_as_the_others(tmp_path: Path) -> None:
    """Some frames of a colour film are exactly grey: they become two-dimensional arrays."""
    folder = tmp_path / "film"
    folder.mkdir()
    for number, frame in enumerate(film(SCENE)):
        coloured = np.dstack([frame] * 3)
        if number % 2:
            coloured[0, 0] = (0, 10, 20)
        cv2.imwrite(str(folder / f"{number}.png"), coloured)
    options = film_options(folder, tmp_path / "t.npz", rate_hz=15.0, roi="2,2,190,150")
    facts = capture_recording(options)
    assert facts.frames_used == SCENE.frames
    assert facts.head_by == "travel"


@pytest.mark.nightly("a further film: 6 s of CPU")
def test_a_track_of_cropped_images_says_that_it_contains_no_travel(
    swim: Path, tmp_path: Path
) -> None:
    fixed, cropped = (tmp_path / name for name in ("fixed.npz", "cropped.npz"))
    assert capture_recording(film_options(swim, fixed)).places_recorded
    assert not capture_recording(film_options(swim, cropped, cropped=True)).places_recorded
    found = analyse(load_track(str(cropped)))
    assert found.travel is None
    assert found.sliding is None
    assert found.travel_unknown_reason == "places are not recorded"
    assert analyse(load_track(str(fixed))).travel_unknown_reason != "places are not recorded"
    again = tmp_path / "again.npz"
    save_track(again, load_track(str(cropped)))
    assert not load_track(str(again)).places_recorded
    assert load_track(str(again)).head_sure == load_track(str(cropped)).head_sure


@pytest.mark.nightly("a further film: 3 s of CPU")
def test_a_head_that_is_not_sure_is_a_warning(
    swim: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(
        "snakewalk.controller.capture.stages.head.head_end", lambda *_, **__: (0.19, "taper")
    )
    track = tmp_path / "t.npz"
    facts = capture_recording(film_options(swim, track))
    assert facts.head_sure == 0.19
    assert facts.warning is not None
    assert facts.warning in caplog.text
    assert "head and tail may be exchanged" in facts.warning
    assert examine(str(track)).facts["head_sure"] == 0.19
