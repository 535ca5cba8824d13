"""A film that is rejected, or of which a third is lost: options are tried on some frames."""

import ast
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

import snakewalk.controller.capture as package
from snakewalk.config.arrays import Floats, Image
from snakewalk.config.errors import InputError
from snakewalk.controller.capture.capture import RejectedFilmError, captured_from
from snakewalk.controller.capture.capturing import CaptureFacts, capture_recording
from snakewalk.controller.capture.detections import Detections
from snakewalk.controller.capture.film.film_options import CaptureOptions
from snakewalk.controller.capture.film.scale import scale_of_marker
from snakewalk.controller.capture.film_parts import joined
from snakewalk.controller.capture.opened_film import open_film
from snakewalk.controller.capture.options import check_options, places_of
from snakewalk.controller.capture.part_folder import FinishedPart
from snakewalk.controller.capture.several.recording import AnimalsFacts, capture_several
from snakewalk.controller.capture.verification.remedies import capture_film, captures, remedy
from snakewalk.controller.images.body_detector import make_detector
from tests.controller.capture.test_remedies_of_files import (
    CORRECTED,
    CORRECTIONS,
    KEYPOINTS,
    PAGE,
    PARTS,
)
from tests.helpers.film_options import changed, film_options
from tests.oracles.rendered_snake import SnakeScene, empty, film, true_midlines

SCENE = SnakeScene(rows=100, columns=140, length_px=50.0, frames=20, wave_hz=1.0, rate_hz=15.0)


def with_hand(frames: Iterator[Image]) -> Iterator[Image]:
    """A large dark thing moves beside the animal."""
    rng = np.random.default_rng(3)
    for number, frame in enumerate(frames):
        wide = np.full((100, 230), 170, np.uint8)
        wide[:, :140] = frame
        top = 20 + round(18 * np.sin(number))
        wide[top : top + 45, 160:215] = 40
        yield np.clip(wide + rng.normal(0.0, 2.0, wide.shape), 0, 255).astype(np.uint8)


def folder_of(frames: Iterator[Image], folder: Path) -> CaptureOptions:
    (folder / "film").mkdir()
    for number, frame in enumerate(frames):
        cv2.imwrite(str(folder / "film" / f"{number:02d}.png"), frame)
    return film_options(folder / "film", folder / "t.npz", rate_hz=15.0)


