"""From film to skeleton where the truth is known: error, head and tail, over size and light."""

from dataclasses import replace

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.controller.capture.capture import Capture
from snakewalk.controller.images.body_detector import make_detector
from snakewalk.controller.images.silhouette import Polarity
from tests.helpers.captured import capture
from tests.helpers.tiers import slow_except
from tests.oracles.rendered_snake import SnakeScene, empty, film, true_midlines
from tests.oracles.skeleton_accuracy import point_error, swapped

pytestmark = pytest.mark.costs("each test captures a rendered film")

CLEAN = SnakeScene(rows=240, columns=320, frames=10, rate_hz=15.0, wave_hz=0.6)
HARSH = replace(CLEAN, noise=6.0, blur_px=1.2, light=0.3, shadow=0.25, texture=5.0)


def watch(scene: SnakeScene) -> Capture:
    frames = list(film(scene))
    return capture(frames, make_detector(frames[:: max(1, len(frames) // 5)]), scene.rate_hz)


def median_error(scene: SnakeScene, seen: Capture) -> float:
    truth = true_midlines(scene)
    good = np.flatnonzero(seen.good)
    return float(np.median([point_error(seen.points_px[k], truth[k]) for k in good]))


@pytest.mark.slow_cases(1, "2 cases of 2.1 s of CPU")
@pytest.mark.parametrize("length_px", slow_except([20.0], [20.0, 40.0, 100.0]))
def test_the_error_is_below_a_hundredth_of_the_body(length_px: float) -> None:
    scene = replace(CLEAN, length_px=length_px)
    seen = watch(scene)
    truth = true_midlines(scene)
    assert seen.good.mean() > 0.95
    assert median_error(scene, seen) < 0.01 * length_px
    assert not any(swapped(seen.points_px[k], truth[k]) for k in np.flatnonzero(seen.good))
    assert seen.head_by in {"travel", "wave"}
    assert seen.head_probability > 0.85


@pytest.mark.slow_cases(1, "2 cases of 1.8 s of CPU")
@pytest.mark.slow
@pytest.mark.parametrize("length_px", slow_except([130.0], [50.0, 130.0]))
def test_noise_blur_uneven_light_and_shadow_are_stood(length_px: float) -> None:
    scene = replace(HARSH, length_px=length_px)
    seen = watch(scene)
    truth = true_midlines(scene)
    assert seen.used.all()
    assert seen.good.mean() >= 0.8
    assert median_error(scene, seen) < 0.01 * length_px
    assert not any(swapped(seen.points_px[k], truth[k]) for k in np.flatnonzero(seen.good))


@pytest.mark.slow
def test_a_light_animal_on_dark_ground_with_a_given_background() -> None:
    scene = replace(CLEAN, length_px=90.0, ground=50.0, body=190.0)
    frames = list(film(scene))
    detector = make_detector(frames[::4], empty(scene))
    seen = capture(frames, detector, scene.rate_hz)
    assert detector.polarity is Polarity.LIGHT
    assert detector.background_source == "given"
    assert median_error(scene, seen) < 0.01 * scene.length_px


@pytest.mark.slow
def test_colours_of_equal_brightness_are_told_apart() -> None:
    scene = replace(CLEAN, length_px=90.0, frames=8)
    frames = [np.dstack([f, np.full_like(f, 90), 230 - f]) for f in film(scene)]
    seen = capture(frames, make_detector(frames[::2]), scene.rate_hz)
    assert median_error(scene, seen) < 0.01 * scene.length_px


@pytest.mark.slow
def test_the_head_stays_the_head_after_a_gap() -> None:
    scene = replace(CLEAN, length_px=130.0, frames=22)
    frames = list(film(scene))
    for k in range(8, 14):
        frames[k] = empty(scene)
    seen = capture(frames, make_detector(frames[::4], empty(scene)), scene.rate_hz)
    truth = true_midlines(scene)
    assert np.flatnonzero(~seen.good).tolist() == list(range(8, 14))
    assert seen.counts["nothing seen"] == 6
    assert np.isnan(seen.points_px[8:14]).all()
    assert not any(swapped(seen.points_px[k], truth[k]) for k in np.flatnonzero(seen.good))


@pytest.mark.nightly("a further film: 2 s of CPU")
def test_the_user_may_say_where_the_head_is() -> None:
    scene = replace(CLEAN, length_px=80.0)
    frames = list(film(scene))
    truth = true_midlines(scene)
    tail = (float(truth[0, -1, 0]), float(truth[0, -1, 1]))
    seen = capture(frames, make_detector(frames[::2]), scene.rate_hz, head_px=tail)
    assert seen.head_by == "given"
    assert all(swapped(found, true) for found, true in zip(seen.points_px, truth, strict=True))


@pytest.mark.nightly("a further film: 2 s of CPU")
def test_a_body_cut_by_the_edge_is_told_not_guessed() -> None:
    scene = replace(CLEAN, length_px=100.0)
    # the window's edge runs through the circle on which the animal swims
    long = replace(scene, frames=20, rate_hz=5.0)
    frames = [np.ascontiguousarray(frame[:, 100:]) for frame in film(long)]
    ground = np.ascontiguousarray(empty(scene)[:, 100:])
    seen = capture(frames, make_detector(frames[::4], ground), long.rate_hz)
    truth = true_midlines(long) - [100.0, 0.0]
    outside = truth[:, :, 0].min(axis=1) < 0.0
    assert outside.any()
    assert not (seen.good & outside).any()
    assert "cut by the edge of the image" in seen.counts


@pytest.mark.slow
def test_what_cannot_be_used_is_refused_in_one_line() -> None:
    scene = replace(CLEAN, length_px=80.0, frames=6)
    frames = list(film(scene))
    still = [frames[0]] * 5
    with pytest.raises(InputError, match="no motion"):
        capture(still, make_detector(still), 30.0)
    blank = [empty(replace(scene, seed=k)) for k in range(5)]
    with pytest.raises(InputError, match="no contrast"):
        capture(blank, make_detector(blank), 30.0)
    two = [np.minimum(a, a[::-1, ::-1]) for a in frames]
    with pytest.raises(InputError, match="several animals"):
        capture(two, make_detector(two, empty(scene)), 30.0)
    with pytest.raises(InputError, match="no frames"):
        make_detector([])
    with pytest.raises(InputError, match=r"320 x 240 grey, the background 319 x 240 grey"):
        make_detector(frames, np.ascontiguousarray(empty(scene)[:, 1:]))


def test_the_skeleton_s_thickness_is_the_body_s() -> None:
    from tests.oracles.rendered_snake import half_width

    scene = replace(CLEAN, length_px=150.0, blur_px=0.5, noise=1.0)
    seen = watch(scene)
    middle = np.nanmedian(seen.radius_px, axis=0)[15:70]
    assert np.allclose(middle, half_width(scene)[15:70], rtol=0.15)


@pytest.mark.slow
def test_the_same_film_gives_the_same_skeletons_bit_for_bit() -> None:
    scene = replace(CLEAN, length_px=30.0, frames=5)
    one, other = watch(scene), watch(scene)
    assert one.points_px.tobytes() == other.points_px.tobytes()
