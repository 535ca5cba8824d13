"""Films in which the animal is absent in most frames, and shapes that only the background shows."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from snakewalk.config.arrays import Floats, Image
from snakewalk.controller.images.background import contrast_polarity
from snakewalk.controller.images.body_detector import BodyDetector, make_detector
from snakewalk.controller.images.silhouette import Polarity
from snakewalk.controller.track.frame_status import FrameStatus
from tests.helpers.captured import capture
from tests.oracles.rendered_snake import SnakeScene, empty, film, true_midlines
from tests.oracles.skeleton_accuracy import point_error, swapped

DARK = SnakeScene(
    rows=200, columns=260, length_px=90.0, frames=48, rate_hz=10.0, wave_hz=0.6, seed=5
)
LIGHT = replace(DARK, ground=70.0, body=180.0)
FILMS = {
    "dark": (DARK, range(20, 30)),
    "dark, on a pattern": (replace(DARK, texture=6.0), range(34, 48)),
    "light": (LIGHT, range(0, 14)),
    "light, on a pattern": (replace(LIGHT, texture=6.0), range(20, 30)),
    "dark, rarely seen": (DARK, range(30, 35)),
}


def visited(scene: SnakeScene, present: range) -> tuple[list[Image], Floats]:
    """A film whose animal is in view in some frames only, and its midlines."""
    truth = true_midlines(scene)
    away = [10.0 * scene.columns, 0.0]
    seen = np.array([k in present for k in range(scene.frames)])
    return list(film(scene, np.where(seen[:, None, None], truth, truth + away))), truth


@pytest.mark.slow
@pytest.mark.slow_cases(1, "a film each: 5 s of CPU")
@pytest.mark.parametrize("kind", ["dark, rarely seen", *FILMS][:5])
def test_an_animal_that_is_mostly_absent_is_found_where_it_is(kind: str) -> None:
    scene, present = FILMS[kind]
    frames, truth = visited(scene, present)
    detector = make_detector(frames[::2])
    seen = capture(frames, detector, scene.rate_hz)
    assert np.flatnonzero(seen.used).tolist() == list(present)
    for k in present:
        found = seen.points_px[k]
        line = found[::-1] if swapped(found, truth[k]) else found
        assert point_error(line, truth[k]) < 2.0 * seen.expected_px[k]


@pytest.mark.nightly("a further film: 4 s of CPU")
def test_compressed_frames_without_an_animal_show_nothing() -> None:
    scene, present = FILMS["dark"]
    frames, _ = visited(scene, present)
    packed = [cv2.imencode(".jpg", one, [cv2.IMWRITE_JPEG_QUALITY, 20])[1] for one in frames]
    images = [np.asarray(cv2.imdecode(one, cv2.IMREAD_GRAYSCALE)) for one in packed]
    detector = make_detector(images[::2])
    assert detector.detect(images[0]).skeleton.status is FrameStatus.SEVERAL
    seen = capture(images, detector, scene.rate_hz)
    for k, status in enumerate(seen.status):
        assert (status is FrameStatus.GOOD) if k in present else (status is FrameStatus.NOTHING)


def test_a_shape_that_only_the_background_shows_is_a_ghost() -> None:
    frames, _ = visited(DARK, range(20, 21))
    bare, body = frames[0], frames[20]
    lit = BodyDetector(body, Polarity.LIGHT, "a frame with the animal")
    assert lit.detect(bare).silhouette.status is FrameStatus.GHOST
    dark = BodyDetector(bare, Polarity.DARK, "a frame without the animal")
    assert dark.detect(body).silhouette.status is FrameStatus.GOOD


def test_a_frame_without_an_animal_has_no_polarity() -> None:
    frames, _ = visited(DARK, range(20, 21))
    ground = empty(DARK)
    assert contrast_polarity(frames[0], ground) is None
    assert contrast_polarity(frames[20], ground) is Polarity.DARK
