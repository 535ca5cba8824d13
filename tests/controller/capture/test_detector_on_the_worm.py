"""Real frames of a worm beside the published skeletons."""

from pathlib import Path

import numpy as np
import pytest

from snakewalk.controller.capture.capture import Capture
from snakewalk.controller.images.body_detector import make_detector
from snakewalk.controller.images.video import open_footage
from tests.helpers.captured import capture
from tests.oracles.skeleton_accuracy import distance, swapped


@pytest.fixture(scope="module")
def worm(shared_data: Path) -> tuple[Capture, np.ndarray]:
    folder = shared_data / "worm-images"
    if not (folder / "frames").is_dir():
        pytest.skip("the frames of the worm are not there")
    footage = open_footage(folder / "frames")
    detector = make_detector(footage.spread(25))
    seen = capture(footage.read(), detector, footage.rate_hz, fixed=False)
    with np.load(folder / "skeletons.npz") as data:
        published = data["skeletons"].astype(float)
    at = np.linspace(0.0, 51.0, 101)
    even = np.stack(
        [
            np.interp(at, np.arange(52), column)
            for column in published.transpose(0, 2, 1).reshape(-1, 52)
        ]
    )
    return seen, even.reshape(len(published), 2, 101).transpose(0, 2, 1)


def test_the_median_distance_is_below_a_pixel_and_every_frame_is_used(
    worm: tuple[Capture, np.ndarray],
) -> None:
    seen, published = worm
    assert seen.used.all()
    away = [distance(*pair) for pair in zip(seen.points_px, published, strict=True)]
    assert np.median(away) < 0.5
    assert np.max(away) < 1.0


def test_nine_frames_of_ten_are_good_and_state_their_error(
    worm: tuple[Capture, np.ndarray],
) -> None:
    """The rest are rough for a tip that lies more than a pixel from the end of its contrast."""
    seen, published = worm
    assert np.mean(seen.good) > 0.9
    away = np.array([distance(*pair) for pair in zip(seen.points_px, published, strict=True)])
    assert np.mean(away[seen.good] > 2.0 * seen.expected_px[seen.good]) <= 0.05


def test_head_and_tail_are_those_of_the_published_skeletons_in_every_frame(
    worm: tuple[Capture, np.ndarray],
) -> None:
    seen, published = worm
    assert not any(swapped(*pair) for pair in zip(seen.points_px, published, strict=True))
    assert seen.head_by == "wave"
    assert np.nanmin(seen.margin) > 0.3


def test_the_length_is_steady(worm: tuple[Capture, np.ndarray]) -> None:
    seen, published = worm
    true = np.hypot(*np.diff(published, axis=1).transpose(2, 0, 1)).sum(axis=1)
    assert np.allclose(seen.length_px, true, rtol=0.08)