@pytest.mark.slow
def test_the_command_that_captures_more_is_printed_with_its_contact_sheet(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    options = folder_of(with_hand(film(SCENE)), tmp_path)
    words = ["animal", "capture", str(options.recording), "--rate", "15", "--length-m", "0.4"]
    monkeypatch.setattr("sys.argv", ["snakewalk", *words])
    with pytest.raises(RejectedFilmError) as rejected:
        capture_film(options)
    said = re.search(rf"try: snakewalk {' '.join(words)} --roi (\S+)$", str(rejected.value))
    assert said, rejected.value
    assert cv2.imread(str(tmp_path / "t-tried.png")) is not None
    (animal,) = captures(capture_film(changed(options, roi=said[1])))
    assert animal is not None
    assert animal.frames_used - animal.frames_rough == 20


@pytest.mark.slow
def test_a_film_that_no_option_helps_names_none(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level("INFO")
    blank = (np.full((60, 80), 128, np.uint8) for _ in range(20))
    options = folder_of(blank, tmp_path)
    assert remedy(options) is None
    assert "film: trying other options on 20 frames" in caplog.text
    assert not (tmp_path / "t-tried.png").exists()


def turning(amplitude_rad: float) -> Floats:
    """(20, 101, 2) midlines of a rigid body that turns to and fro about its middle."""
    line = true_midlines(replace(SCENE, frames=60))[30]
    middle = line.mean(axis=0)
    angle = amplitude_rad * np.sin(np.arange(SCENE.frames))
    cos, sin = np.cos(angle), np.sin(angle)
    turns = np.stack([np.stack([cos, -sin], axis=1), np.stack([sin, cos], axis=1)], axis=1)
    return np.asarray((line - middle) @ turns.transpose(0, 2, 1) + middle)


def on_pattern(texture: float, amplitude_rad: float) -> list[Image]:
    return list(film(replace(SCENE, texture=texture), turning(amplitude_rad)))


def moved_rings() -> Floats:
    """(20, 101, 2) midlines of a body that lies in a ring, and is moved."""
    turn = np.linspace(0.0, 2.1 * np.pi, 101)
    ring = 8.0 * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    return np.stack([ring + np.array([30.0 + 4.0 * k, 50.0]) for k in range(SCENE.frames)])


def with_ball(frames: Iterator[Image]) -> Iterator[Image]:
    """A round object, much larger than the animal, moves beside it."""
    for number, frame in enumerate(frames):
        high = np.vstack([frame, empty(SCENE)])
        cv2.circle(high, (20 + 5 * number, 150), 14, 60, -1)
        yield np.asarray(cv2.GaussianBlur(high, (3, 3), 0.8), np.uint8)


def with_company(frames: Iterator[Image]) -> Iterator[Image]:
    """From the fourth of 16 frames on, an animal of the same size moves beside the first."""
    for number, frame in zip(range(16), frames, strict=False):
        other = frame[::-1, ::-1] if number > 2 else empty(SCENE)
        yield np.hstack([frame, other])


Frames = Callable[[], Sequence[Image] | Iterator[Image]]
FILMS: dict[str, tuple[Frames, dict[str, Any], dict[str, Any] | Frames]] = {
    "several animals: give": (
        lambda: on_pattern(25.0, 0.35), {}, {"animals": "1"},
    ),
    "nothing stands out from the background; give --background": (
        lambda: on_pattern(25.0, 0.35),
        {"cropped": True},
        {"cropped": False, "background": empty(replace(SCENE, texture=25.0))},
    ),
    "cut by the edge of the image": (lambda: film(SCENE), {"roi": "40,20,60,60"}, {"roi": None}),
    "is not a long body": (
        lambda: with_ball(film(SCENE)),
        {"background": np.vstack([empty(SCENE)] * 2)},
        {"roi": "0,0,140,100"},
    ),
    "one frame shows no motion": (lambda: [next(film(SCENE))], {}, lambda: film(SCENE)),
    "no motion: the body changes": (
        lambda: film(SCENE, turning(0.0)), {}, lambda: film(SCENE, turning(0.35)),
    ),
    "the body is never completely visible": (
        lambda: film(SCENE, moved_rings()),
        {},
        lambda: film(SCENE, np.concatenate([moved_rings()[::2], true_midlines(SCENE)[::2]])),
    ),
    "about as bright as its ground": (
        lambda: film(replace(SCENE, body=140.0, noise=6.0)), {}, {"threshold": 10.0},
    ),
    "frames show a complete body": (
        lambda: with_company(film(SCENE)), {}, {"roi": "0,0,140,100"},
    ),
    "animals can be followed": (lambda: film(SCENE), {"animals": "3"}, {"animals": "1"}),
}  # fmt: skip
"""By words of a rejection: a film, options with which it is rejected, and the remedy.

The remedy is other options, or another film.
"""
LOOKS: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "--cropped and --background: ": (
        {"cropped": True, "background": Path("b.png")}, {"background": None},
    ),
    "--cropped and --trail: ": ({"cropped": True, "trail": Path("t.png")}, {"trail": None}),
    "--length-m and --marker both": ({"length_m": 1.0, "marker": "1.0"}, {"marker": None}),
    ": a track ends in": ({"output": Path("t.txt")}, {"output": Path("t.npz")}),
    ": the table of --wide ends in": (
        {"wide": True, "output": Path("t.wcon")}, {"output": Path("t.csv")},
    ),
    ": a track without places (--cropped) ends in": (
        {"cropped": True, "output": Path("t.csv")}, {"output": Path("t.wcon")},
    ),
    ": the track of --review ends in": (
        {"review": Path("r.html"), "output": Path("t.csv")}, {"output": Path("t.npz")},
    ),
    ": an overlay film ends in": ({"overlay": Path("o.gif")}, {"overlay": Path("o.mp4")}),
    ": a picture ends in": ({"sheet": Path("s.gif")}, {"sheet": Path("s.png")}),
    ": a review page ends in": ({"review": Path("r.pdf")}, {"review": Path("r.html")}),
    ": expected a number from 1": ({"animals": "many"}, {"animals": "2"}),
    "this option is for one animal": ({"animals": "2", "cropped": True}, {"cropped": False}),
    ": expected X,Y in pixels": ({"head": "1"}, {"head": "1,2"}),
    ": outside the images, which": ({"head": "500,9"}, {"head": "50,9"}),
    ": outside --roi and --mask": ({"head": "90,9", "roi": "0,0,50,50"}, {"roi": None}),
    ": expected the SIDE in metres": ({"marker": "a"}, {"marker": "0,0,9,0,1.0"}),
    ": the two places must be apart": ({"marker": "0,0,0,0,1.0"}, {"marker": "0,0,9,0,1.0"}),
    ": no ArUco or AprilTag marker": ({"marker": "1.0"}, {"marker": "0,0,9,0,1.0"}),
}  # fmt: skip
"""By words of a rejection before any capture: options that are rejected, and the remedy."""
SIZES: dict[str, dict[str, Any]] = {
    "--roi and --mask need images of one size": {"roi": "0,0,50,50"},
    ": --animals needs images of one size": {"animals": "1"},
}
"""Rejections of films of images that differ in size, and the option to leave out."""
AFTERWARDS = {
    "a picture is a .png or .jpg": "`check_options` rejects such a name before",
    "no frame of the film is used": "such a film is rejected before",
    "this OpenCV cannot write such": "depends on the codecs of the machine",
    "needs a file of corrections": "a fault of the program: the command asks for the option",
}
"""Faults without a remedy of their own, and the reason."""
EXPLAINED = [*FILMS, *LOOKS, *SIZES, *CORRECTIONS, *CORRECTED, *PARTS, PAGE, KEYPOINTS, *AFTERWARDS]


@cache
def rejections() -> list[str]:
    """The texts of all faults of ``animal capture``, each joined from its parts."""
    texts = []
    for file in Path(package.__path__[0]).rglob("*.py"):
        if file.name in {"analyse.py", "track.py"}:  # other commands
            continue
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.Assign | ast.Raise | ast.Call):
                continue
            words = ast.unparse(node)
            if isinstance(node, ast.Call) and words.startswith("check_ending("):
                texts.append(f": {ast.literal_eval(node.args[1])} ends in one of several endings")
            said: list[ast.AST] = []
            if isinstance(node, ast.Assign) and words.startswith("ADVICE = "):
                said = [*node.value.values] if isinstance(node.value, ast.Dict) else []
            elif (isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call)) or (
                words.startswith(("fault = RejectedFilmError(", "super().__init__(", "advice = "))
            ):
                said = [node]
            for one in said:
                parts = [part.value for part in ast.walk(one) if isinstance(part, ast.Constant)]
                texts.append("".join(part for part in parts if isinstance(part, str)))
    return [text for text in texts if len(text) > len(":  ( of  frames)")]


