"""Keypoints of another program as the detector: the film confirms or contradicts their lines."""

from collections.abc import Callable
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
from tests.helpers import tracker_files
from tests.helpers.film_options import changed, film_options
from tests.oracles.rendered_snake import SnakeScene, film, true_midlines

SCENE = SnakeScene(rows=200, columns=260, length_px=150.0, frames=22, rate_hz=15.0)
NOISE_PX = 0.5
EXCHANGED, REVERSED, MISSING, LOST = 7, 9, 12, 15
UNLIKELY = 17
"""Frame with a point far away that a tracker is not sure of."""
WRITERS: dict[str, Callable[[Path, Floats, Floats], None]] = {
    "sleap.csv": tracker_files.sleap_csv,
    "sleap.h5": tracker_files.sleap_h5,
    "dlc.csv": tracker_files.dlc_csv,
    "dlc.h5": tracker_files.dlc_h5,
}


def table(file: Path, points: Floats) -> Path:
    """A table of SLEAP with keypoints (T, 11, 2), without those that are NaN."""
    tracker_files.sleap_csv(file, points, np.full(points.shape[:2], 0.9))
    return file


def tracked_px() -> Floats:
    """(T, 11, 2) keypoints with noise and faults."""
    noise = np.random.default_rng(1).normal(0.0, NOISE_PX, (SCENE.frames, 11, 2))
    points = true_midlines(SCENE)[:, ::10] + noise
    points[EXCHANGED, [3, 6]] = points[EXCHANGED, [6, 3]]
    points[MISSING, 5] = np.nan
    points[LOST, 2:5] = np.nan
    points[REVERSED] = points[REVERSED, ::-1]
    return points


@pytest.fixture(scope="module")
def options(tmp_path_factory: pytest.TempPathFactory) -> CaptureOptions:
    folder = tmp_path_factory.mktemp("keypoints")
    (folder / "film").mkdir()
    for number, frame in enumerate(film(SCENE)):
        cv2.imwrite(str(folder / "film" / f"{number:02d}.png"), frame)
    keypoints = table(folder / "points.csv", tracked_px())
    return film_options(folder / "film", folder / "t.npz", rate_hz=15.0, keypoints=keypoints)


def errors_px(captured: CaptureFile) -> Floats:
    """(T,) mean distance of the points from the true ones."""
    away = captured.captured.points_px - true_midlines(SCENE)
    return np.asarray(np.hypot(*away.transpose(2, 0, 1)).mean(axis=1))


@pytest.mark.slow_cases(3, "4 cases of 4 s of CPU")
@pytest.mark.slow
@pytest.mark.parametrize("name", WRITERS)
def test_the_film_confirms_lines_and_contradicts_a_wrong_keypoint(
    name: str, options: CaptureOptions, tmp_path: Path
) -> None:
    """Each format; DeepLabCut states a place and a low likelihood for a point it did not see."""
    points = tracked_px()
    scores = np.full(points.shape[:2], 0.9)
    if name.startswith("dlc"):
        points[UNLIKELY, 4] = points[UNLIKELY, 4] + 40.0
        scores[UNLIKELY, 4] = 0.2
    keypoints = tmp_path / name
    WRITERS[name](keypoints, points, scores)
    options = changed(options, keypoints=keypoints, output=tmp_path / "t.npz")
    facts = capture_recording(options)
    file = load_capture(options.output)
    status, expected_px = file.captured.status, file.captured.expected_px
    plain = [
        k for k in range(SCENE.frames) if k not in {EXCHANGED, REVERSED, MISSING, LOST, UNLIKELY}
    ]
    error_px = errors_px(file)
    assert sum(status[k] is FrameStatus.GOOD for k in plain) >= len(plain) - 1
    assert np.median(error_px[plain]) < 0.007 * SCENE.length_px
    assert (error_px[plain] < 2.0 * expected_px[plain]).all()
    for frame in (REVERSED, MISSING, UNLIKELY):
        assert status[frame].has_points
        assert error_px[frame] < 2.0 * expected_px[frame]
    assert status[EXCHANGED] is not FrameStatus.GOOD
    assert not error_px[EXCHANGED] > 2.0 * expected_px[EXCHANGED]
    assert status[LOST] is FrameStatus.MISSING
    assert facts.facts["quantity"] == f"keypoints of an animal (stated by {options.keypoints})"
    assert facts.head_by == "given"
    assert file.source == f"captured from film, positions from {name}"


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
