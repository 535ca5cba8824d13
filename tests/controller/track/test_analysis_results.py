"""Results of an analysis from planted waves, speeds and slopes; expected numbers by hand."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.controller.shape.states import StateRange
from snakewalk.controller.track.analysis import Analysis, analyse
from snakewalk.controller.track.pulse_speed import PulseSpeed
from snakewalk.controller.track.track import Track
from snakewalk.controller.track.undulation import Advance, Undulation
from snakewalk.controller.track.wave import Wave

RATE_HZ = 20.0
PAIRS, POINTS = 3, 100
WAVE = Wave(
    waves=1.5,
    frequency_hz=0.9,
    towards_tail=True,
    share=0.95,
    headward=0.0,
    frames_a_cycle=22.0,
    cycles=4.0,
)


def track(angles_rad: np.ndarray | None = None, **more: Any) -> Track:
    if angles_rad is None:
        angles_rad = np.tile(0.02 * np.arange(POINTS), (8, 1))
    frames = len(angles_rad)
    points = np.zeros((frames, POINTS + 1, 2))
    times_s = np.arange(frames) / RATE_HZ
    return Track("planted", angles_rad, points, times_s, RATE_HZ, None, 0, **more)


def planted(
    pulse: float = 4.0,
    along: float = 4.0,
    headward: float = 4.0,
    cosine: float = 1.0,
    error_rad: np.ndarray | float = 0.02,
    recording: Track | None = None,
) -> Analysis:
    """An analysis of a body whose every segment has the same speeds, points of N per frame."""
    shape = (PAIRS, POINTS)
    return Analysis(
        track=recording or track(),
        wave=WAVE,
        pulse=PulseSpeed(
            points_per_frame=np.full(shape, pulse),
            slope=np.full(shape, 0.1),
            error_rad=np.zeros(shape),
            frame=np.arange(1, 1 + PAIRS),
            step=1,
            body_points_per_frame=np.full(PAIRS, pulse),
            body_error_rad=np.broadcast_to(np.asarray(error_rad, dtype=float), shape).copy(),
        ),
        undulation=Undulation(angle_rad=np.arange(100.0), lateral=np.arange(101.0) / 1000.0),
        advance=Advance(np.full(shape, along), np.full(shape, headward), np.full(shape, cosine)),
        energy=np.array([0.9, 0.95, 1.0]),
        states=StateRange(np.zeros(7), np.ones(7)),
    )


def test_a_body_in_its_own_track_travels_with_the_pulse_and_does_not_slide() -> None:
    found = planted()
    assert found.travel_unknown_reason is None
    assert found.travel == pytest.approx(1.0)
    assert found.sliding == pytest.approx(0.0)
    assert found.pulse_body_lengths_s == pytest.approx(4.0 * RATE_HZ / POINTS)


def test_sliding_is_the_share_of_the_heads_speed_without_a_shift() -> None:
    """Head at 5 points a frame, pulse at 4: one fifth of the speed is no shift."""
    found = planted(along=4.5, headward=5.0)
    assert found.travel == pytest.approx(1.125)
    assert found.sliding == pytest.approx(0.2)
    turned = planted(along=4.5, headward=3.0, cosine=0.5)  # 3 + 4 * (1 - 0.5) = 5
    assert turned.sliding == pytest.approx(0.2)
    assert planted(along=4.0, headward=2.0).sliding == pytest.approx(-1.0)


def test_a_head_that_does_not_advance_has_no_share() -> None:
    assert planted(along=4.0, headward=0.0).sliding is None
    assert planted(along=4.0, headward=0.005).sliding == pytest.approx(1.0 - 800.0)


def test_little_travel_is_a_current_or_a_bend_on_the_spot() -> None:
    assert planted(along=0.8).travel_unknown_reason is None  # 0.2, the least
    found = planted(along=0.76)
    assert found.travel_unknown_reason is not None
    assert "goes at 0.19 of the pulse speed" in found.travel_unknown_reason
    assert found.travel is None
    assert found.sliding is None


def test_without_places_or_a_moving_pattern_the_travel_is_unknown() -> None:
    assert replace(planted(), advance=None).travel_unknown_reason == "places are not recorded"
    assert replace(planted(), advance=None).travel is None
    assert replace(planted(), advance=None).sliding is None
    standing = planted(pulse=0.0)
    assert standing.travel_unknown_reason == "the pattern does not move along the body"


def test_unknown_pulses_make_everything_divided_by_them_unknown() -> None:
    found = planted(pulse=np.nan)
    reason = "no part of the body shows how far the pattern moved"
    assert found.pulse_unknown_reason == found.travel_unknown_reason == reason
    coarse = replace(planted(), wave=replace(WAVE, frames_a_cycle=2.0))
    assert coarse.pulse_unknown_reason == coarse.wave.unknown_reason is not None


def test_speeds_are_weighted_by_squared_slope_where_the_pulse_is_known() -> None:
    """Two kinds of points: 4 of slope 0.1, 1 of slope 0.2; the unknown ones do not count."""
    found = planted()
    pulse, slope = np.full((PAIRS, POINTS), np.nan), np.full((PAIRS, POINTS), 0.1)
    assert found.advance is not None
    along = np.full((PAIRS, POINTS), 100.0)
    pulse[0, :2], slope[0, 1], along[0, :2] = (4.0, 1.0), 0.2, (2.0, 3.0)
    found = replace(
        found,
        pulse=replace(found.pulse, points_per_frame=pulse, slope=slope),
        advance=replace(found.advance, along=along),
    )
    assert found.travel == pytest.approx((0.01 * 2.0 + 0.04 * 3.0) / (0.01 * 4.0 + 0.04 * 1.0))


def test_the_error_of_one_speed_follows_the_slope() -> None:
    """Angles n^2 / 10,000: the slope is n / 5000; the error is two points of it."""
    squares = track(np.tile(np.arange(POINTS) ** 2 / 10_000.0, (8, 1)))
    slope = planted(recording=squares).slope_rad
    np.testing.assert_allclose(slope[:, 1:-1], np.tile(np.arange(1, 99) / 5000.0, (PAIRS, 1)))
    found = planted(recording=squares, error_rad=-2.0 * slope).error_slope
    assert found is not None
    assert found == pytest.approx((2.0, 1.0))
    noisy = -2.0 * slope
    noisy[:, 3:] = np.nan  # three points tell it, in all pairs
    assert planted(recording=squares, error_rad=noisy).error_slope == pytest.approx((2.0, 1.0))


def test_an_even_error_or_slope_tells_no_proportion() -> None:
    squares = track(np.tile(np.arange(POINTS) ** 2 / 10_000.0, (8, 1)))
    assert planted(recording=squares, error_rad=0.02).error_slope is None
    assert planted(error_rad=np.linspace(0.0, 1.0, POINTS)).error_slope is None
    few = np.full((PAIRS, POINTS), np.nan)
    few[0, :2] = 0.1, 0.3
    assert planted(recording=squares, error_rad=few).error_slope is None
    few[0, 2] = 0.2
    assert planted(recording=squares, error_rad=few).error_slope is not None


def test_the_facts_are_the_numbers_of_the_results() -> None:
    facts = planted(along=4.5, headward=5.0).facts()
    assert facts["recording"] == "planted"
    assert facts["frames"] == 8
    assert facts["length_m"] is None
    assert facts["frequency_hz"] == 0.9
    assert facts["wavelength_body_lengths"] == 0.667
    assert facts["wave_number_rad_per_body_length"] == 9.425
    assert facts["wave_towards_tail"] is True
    assert facts["pulse_body_lengths_s"] == 0.8
    assert facts["pulse_quartiles_body_lengths_s"] == [0.8, 0.8]
    assert facts["pulse_points_per_frame"] == 4.0
    assert facts["pulse_measured_share"] == 1.0
    assert facts["wave_speed_body_lengths_s"] == round(WAVE.pulse_body_lengths_s, 4)
    assert facts["one_pulse_error_rad"] == 0.02
    assert facts["travel"] == 1.125
    assert facts["sliding_weight"] == 0.2
    assert facts["travel_not_told"] is facts["wave_not_told"] is facts["pulse_not_told"] is None
    assert facts["angle_amplitude_rad"] == [0.0, 25.0, 50.0, 75.0, 99.0]
    assert facts["lateral_amplitude_body_lengths"] == [0.0, 0.025, 0.05, 0.075, 0.1]
    assert facts["bend_k_rad"] == round(0.02 * np.sqrt((POINTS**2 - 1) / 12.0), 3)
    assert facts["energy_kept"] == 0.95
    assert facts["energy_kept_least"] == 0.9
    assert planted(recording=replace(track(), length_m=0.31234567)).facts()["length_m"] == 0.312346


def test_the_quartiles_are_of_all_known_pulses() -> None:
    found = planted()
    speeds = np.tile(np.arange(float(POINTS)), (PAIRS, 1))
    speeds[1:] = np.nan
    pulse = replace(found.pulse, points_per_frame=speeds)
    facts = replace(found, pulse=pulse).facts()
    quartiles = (24.75 * RATE_HZ / POINTS, 74.25 * RATE_HZ / POINTS)
    assert facts["pulse_quartiles_body_lengths_s"] == pytest.approx(quartiles)
    assert facts["pulse_measured_share"] == 0.333
    assert planted(pulse=4.00049).facts()["pulse_points_per_frame"] == 4.0


def test_facts_without_a_wave_or_a_pulse_are_none_and_state_the_reason() -> None:
    short = replace(planted(), wave=replace(WAVE, cycles=0.5)).facts()
    for name in ("frequency_hz", "waves_on_body", "wave_towards_tail", "wave_speed_body_lengths_s"):
        assert short[name] is None
    assert "too short a recording" in short["wave_not_told"]
    assert short["pulse_body_lengths_s"] == 0.8
    unknown = planted(pulse=np.nan, error_rad=np.nan).facts()
    for name in ("pulse_body_lengths_s", "pulse_points_per_frame", "one_pulse_error_rad", "travel"):
        assert unknown[name] is None
    assert unknown["pulse_measured_share"] == 0.0


def in_place(u: float, frames: int = 40, waves: float = 1.5) -> Track:
    """A wave that moves u points a frame along a body whose head stays."""
    place = np.arange(POINTS) - u * np.arange(frames)[:, None]
    return track(0.6 * np.sin(2.0 * np.pi * waves * place / POINTS), places_recorded=False)


@pytest.mark.parametrize(
    ("u", "frames", "step"), [(4.0, 40, 1), (2.0, 40, 2), (8.0, 40, 1), (1.0, 40, 4), (1.0, 23, 2)]
)
def test_frames_are_compared_over_which_the_pattern_moves_four_points(
    u: float, frames: int, step: int
) -> None:
    """23 frames are too few for that at one point a frame: an eighth of them is 2."""
    found = analyse(in_place(u, frames, waves=4.5 if u < 2.0 else 1.5))
    assert found.pulse.step == step
    assert found.pulse.typical == pytest.approx(u, abs=0.03)
    assert found.advance is None
    assert found.energy.shape == (frames,)


def test_a_shift_of_a_quarter_of_the_body_is_found() -> None:
    """Neighbourhoods of nine points and 30 on either side fit on 100 points."""
    assert analyse(in_place(25.0, waves=1.0)).pulse.typical == pytest.approx(25.0, abs=0.1)


def test_an_analysis_needs_motion_and_four_frames() -> None:
    still = np.tile(np.linspace(0.0, 1.0, POINTS), (8, 1))
    with pytest.raises(InputError, match="no motion"):
        analyse(track(still))
    with pytest.raises(InputError, match="needs 4 or more frames, not 3"):
        analyse(in_place(4.0, frames=3))
    with pytest.raises(InputError, match="too few frames follow each other"):
        analyse(replace(in_place(4.0, frames=8), time_s=0.7 * np.arange(8) ** 2))