@pytest.mark.parametrize("text", rejections())
def test_every_rejection_has_a_test_of_its_remedy(text: str) -> None:
    assert any(words in text for words in EXPLAINED), text


@pytest.mark.parametrize("words", EXPLAINED)
def test_every_listed_rejection_exists(words: str) -> None:
    assert any(words in text for text in rejections())


WARNINGS = {
    "head and tail may be exchanged": "test_the_remedies_of_a_warning_end_it",
    " frames show no usual length to compare with": "test_the_remedies_of_a_warning_end_it",
    " frames are not used, mostly because ": "`remedy` tries the options",
    "the points are expected to be off by": "`remedy` tries the options",
    "%s: %s": "a sentence of `remedy`, whose command is tried",
    "animal %d: %s": "a doubt about one animal",
    "smaller objects, of less than": "test_a_smaller_animal_is_captured_alone_by_its_region",
    "identity uncertain after frame": "test_the_page_shows_all_animals",
    "image numbers are missing": "nothing to do: the times are right",
}
"""By words of a warning: the test of its remedy, or why it has none."""


def warnings() -> Iterator[str]:
    """The texts of all warnings and doubts of ``animal capture``."""
    for file in Path(package.__path__[0]).rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and ast.unparse(node.func) in {
                "LOGGER.warning", "doubts.append",
            }:  # fmt: skip
                parts = [part.value for part in ast.walk(node) if isinstance(part, ast.Constant)]
                text = "".join(part for part in parts if isinstance(part, str))
                if text not in {"", "%s"}:
                    yield text


def test_every_warning_has_a_tested_remedy_or_a_reason() -> None:
    texts = [*warnings()]
    assert [text for text in texts if not any(words in text for words in WARNINGS)] == []
    assert [words for words in WARNINGS if not any(words in text for text in texts)] == []
    files = Path(__file__).parent.glob("test_*.py")
    tests = "".join(file.read_text(encoding="utf-8") for file in files)
    names = [name for name in WARNINGS.values() if name.startswith("test_")]
    assert [name for name in names if f"def {name}" not in tests] == []


