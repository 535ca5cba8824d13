"""Rejections of files that a capture wrote or reads: each remedy is executed."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.controller.capture.capture import Capture, CaptureFile, load_capture, save_capture
from snakewalk.controller.capture.capturing import capture_recording, correct_recording
from snakewalk.controller.capture.film.film_options import CaptureOptions
from snakewalk.controller.capture.film.keypoint_lines import KeypointLines
from snakewalk.controller.capture.part_folder import PartFolder
from snakewalk.controller.capture.review import picture_scale
from snakewalk.controller.track.frame_status import FrameStatus
from tests.helpers import tracker_files
from tests.helpers.film_options import changed, film_options
from tests.oracles.rendered_snake import SnakeScene, film, half_width, true_midlines

SCENE = SnakeScene(rows=100, columns=140, length_px=50.0, frames=20, wave_hz=1.0, rate_hz=15.0)


def true_capture(frames: int = SCENE.frames) -> Capture:
    """The true lines of the first frames of the scene."""
    return Capture(
        points_px=true_midlines(SCENE)[:frames],
        radius_px=np.tile(half_width(SCENE), (frames, 1)),
        length_px=np.full(frames, SCENE.length_px),
        status=(FrameStatus.GOOD,) * frames,
        expected_px=np.full(frames, 0.3),
        distractors=np.zeros(frames),
        margin=np.ones(frames),
        rate_hz=SCENE.rate_hz,
        time_s=np.arange(frames) / SCENE.rate_hz,
        head_by="travel",
        head_sure=0.9,
    )


def drawn(points: list[list[float]]) -> dict[str, Any]:
    return {"redrawn": [{"frame": 3, "points_px": points}]}


LINE = true_midlines(SCENE)[3, ::10].tolist()
CORRECTIONS: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "these corrections belong to another track": ({"track": "another"}, {}),
    "is not there: the track has": ({"left_out": [2, 20]}, {"left_out": [2]}),
    "is listed twice": ({"left_out": [2, 2]}, {"left_out": [2]}),
    "fewer than 2 frames with points stay": (
        {"left_out": [*range(19)]}, {"left_out": [*range(9)]},
    ),
    "px long, the body usually": (drawn([*LINE[:3], [9e3, 9e3]]), drawn(LINE)),
    "it is folded upon": (drawn([[0.0, 0.0], [0.9, 0.0]] * 75), drawn(LINE)),
}  # fmt: skip
"""By words of a rejection: corrections that are rejected, and those of its remedy."""
CORRECTED: dict[str, tuple[dict[str, str], str]] = {
    "works with TRACK.npz of an earlier capture": ({"roi": "1,2,3,4"}, "roi"),
    ": a corrected track ends in": ({"output": "new.csv"}, "output"),
    "is no .npz; give a track that `animal capture` wrote": ({"recording": "c.json"}, "recording"),
    "is not a track that `animal capture` wrote": ({"recording": "other.npz"}, "recording"),
}
"""By words of a rejection: options beside ``--corrections``, and the one that is put right."""


@pytest.fixture
def options(tmp_path: Path) -> CaptureOptions:
    """A track, and a file of corrections that exchanges head and tail in one frame."""
    save_capture(tmp_path / "track.npz", CaptureFile(true_capture(), name="a"))
    np.savez(tmp_path / "other.npz", points=np.zeros((3, 5, 2)))
    write_corrections(tmp_path, {})
    return film_options(
        tmp_path / "track.npz", tmp_path / "new.npz", corrections=tmp_path / "c.json"
    )


def write_corrections(folder: Path, change: dict[str, Any]) -> None:
    track = load_capture(folder / "track.npz").fingerprint
    text = json.dumps({"track": track, "frames": SCENE.frames, "flipped": [15]} | change)
    (folder / "c.json").write_text(text)


def assert_corrected(options: CaptureOptions) -> None:
    before = load_capture(options.recording).captured
    after = load_capture(options.output).captured
    assert np.array_equal(after.points_px[15], before.points_px[15, ::-1])


@pytest.mark.parametrize(
    "words",
    [
        pytest.param(words, marks=pytest.mark.nightly("the search for chords: 15 s of CPU"))
        if words == "it is folded upon"
        else words
        for words in CORRECTIONS
    ],
)
def test_the_remedy_of_a_wrong_correction_makes_a_track(
    words: str, options: CaptureOptions
) -> None:
    folder = options.output.parent
    wrong, remedied = CORRECTIONS[words]
    write_corrections(folder, wrong)
    with pytest.raises(InputError, match=words):
        correct_recording(options)
    assert not options.output.exists()
    write_corrections(folder, remedied)
    facts = correct_recording(options)
    assert facts.frames_left_out == len(remedied.get("left_out", []))
    assert facts.frames_redrawn == len(remedied.get("redrawn", []))
    assert_corrected(options)


@pytest.mark.parametrize("words", CORRECTED)
def test_the_remedy_of_an_option_beside_corrections_makes_a_track(
    words: str, options: CaptureOptions
) -> None:
    folder = options.output.parent
    change, name = CORRECTED[words]
    paths = {key: value if key == "roi" else folder / value for key, value in change.items()}
    wrong = changed(options, **paths)
    with pytest.raises(InputError, match=re.escape(words)):
        correct_recording(wrong)
    correct_recording(changed(wrong, **{name: getattr(options, name)}))
    assert_corrected(options)


def started(folder: Path) -> PartFolder:
    """A folder of a capture that was interrupted after its first part."""
    begun = PartFolder(folder / "t.npz.part", {"threshold": 10.0})
    begun.add(0, true_capture(5))
    return begun


def with_bad_settings(folder: Path) -> PartFolder:
    begun = started(folder)
    (begun.path / "settings.json").write_text("[1")
    return begun


def with_bad_part(folder: Path) -> PartFolder:
    begun = started(folder)
    (begun.path / "00000.npz").write_text("no archive")
    return begun


def of_other_options(folder: Path) -> PartFolder:
    return PartFolder(started(folder).path, {"threshold": 20.0})


def absent(folder: Path) -> PartFolder:
    return PartFolder(folder / "t.npz.part", {})


Start = dict[str, bool]
RESUME, FORCE, PLAIN = ({"resume": a, "force": b} for a, b in ((1, 0), (0, 1), (0, 0)))
PARTS: dict[str, tuple[Callable[[Path], PartFolder], Start, dict[int, Start]]] = {
    "holds an interrupted capture": (started, PLAIN, {1: RESUME, 0: FORCE}),
    "there is nothing to continue": (absent, RESUME, {0: PLAIN}),
    "its capture has other values of": (of_other_options, RESUME, {0: FORCE}),
    "is damaged; start again": (with_bad_settings, RESUME, {0: FORCE}),
    "damaged; start again": (with_bad_part, RESUME, {0: FORCE}),
}
"""By words of a rejection: a folder of parts, the start that is rejected, and by the number of
finished parts that is then used, the starts that its remedies name."""


@pytest.mark.parametrize("words", PARTS)
def test_the_remedies_of_an_interrupted_capture_start_it(words: str, tmp_path: Path) -> None:
    folder_of, wrong, remedies = PARTS[words]
    folder = folder_of(tmp_path)
    with pytest.raises(InputError, match=words):
        folder.start(**wrong)
    for count, remedied in remedies.items():
        assert len(folder.start(**remedied)) == count
        assert folder.path.exists() == (count > 0)


def test_the_same_options_continue_an_interrupted_capture(tmp_path: Path) -> None:
    assert (
        len(PartFolder(of_other_options(tmp_path).path, {"threshold": 10.0}).start(**RESUME)) == 1
    )


PAGE = "a page with pictures of"


def test_a_part_of_a_film_or_of_its_picture_makes_a_page() -> None:
    noise = np.random.default_rng(0).integers(0, 255, (1800, 3200), dtype=np.uint8)
    with pytest.raises(InputError, match=PAGE):
        picture_scale([noise], 9_000, "long")
    assert picture_scale([noise], 1_000, "a part of the film") > 0.0
    assert picture_scale([noise[:60, :80]], 9_000, "--roi") > 0.0


KEYPOINTS = "no frame has a line through its keypoints"


@pytest.mark.slow
def test_the_remedies_of_keypoints_without_a_line_make_a_track(tmp_path: Path) -> None:
    (tmp_path / "film").mkdir()
    for number, frame in enumerate(film(SCENE)):
        cv2.imwrite(str(tmp_path / "film" / f"{number:02d}.png"), frame)
    table = tmp_path / "points.csv"
    points = true_midlines(SCENE)[:, ::10].copy()
    points[::2, 1::2] = np.nan
    points[1::2, ::2] = np.nan
    tracker_files.sleap_csv(table, points, np.full(points.shape[:2], 0.9))
    options = film_options(tmp_path / "film", tmp_path / "t.npz", rate_hz=15.0, keypoints=table)
    with pytest.raises(InputError, match=f"{KEYPOINTS}.*in points.csv.reading.toml"):
        capture_recording(options)
    names = re.findall(r"(\w+)\.x", table.read_text().splitlines()[0])
    (tmp_path / "points.csv.reading.toml").write_text(f"keypoints = {json.dumps(names[::2])}\n")
    assert len(KeypointLines.of(table, (0.0, 0.0)).bodies) == SCENE.frames // 2
    assert capture_recording(options).head_by == "given"
    alone = capture_recording(changed(options, keypoints=None, force=True))
    assert alone.frames_used - alone.frames_rough >= 15
