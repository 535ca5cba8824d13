"""A film that is rejected, or of which a third is lost: options are tried on some frames."""

import ast
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

import snakewalk.controller.capture as package
from snakewalk.config.arrays import Image
from snakewalk.controller.capture.capture import RejectedFilmError
from snakewalk.controller.capture.film.film_options import CaptureOptions
from snakewalk.controller.capture.verification.remedies import capture_film, captures, remedy
from tests.helpers.film_options import changed, film_options
from tests.oracles.rendered_snake import SnakeScene, film

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
def test_a_film_that_no_option_helps_names_none(tmp_path: Path) -> None:
    blank = (np.full((60, 80), 128, np.uint8) for _ in range(20))
    options = folder_of(blank, tmp_path)
    assert remedy(options) is None
    assert not (tmp_path / "t-tried.png").exists()


REMEDIES: dict[str, tuple[Callable[[], Iterator[Image]], dict[str, Any], dict[str, Any]]] = {
    "--animals": (lambda: film(SCENE), {"animals": "3"}, {"animals": "1"}),
}
"""By words of a rejection that names an option: the film, its options, and those that help."""
ADVICE = {
    "about as bright as its ground": "the first test: --roi",
    "frames show a complete ": "as the first one, of a film with few rough frames",
    "no contrast or no motion: nothing stands out": "as the first one, of several animals",
    "no motion: the body changes": "names no option: the animal rests",
}
"""Rejections that name no option of their own, or that of another one; and why."""


def rejections() -> list[str]:
    """The texts of all rejections in the package, each joined from its parts."""
    texts = []
    for file in Path(package.__path__[0]).rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "RejectedFilmError":
                parts = [one.value for one in ast.walk(node) if isinstance(one, ast.Constant)]
                texts.append("".join(map(str, parts)))
    return [text for text in texts if "--" in text or "motion" in text]


@pytest.mark.parametrize("text", rejections())
def test_every_rejection_has_a_remedy_that_is_tried(text: str) -> None:
    assert any(words in text for words in [*REMEDIES, *ADVICE, "look at --sheet"]), text


@pytest.mark.slow
@pytest.mark.parametrize("words", list(REMEDIES))
def test_the_remedy_of_a_rejection_changes_the_result(words: str, tmp_path: Path) -> None:
    frames, options, better = REMEDIES[words]
    plain = folder_of(frames(), tmp_path)
    with pytest.raises(RejectedFilmError, match=words):
        capture_film(changed(plain, **options))
    assert all(animal is not None for animal in captures(capture_film(changed(plain, **better))))
