"""Matching: Eq. 1-3, the search, and angles of rendered fish against known ones."""

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.controller.animals.fish.accuracy import compare
from snakewalk.controller.animals.fish.calibration import calibrate
from snakewalk.controller.animals.fish.fish_film import Stroke, swim
from snakewalk.controller.animals.fish.initial_posture import midline_starts, rough_midline
from snakewalk.controller.animals.fish.match_film import match_film, track_film
from snakewalk.controller.animals.fish.matching import SilhouetteFrame, Target, agreement
from snakewalk.controller.animals.fish.model import fish_model
from snakewalk.controller.animals.fish.pattern_search import pattern_search
from snakewalk.controller.animals.fish.postures import Postures
from snakewalk.controller.animals.fish.raster import Window
from snakewalk.controller.animals.fish.rendered_fish import FilmConditions
from snakewalk.controller.animals.fish.top_view import TopViewFit, search
from tests.helpers.pools import film, side_film

TRUTH = swim()


def part(truth: Postures, frames: range) -> Postures:
    k = list(frames)
    assert truth.height is not None
    assert truth.pitch_rad is not None
    return Postures(
        truth.base[k], truth.head_rad[k], truth.angles_rad[k], truth.joints_at,
        truth.rate_hz / frames.step, height=truth.height[k], pitch_rad=truth.pitch_rad[k],
    )  # fmt: skip


def test_eq_1_is_and_less_xor_over_the_models_area() -> None:
    drawn, seen = (np.zeros((20, 30), dtype=np.uint8) for _ in range(2))
    drawn[5:15, 5:15] = 255
    seen[5:15, 10:25] = 255
    both, apart = 50, 50 + 100
    assert agreement(drawn, seen) == pytest.approx((both - apart) / 100)
    assert agreement(seen, seen) == 1.0
    assert agreement(np.zeros_like(seen), seen) == -np.inf  # the printed quotient has no value


def test_climb_finds_the_top_of_a_ridge_and_never_falls() -> None:
    def ridge(at: np.ndarray) -> float:
        return float(-((at[0] - 1.0) ** 2) - 20.0 * (at[0] + at[1] - 2.0) ** 2)

    found, value = pattern_search(ridge, np.array([3.0, -4.0]), np.array([0.5, 0.5]), halvings=12)
    np.testing.assert_allclose(found, [1.0, 1.0], atol=0.02)
    assert value >= ridge(np.array([3.0, -4.0]))
    held, _ = pattern_search(ridge, np.array([3.0, -4.0]), np.array([0.0, 0.5]), halvings=8)
    assert held[0] == 3.0


@pytest.mark.slow
def test_spine_angles_of_a_rendered_film_are_found() -> None:
    frames = range(20, 150, 20)
    top, _, _ = film(TRUTH, frames, 120.0)
    matched = match_film(lambda: iter(top), len(top), fish_model("carp"), rate_hz=1.5)
    errors = compare(matched.postures, part(TRUTH, frames))
    assert matched.lost == {}
    assert errors.turned_round == 0
    assert np.degrees(np.median(errors.angles_rad)) < 2.0
    assert np.degrees(np.percentile(errors.angles_rad, 95)) < 9.0
    assert np.degrees(np.median(errors.head_rad)) < 1.0
    assert np.median(errors.skeleton) < 0.035


@pytest.mark.slow_cases(1, "2 cases of 1.2 s of CPU")
@pytest.mark.slow
@pytest.mark.parametrize("fins", [0.0, 0.12])
def test_pectoral_fins_are_found_and_do_not_widen_the_body(fins: float) -> None:
    """[TH] 3.2.2: plates on the body; a model without them took 1.3 px of the fins for width."""
    top, drawn, _ = film(TRUTH, range(20, 200, 36), 110.0, fins=fins)
    found = calibrate(fish_model("carp"), top)
    assert found.fin == pytest.approx(fins, abs=0.041)
    assert (found.fin > 0.0) == (fins > 0.0)
    behind = slice(9, 15)  # where fins are rooted, and lie
    px = found.half_width[behind] * found.length_px - drawn.half_width[behind] * drawn.length_px
    assert np.abs(px).max() < 0.8


@pytest.mark.nightly("a further film: 2 s of CPU")
def test_a_side_view_gives_height_and_pitch() -> None:
    frames = range(20, 80, 20)
    top, model, base = film(TRUTH, frames, 80.0)
    side = side_film(TRUTH, frames, model, base, top[0].grey.shape[1])
    matched = match_film(
        lambda: iter(top), len(top), fish_model("carp"), rate_hz=1.5, side=lambda: iter(side)
    )
    assert matched.camera is not None
    assert matched.camera.scale == pytest.approx(1.0, abs=0.04)
    errors = compare(matched.postures, part(TRUTH, frames))
    assert errors.pitch_rad is not None
    assert errors.height is not None
    assert np.degrees(np.median(errors.pitch_rad)) < 2.0
    assert np.median(errors.height) < 0.02


