"""Keypoints of another program as the detector: the film confirms or contradicts their lines."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from pydantic import ValidationError

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.capture.capture import CaptureFile, load_capture
from snakewalk.controller.capture.capturing import capture_recording
from snakewalk.controller.capture.film.film_options import CaptureOptions
from snakewalk.controller.capture.verification.remedies import remedy
from snakewalk.controller.track.frame_status import FrameStatus
from tests.helpers.film_options import changed, film_options
from tests.oracles.rendered_snake import SnakeScene, film, true_midlines

SCENE = SnakeScene(rows=200, columns=260, length_px=150.0, frames=22, rate_hz=15.0)
NOISE_PX = 0.5
EXCHANGED, MISSING, LOST = 7, 12, 15


def table(file: Path, points: Floats) -> Path:
    """A table of SLEAP with keypoints (T, 11, 2), without those that are NaN."""
    names = [f"p{k}.{axis}" for k in range(points.shape[1]) for axis in ("x", "y", "score")]
    rows = [["track", "frame_idx", "instance.score", *names]]
    for number, body in enumerate(points):
        values = [
            "" if np.isnan(value) else f"{value:.2f}" for x, y in body for value in (x, y, 0.9)
        ]
        rows.append(["snake", str(number), "0.9", *values])
    file.write_text("\n".join(map(",".join, rows)) + "\n")
    return file


@pytest.fixture(scope="module")
def options(tmp_path_factory: pytest.TempPathFactory) -> CaptureOptions:
    folder = tmp_path_factory.mktemp("keypoints")
    (folder / "film").mkdir()
    for number, frame in enumerate(film(SCENE)):
        cv2.imwrite(str(folder / "film" / f"{number:02d}.png"), frame)
    noise = np.random.default_rng(1).normal(0.0, NOISE_PX, (SCENE.frames, 11, 2))
    points = true_midlines(SCENE)[:, ::10] + noise
    points[EXCHANGED, [3, 6]] = points[EXCHANGED, [6, 3]]
    points[MISSING, 5] = np.nan
    points[LOST, 2:5] = np.nan
    keypoints = table(folder / "points.csv", points)
    return film_options(folder / "film", folder / "t.npz", rate_hz=15.0, keypoints=keypoints)


def errors_px(captured: CaptureFile) -> Floats:
    """(T,) mean distance of the points from the true ones."""
    away = captured.captured.points_px - true_midlines(SCENE)
    return np.asarray(np.hypot(*away.transpose(2, 0, 1)).mean(axis=1))


@pytest.mark.slow
def test_the_film_confirms_lines_and_contradicts_a_wrong_keypoint(options: CaptureOptions) -> None:
    facts = capture_recording(options)
    file = load_capture(options.output)
    status, expected_px = file.captured.status, file.captured.expected_px
    plain = [k for k in range(SCENE.frames) if k not in {EXCHANGED, MISSING, LOST}]
    error_px = errors_px(file)
    assert sum(status[k] is FrameStatus.GOOD for k in plain) >= len(plain) - 1
    assert np.median(error_px[plain]) < 0.007 * SCENE.length_px
    assert (error_px[plain] < 2.0 * expected_px[plain]).all()
    assert status[MISSING].has_points
    assert error_px[MISSING] < 2.0 * expected_px[MISSING]
    assert status[EXCHANGED] is not FrameStatus.GOOD
    assert not error_px[EXCHANGED] > 2.0 * expected_px[EXCHANGED]
    assert status[LOST] is FrameStatus.MISSING
    assert facts.facts["quantity"] == f"keypoints of an animal (stated by {options.keypoints})"
    assert facts.head_by == "given"
    assert file.source == "captured from film, positions from points.csv"


@pytest.mark.slow
def test_lines_beside_the_animal_are_no_result(options: CaptureOptions, tmp_path: Path) -> None:
    far = true_midlines(SCENE)[:, ::10]
    far = far + [0.0, 100.0] * np.where(far.mean(axis=1) > 100.0, -1.0, 1.0)[:, None, 1:]
    wrong = changed(options, keypoints=table(tmp_path / "far.csv", far), output=tmp_path / "t.npz")
    with pytest.raises(InputError):
        capture_recording(wrong)
    assert remedy(wrong) is None


def test_keypoints_of_several_animals_are_rejected(options: CaptureOptions) -> None:
    with pytest.raises(InputError, match="--animals and --keypoints"):
        capture_recording(changed(options, animals="2", force=True))


@pytest.mark.parametrize("name", ["length_m", "threshold"])
def test_sizes_of_a_film_are_above_zero(name: str, options: CaptureOptions) -> None:
    with pytest.raises(ValidationError, match=name):
        changed(options, **{name: 0.0})


def test_a_file_without_a_line_is_rejected(options: CaptureOptions, tmp_path: Path) -> None:
    points = np.full((SCENE.frames, 11, 2), np.nan)
    points[:, ::2] = true_midlines(SCENE)[:, ::20]
    points[::2, 1::2] = true_midlines(SCENE)[::2, 10::20]
    points[::2, ::2] = np.nan
    gaps = table(tmp_path / "gaps.csv", points)
    with pytest.raises(InputError, match="no frame has a line through its keypoints"):
        capture_recording(changed(options, keypoints=gaps, output=tmp_path / "t.npz"))