@pytest.mark.slow
def test_the_remedies_of_a_warning_end_it(tmp_path: Path) -> None:
    options = folder_of((frame for frame, _ in zip(film(SCENE), range(12), strict=False)), tmp_path)
    short = capture_recording(options)
    assert short.warning is not None
    assert "fewer than 20 frames show no usual length to compare with; film longer" in short.warning
    assert short.frames_rough == short.frames_used
    (tmp_path / "longer").mkdir()
    even = replace(SCENE, taper=0.05, tip=1.0)
    longer = folder_of(film(even, turning(0.35)), tmp_path / "longer")
    unsure = capture_recording(longer)
    assert unsure.frames_rough < unsure.frames_used
    assert unsure.warning is not None
    said = re.search(r"head and tail may be exchanged .* give --head (\S+)$", unsure.warning)
    assert said, unsure.warning
    given = capture_recording(changed(longer, head=said[1], force=True))
    assert (given.head_by, given.warning) == ("given", None)


@pytest.mark.slow
def test_a_smaller_animal_is_captured_alone_by_its_region(tmp_path: Path) -> None:
    small = replace(SCENE, length_px=26.0)
    both = (np.hstack(pair) for pair in zip(film(SCENE), film(small), strict=True))
    options = changed(folder_of(both, tmp_path), animals="auto")
    facts = capture_several(options)
    assert (len(facts.animals), facts.smaller_objects) == (1, 1)
    (animal,) = captured(changed(options, animals=None, roi="140,0,140,100", force=True))
    assert animal is not None
    assert animal.length_px == pytest.approx(26.0, rel=0.15)


def captured(options: CaptureOptions) -> list[CaptureFacts | None]:
    facts: CaptureFacts | AnimalsFacts
    facts = (capture_recording if options.animals is None else capture_several)(options)
    return captures(facts)


def with_file(options: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Options whose background is a file."""
    if "background" not in options:
        return options
    file = folder / "background.png"
    cv2.imwrite(str(file), options["background"])
    return options | {"background": file}


@pytest.mark.slow_cases(6, "10 cases of 2 to 7 s of CPU")
@pytest.mark.slow
@pytest.mark.parametrize("words", FILMS)
def test_the_remedy_of_a_rejection_makes_a_track(words: str, tmp_path: Path) -> None:
    frames, before, remedied = FILMS[words]
    plain = changed(folder_of(frames(), tmp_path), **with_file(before, tmp_path))
    with pytest.raises(RejectedFilmError, match=re.escape(words)):
        captured(plain)
    if callable(remedied):
        (tmp_path / "longer").mkdir()
        better = folder_of(remedied(), tmp_path / "longer")
    else:
        better = changed(plain, **with_file(remedied, tmp_path))
    (animal,) = captured(better)
    assert animal is not None
    assert animal.frames_used >= 10


@pytest.mark.parametrize("words", list(LOOKS))
def test_the_remedy_of_an_option_is_accepted(words: str, tmp_path: Path) -> None:
    def look(options: CaptureOptions) -> None:
        check_options(options)
        places_of(options)
        if options.head is not None:
            open_film(options)
        if options.marker is not None:
            scale_of_marker(options.marker, empty(SCENE))

    before, remedied = LOOKS[words]
    plain = changed(folder_of([empty(SCENE)] * 2, tmp_path), **before)
    with pytest.raises(InputError, match=re.escape(words)):
        look(plain)
    look(changed(plain, **remedied))


@pytest.mark.parametrize("words", list(SIZES))
def test_images_of_different_sizes_need_the_option_left_out(words: str, tmp_path: Path) -> None:
    frames = [frame[: 90 + number % 5] for number, frame in enumerate(film(SCENE))]
    plain = changed(folder_of(frames, tmp_path), **SIZES[words])
    with pytest.raises(InputError, match=words):
        captured(plain)
    open_film(changed(plain, **dict.fromkeys(SIZES[words])))


def test_a_film_in_parts_states_its_commonest_reason() -> None:
    frames = list(film(SCENE, moved_rings()))
    detector = make_detector(frames)
    detections = Detections()
    for frame in frames:
        detections.add(frame, detector.detect(frame))
    part = FinishedPart.of(captured_from(detections, SCENE.rate_hz, part=True))
    with pytest.raises(RejectedFilmError, match=r"silhouette has a hole.*40 of 40 frames"):
        joined([part, part], SCENE.rate_hz, "film")


@pytest.mark.nightly("trials of six options: 25 s of CPU")
def test_an_animal_that_rests_on_a_pattern_is_captured_by_frame(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The median of the frames contains the animal; single frames show it."""
    options = folder_of(on_pattern(12.0, 0.06), tmp_path)
    monkeypatch.setattr("sys.argv", ["snakewalk", "animal", "capture", str(options.recording)])
    with pytest.raises(RejectedFilmError, match=r"try: snakewalk animal capture .* --cropped$"):
        capture_film(options)
    (animal,) = captured(changed(options, cropped=True))
    assert animal is not None
    assert animal.frames_used >= 15