def test_an_edge_one_pixel_wide_says_nothing_two_pixels_away_and_a_wide_one_does() -> None:
    """Eq. 2 as printed: Canny lines are a pixel wide, so K is the same at any larger error."""
    top, model, base = film(
        TRUTH, range(0, 1), 120.0, conditions=FilmConditions(marks=0.0, noise=0.0)
    )
    at = np.array([*base[0], TRUTH.head_rad[0], *TRUTH.angles_rad[0]])
    window = Window(0, 0, top[0].grey.shape[1], top[0].grey.shape[0], 1.0)

    def scores(width: int) -> list[float]:
        view = Target(top[0], window, width)
        shape = TopViewFit(view, model, 1.0)
        return [
            view.edge(shape.outline(at + np.array([0, dy, 0, 0, 0, 0, 0]))) for dy in (3.0, 4.5)
        ]

    near, far = scores(1)
    assert near - far < 0.1
    near, far = scores(5)
    assert near - far > 0.3


def test_coordinates_in_turn_stop_on_a_ridge_where_least_squares_goes_on() -> None:
    """[TH] 3.3.3 changes A0..A3 in turn; two that change against each other stay wrong."""
    frames = range(60, 150, 30)
    top, model, base = film(TRUTH, frames, 120.0)
    off = np.array([0.0, 0.0, 0.0, 0.15, -0.2, 0.2, -0.1])
    printed, ours = [], []
    for seen, k, place in zip(top, frames, base, strict=True):
        truth = np.array([*place, TRUTH.head_rad[k], *TRUTH.angles_rad[k]])
        window = Window(0, 0, seen.grey.shape[1], seen.grey.shape[0], 1.0)
        view = TopViewFit(Target(seen, window, 3), model, 0.3)
        steps = np.array([1.0, 1.0, 0.02, 0.05, 0.05, 0.05, 0.05])
        found, _ = pattern_search(view.value, truth + off, steps, halvings=3)
        printed.append(np.abs(found - truth)[3:].mean())
        match = search(seen, model, [truth + off], from_level=1)
        assert match is not None
        ours.append(np.abs(match.parameters - truth)[3:].mean())
    assert np.median(ours) < 0.6 * np.median(printed)


def test_head_and_tail_of_a_fish_at_rest_are_told_apart_by_its_build() -> None:
    """[TH] 3.3.1 takes the way of the centre for the head's direction: here there is none."""
    still = swim((Stroke("glide", 0.2),))
    top, model, _ = film(still, range(0, 4), 100.0)
    same = [top[0]] * 3  # the centre's way from frame to frame is 0
    for step in track_film(same, model, travel=np.zeros(2)):
        assert step.match is not None
        assert np.cos(step.match.parameters[2] - still.head_rad[0]) > 0.99


def test_a_backing_fish_keeps_its_head() -> None:
    """The printed reading would put the head where the fish goes."""
    ahead = swim((Stroke("glide", 0.5),))
    top, model, _ = film(ahead, range(0, 12, 3), 100.0)
    travel = np.array([-1.0, 0.0])
    for step in track_film(top[::-1], model, travel=travel):
        assert step.match is not None
        assert np.cos(step.match.parameters[2] - ahead.head_rad[0]) > 0.99


def test_frames_without_a_fish_are_left_out_and_it_is_found_again() -> None:
    frames = range(40, 80, 8)
    top, model, _ = film(TRUTH, frames, 90.0)
    empty = SilhouetteFrame(top[0].grey, np.zeros_like(top[0].mask))
    steps = list(track_film([top[0], empty, *top[3:]], model))
    assert [step.match is None for step in steps] == [False, True, False, False]
    assert steps[1].reason == "no silhouette"


def test_the_skeleton_of_a_mask_runs_from_end_to_end_and_gives_starts_both_ways() -> None:
    top, model, base = film(TRUTH, range(70, 71), 150.0)
    line = rough_midline(top[0].mask)
    assert line is not None
    assert np.hypot(*np.diff(line, axis=0).T).sum() == pytest.approx(150.0, rel=0.15)
    heads = [at[2] for at in midline_starts(model, line)]
    assert np.cos(heads[0] - heads[1]) < -0.7
    near = min(np.hypot(*(at[:2] - base[0])) for at in midline_starts(model, line))
    assert near < 0.08 * 150.0
    assert rough_midline(np.zeros((20, 20), dtype=bool)) is None


def test_films_that_hold_no_fish_are_refused_in_one_line() -> None:
    blank = SilhouetteFrame(
        np.full((60, 80), 128, np.uint8), np.zeros((60, 80), bool), "nothing seen"
    )
    with pytest.raises(InputError, match=r"no silhouette of one body in 9 frames \(nothing seen\)"):
        match_film(lambda: iter([blank] * 20), 20, fish_model("carp"), rate_hz=30.0)
    with pytest.raises(InputError, match="at least 2"):
        match_film(lambda: iter([blank]), 1, fish_model("carp"), rate_hz=30.0)
