"""``--roi``, ``--mask`` and ``--threshold``: what a user knows of the picture."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.controller.capture.capturing import capture_recording
from snakewalk.controller.images.body_detector import BodyDetector
from snakewalk.controller.images.region import WHOLE, region_of
from snakewalk.controller.images.silhouette import Polarity
from snakewalk.controller.track.frame_status import FrameStatus
from tests.helpers.film_options import changed, film_options
from tests.oracles.rendered_snake import SnakeScene, empty, film, true_midlines
from tests.oracles.skeleton_accuracy import point_error

SCENE = SnakeScene(rows=240, columns=280, length_px=130.0, frames=6, wave_hz=1.0)
PAD = (40, 60)  # rows and columns of clutter before the arena


@pytest.fixture(scope="module")
def cluttered(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An arena in a larger picture, with something as dark and larger that moves beside it."""
    folder = tmp_path_factory.mktemp("film")
    for number, frame in enumerate(film(SCENE)):
        canvas = np.full((SCENE.rows + 80, SCENE.columns + 120), 170, dtype=np.uint8)
        canvas[PAD[0] : PAD[0] + SCENE.rows, PAD[1] : PAD[1] + SCENE.columns] = frame
        cv2.rectangle(canvas, (20 + 30 * number, 14), (160 + 30 * number, 27), 10, -1)
        cv2.imwrite(str(folder / f"{number:03}.png"), canvas)
    disc = np.zeros((SCENE.rows + 80, SCENE.columns + 120), dtype=np.uint8)
    cv2.ellipse(disc, (PAD[1] + 140, PAD[0] + 120), (138, 118), 0, 0, 360, 255, -1)
    cv2.imwrite(str(folder.parent / "mask.png"), disc)
    return folder


def off_px(track: Path) -> float:
    """Greatest error of a frame, the better end first, in the whole picture's pixels."""
    with np.load(track) as held:
        points, used = held["points_px"], np.isfinite(held["length_px"])
    truth = true_midlines(SCENE) + np.array([PAD[1], PAD[0]])
    return max(
        min(point_error(points[k][::way], truth[k]) for way in (1, -1))
        for k in np.flatnonzero(used)
    )


@pytest.mark.nightly("two further films: 4 s of CPU")
def test_the_region_or_the_mask_leaves_the_clutter_out(cluttered: Path, tmp_path: Path) -> None:
    plain = changed(film_options(cluttered, tmp_path / "t.npz"), force=True)
    with pytest.raises(InputError, match=r"or give .*--background"):
        capture_recording(plain)
    roi = capture_recording(changed(plain, roi=f"{PAD[1]},{PAD[0]},{SCENE.columns},{SCENE.rows}"))
    assert roi.frames_used == SCENE.frames
    assert off_px(plain.output) < 1.5
    masked = capture_recording(changed(plain, mask=cluttered.parent / "mask.png"))
    assert masked.frames_used == SCENE.frames
    assert off_px(plain.output) < 1.5


def test_a_body_that_leaves_the_region_or_the_mask_is_cut() -> None:
    frame = next(film(SCENE))
    middle = true_midlines(SCENE)[0].mean(axis=0)
    inside = np.broadcast_to(np.arange(SCENE.columns) < middle[0], frame.shape).copy()
    detector = BodyDetector(empty(SCENE), Polarity.DARK, "given")
    assert detector.detect(frame).skeleton.status is FrameStatus.GOOD
    masked = replace(detector, inside=inside)
    assert masked.detect(frame).skeleton.status is FrameStatus.CUT
    region = region_of(f"0,0,{int(middle[0])},{SCENE.rows}", None, frame.shape)
    cut = replace(detector, background=region.cut(empty(SCENE)))
    assert cut.detect(region.cut(frame)).skeleton.status is FrameStatus.CUT


def test_the_threshold_of_a_user_is_the_boundary() -> None:
    scene = replace(SCENE, noise=1.0, blur_px=0.8)
    frame = next(film(scene))
    detector = BodyDetector(empty(scene), Polarity.DARK, "given")
    area = {
        level: replace(detector, threshold=level).detect(frame).silhouette.area_px
        for level in (20.0, 55.0, 90.0)
    }
    assert area[20.0] > area[55.0] > area[90.0]
    assert area[55.0] == pytest.approx(detector.detect(frame).silhouette.area_px, rel=0.15)


def test_without_either_the_whole_picture_is_taken_and_nonsense_is_told(tmp_path: Path) -> None:
    shape = (200, 240)
    assert region_of(None, None, shape) is WHOLE
    for wrong, told in (
        ("1,2,3", "expected X,Y,W,H"),
        ("0,0,300,100", "reaches beyond the picture of 240 x 200"),
        ("0,0,4,100", "at least 16 x 16"),
    ):
        with pytest.raises(InputError, match=told):
            region_of(wrong, None, shape)
    mask = tmp_path / "m.png"
    for image, told in (
        (np.full((10, 10), 255), "is 10 x 10, the frames are 240 x 200"),
        (np.zeros(shape), "white is where the animal may be"),
    ):
        cv2.imwrite(str(mask), image.astype(np.uint8))
        with pytest.raises(InputError, match=told):
            region_of(None, mask, shape)
