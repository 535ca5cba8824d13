"""Films as people have them: white ground, JPEG, stains, dark corners, moving cameras, ghosts."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from scipy.spatial import cKDTree

from snakewalk.controller.capture.capture import Capture
from snakewalk.controller.capture.small_body.crop import crop_body
from snakewalk.controller.capture.stages.head import head_end, travel_score
from snakewalk.controller.images.background import median_background, surrounding_ground
from snakewalk.controller.images.body_detector import (
    BodyDetector,
    _repainted_detector,
    make_detector,
)
from snakewalk.controller.images.silhouette import Polarity, silhouette_of
from snakewalk.controller.track.frame_status import FrameStatus
from tests.helpers.captured import capture
from tests.helpers.tiers import slow_except
from tests.oracles.rendered_snake import SnakeScene, empty, film, true_midlines
from tests.oracles.skeleton_accuracy import point_error

pytestmark = pytest.mark.costs("each test captures a rendered film")

SCENE = SnakeScene(rows=300, columns=400, length_px=140.0, frames=10, wave_hz=0.6)
WHITE = replace(SCENE, ground=250.0, gain=1.15, body=15.0, noise=2.0)
STAINED = replace(
    SCENE, rows=240, columns=320, length_px=100.0, wave_hz=0.75, taper=0.2, waves=1.1, bend_rad=0.8,
    follow=1.0, stains=25.0, vignette=0.4, jpeg=40, seed=2000,
)  # fmt: skip
FILMS = {
    "a stain longer than the animal, in half of the frames": STAINED,
    "black worm on white, coarse JPEG": replace(WHITE, jpeg=20),
    "white, stained": replace(WHITE, gain=1.1, jpeg=50, stains=60.0),
    "dark corners": replace(SCENE, vignette=0.9),
    "camera that follows": replace(SCENE, follow=1.0),
    "camera that follows on stains": replace(SCENE, follow=1.0, stains=25.0, vignette=0.4, jpeg=40),
    "small, stained": replace(SCENE, rows=240, columns=320, length_px=40.0, stains=40.0, frames=8),
}


def errors_px(scene: SnakeScene, seen: Capture) -> tuple[np.ndarray, np.ndarray]:
    """Error of each frame that is used, of the better end first, and what is expected."""
    used = np.flatnonzero(seen.used)
    truth = true_midlines(scene)
    off = [min(point_error(seen.points_px[k][::way], truth[k]) for way in (1, -1)) for k in used]
    return np.array(off), seen.expected_px[used]


@pytest.mark.slow_cases(1, "a film each: 2 s of CPU")
@pytest.mark.slow
@pytest.mark.parametrize("name", slow_except(["small, stained"], FILMS))
def test_the_whole_body_is_found_and_its_expected_error_holds(name: str) -> None:
    scene = FILMS[name]
    frames = list(film(scene))
    seen = capture(frames, make_detector(frames[::2]), scene.rate_hz)
    assert seen.used.mean() > 0.95
    off, expected = errors_px(scene, seen)
    assert (off < 2.0 * expected).all()
    assert np.median(off) < 0.01 * scene.length_px


def test_a_shade_larger_than_the_animal_and_joined_to_it_is_not_the_animal() -> None:
    frame = next(film(replace(SCENE, noise=0.0, ground=255.0, body=10.0)))
    ground = np.full_like(frame, 255)
    soft = frame.copy()
    soft[:, 200:] = np.minimum(soft[:, 200:], 240)
    soft[0, :] = 255
    alone, shaded = (silhouette_of(one, ground, Polarity.DARK) for one in (frame, soft))
    assert shaded.status is FrameStatus.GOOD
    assert abs(shaded.area_px - alone.area_px) < 0.1 * alone.area_px


@pytest.mark.slow
def test_a_background_that_shows_the_animal_is_refused_and_if_given_told() -> None:
    scene = replace(FILMS["camera that follows"], noise=1.0)
    frames = list(film(scene))
    ghost = median_background(frames)
    bare = np.full_like(ghost, round(scene.ground))
    assert (bare.astype(int) - ghost > 50).sum() > 300, "the median shows the animal"
    chosen = make_detector(frames)
    assert chosen.background is None or (bare.astype(int) - chosen.background).max() < 20
    given = make_detector(frames, ghost)
    assert not any(given.detect(one).skeleton.status is FrameStatus.GOOD for one in frames)


def test_a_body_that_lies_on_its_ghost_is_told() -> None:
    scene = replace(SCENE, noise=1.0)
    frame, ground = next(film(scene)), empty(scene)
    line = true_midlines(scene)[0]
    tip = line[0] + 0.25 * (line[0] - line[20])
    cross = np.rint(np.stack([tip, line[12]])).astype(np.int32)
    ghost = ground.copy()
    cv2.polylines(ghost, [cross], False, 60, 8)
    detector = BodyDetector(ghost, Polarity.DARK, "given")
    assert detector.detect(frame).skeleton.status is FrameStatus.GHOST
    assert BodyDetector(ground, Polarity.DARK, "given").detect(frame).skeleton.status is (
        FrameStatus.GOOD
    )


def test_a_body_of_which_a_part_is_faint_is_not_shortened() -> None:
    scene = replace(SCENE, noise=1.0)
    frame, ground = next(film(scene)), empty(scene)
    y, x = np.mgrid[0 : scene.rows, 0 : scene.columns]
    _, nearest = cKDTree(true_midlines(scene)[0]).query(np.column_stack([x.ravel(), y.ravel()]))
    for first in (60, 75):
        faint = (nearest > first).reshape(frame.shape)
        dimmed = frame.astype(float)
        dimmed[faint] += 0.6 * (ground.astype(float) - frame)[faint]
        found = BodyDetector(ground, Polarity.DARK, "given").detect(dimmed.astype(np.uint8))
        if found.skeleton.status is not FrameStatus.PART:
            assert found.skeleton.length_px == pytest.approx(scene.length_px, rel=0.04)


def test_the_surroundings_keep_shades_and_drop_what_is_narrow() -> None:
    x = np.arange(200)
    shade = np.broadcast_to(200.0 - 60.0 * np.sin(np.pi * x / 200.0), (120, 200))
    image = np.rint(shade).astype(np.uint8)
    image[50:58, 40:160] = 30
    ground = surrounding_ground(image, Polarity.DARK, 21)
    assert np.abs(ground - shade)[20:-20, 20:-20].max() < 12.0
    light = 255 - image
    assert (
        np.abs((255 - ground) - surrounding_ground(light, Polarity.LIGHT, 21).astype(int)).max()
        <= 1
    )


def test_a_painted_animal_leaves_the_light_of_a_patterned_ground() -> None:
    """The surroundings of a place are lighter than a pattern; painted in, they widen the body."""
    scene = replace(
        SCENE, rows=240, columns=320, length_px=35.0, frames=30, noise=6.0, blur_px=1.2, light=0.3,
        shadow=0.25, texture=5.0,
    )  # fmt: skip
    frames, bare = list(film(scene))[::3], empty(scene).astype(float)
    around = BodyDetector(None, Polarity.DARK, "", 49)
    painted = _repainted_detector(around, frames)
    assert painted is not None
    assert painted.background is not None
    covered = np.zeros(bare.shape, bool)
    for line in true_midlines(scene):
        x, y = np.rint(line).astype(int).T
        covered[y, x] = True
    assert abs(float((painted.background - bare)[covered].mean())) < 3.0


def test_a_body_is_not_searched_outside_its_crop() -> None:
    image = np.full((60, 80), 170, dtype=np.uint8)
    line = np.column_stack([np.linspace(30.0, 50.0, 11), np.full(11, 30.0)])
    crop = crop_body(image, image, line)
    assert crop.shows(line)
    assert not crop.shows(line + 200.0)


def test_jitter_of_a_camera_that_goes_with_the_animal_is_no_travel() -> None:
    scene = replace(
        SCENE, rows=240, columns=320, length_px=42.0, frames=12, taper=0.2, waves=1.1, bend_rad=0.8,
        wave_hz=0.9, follow=1.0,
    )  # fmt: skip
    points = true_midlines(scene)
    alike = np.ones(points.shape[:2])
    assert travel_score(points, 8)[0] < -0.5, "the jitter looks like travel, tail first"
    for way in (1, -1):
        score, by = head_end(
            points[:, ::way], alike, np.zeros((0, 101)), scene.rate_hz, None, fixed=True
        )
        assert by == "wave"
        assert score * way > 0.5, "a wave of 12 frames"
