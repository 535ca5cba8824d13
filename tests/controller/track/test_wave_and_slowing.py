"""Wave, direction and slowing of motions whose answers are known in closed form."""

import numpy as np
import pytest

from snakewalk.controller.track.readers.load import load_track
from snakewalk.controller.track.slowing import Demand, joint_demand, slowing
from snakewalk.controller.track.track import Track, track_from_points
from snakewalk.controller.track.wave import measure_wave
from tests.helpers.travelling import RATE_HZ, WAVE_HZ, WAVES, S, ends, wave_angles


def made(angles: np.ndarray) -> Track:
    return track_from_points("made", ends(angles), RATE_HZ)


@pytest.mark.parametrize("towards_tail", [True, False])
def test_a_wave_is_measured_as_it_was_made(towards_tail: bool) -> None:
    wave = measure_wave(made(wave_angles(towards_tail)))
    assert wave.waves == pytest.approx(WAVES, rel=0.01)
    assert wave.frequency_hz == pytest.approx(WAVE_HZ, rel=0.01)
    assert wave.unknown_reason is None
    assert wave.towards_tail is towards_tail
    assert wave.headward == (0.0 if towards_tail else 1.0)
    assert wave.share > 0.95
    speed = WAVE_HZ / WAVES * (1 if towards_tail else -1)
    assert wave.pulse_body_lengths_s == pytest.approx(speed, rel=0.1)


def formula(waves: float, hz: float, seconds: float, rate_hz: float) -> np.ndarray:
    """Points (T, 101, 2) of a pure wave of 0.5 rad, head to tail, one body length long."""
    time = np.arange(round(seconds * rate_hz)) / rate_hz
    return ends(0.5 * np.sin(2 * np.pi * (waves * S - hz * time[:, None]) + 0.4))


def shaken(points: np.ndarray, part: float) -> np.ndarray:
    """The points moved by noise of this part of the body's length."""
    return points + np.random.default_rng(0).normal(0.0, part, points.shape)


@pytest.mark.parametrize(("waves", "hz"), [(0.7, 1.3), (1.5, 0.37), (1.1, 2.9), (2.3, 0.8)])
@pytest.mark.parametrize(("noise", "within"), [(0.0, 0.01), (0.002, 0.02)])
def test_a_pure_wave_comes_back(waves: float, hz: float, noise: float, within: float) -> None:
    """Noise of 0.2 % turns every angle by 0.28 rad (rms), beside 0.35 of the wave."""
    points = shaken(formula(waves, hz, 5.3 / hz, 16.0), noise)
    wave = measure_wave(track_from_points("pure", points, 16.0))
    assert wave.frequency_hz == pytest.approx(hz, rel=within)
    assert wave.waves == pytest.approx(waves, rel=within)
    assert wave.unknown_reason is None


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("name", ["worm-like", "lamprey-like"])
def test_neither_noise_nor_fewer_frames_move_the_frequency(name: str) -> None:
    track = load_track(name)
    whole = measure_wave(track).frequency_hz
    assert track.length_m is not None
    noisy = shaken(track.points / track.length_m, 0.002)
    found = measure_wave(track_from_points(name, noisy, track.rate_hz))
    assert found.frequency_hz == pytest.approx(whole, rel=0.02)
    for every in (2, 3):
        rate = track.rate_hz / every
        fewer = measure_wave(track_from_points(name, track.points[::every], rate))
        assert fewer.frequency_hz == pytest.approx(whole, rel=0.01)
        assert fewer.unknown_reason is None


def test_what_is_no_measured_wave_is_not_told() -> None:
    noisy = shaken(formula(1.5, 1.0, 8.0, 20.0), 0.02)
    assert "of the bending" in str(measure_wave(track_from_points("", noisy, 20.0)).unknown_reason)
    coarse = measure_wave(track_from_points("", formula(1.5, 1.0, 12.0, 3.3), 3.3))
    assert coarse.coarse
    assert "3.3 frames a cycle are too few" in str(coarse.unknown_reason)
    brief = measure_wave(track_from_points("", formula(1.5, 1.0, 1.3, 20.0), 20.0))
    assert "too short a recording" in str(brief.unknown_reason)
    turning = np.linspace(0.0, 1.0, 50)[:, None] + np.zeros(100)
    straight = measure_wave(made(turning))
    assert (straight.share, "0% of the bending" in str(straight.unknown_reason)) == (0.0, True)


def test_a_recording_listed_tail_first_runs_towards_the_head() -> None:
    points = ends(wave_angles())[:, ::-1]
    assert measure_wave(track_from_points("tail first", points, RATE_HZ)).headward == 1.0


def test_a_reversal_is_counted_by_its_time() -> None:
    there = wave_angles()
    wave = measure_wave(made(np.concatenate([there, there[::-1][1:21]])))
    assert wave.headward == pytest.approx(20 / 80, abs=0.05)


def test_the_shipped_waves_carry_the_figures_that_they_were_made_from() -> None:
    wave = measure_wave(load_track("lamprey-like"))
    assert wave.waves == pytest.approx(1.59, rel=0.15)
    assert wave.frequency_hz == pytest.approx(3.83, rel=0.1)
    assert wave.headward < 0.02


def test_a_swinging_joint_needs_its_amplitude_times_omega() -> None:
    rate, hz, size = 200.0, 1.0, 0.7
    time = np.arange(600) / rate
    joints = size * np.sin(2 * np.pi * hz * time)[:, None] * [1.0, 0.5]
    demand = joint_demand(joints, time, rate, hz)
    omega = 2 * np.pi * hz
    smoothed = np.exp(-0.5 / 25)  # the wave keeps 98 %
    assert demand.speed_rad_s.max() == pytest.approx(size * omega * smoothed, rel=0.01)
    assert demand.acceleration_rad_s2.max() == pytest.approx(size * omega**2 * smoothed, rel=0.02)
    assert demand.raw_speed_rad_s == pytest.approx(size * omega, rel=0.01)
    twice = joint_demand(joints, time / 2, 2 * rate, 2 * hz)
    np.testing.assert_allclose(twice.speed_rad_s, 2 * demand.speed_rad_s)
    np.testing.assert_allclose(twice.acceleration_rad_s2, 4 * demand.acceleration_rad_s2)


def test_shaking_points_count_without_smoothing_and_hardly_with_it() -> None:
    rate, time = 60.0, np.arange(600) / 60.0
    clean = 0.5 * np.sin(2 * np.pi * 0.5 * time)[:, None]
    shaken = clean + np.random.default_rng(0).normal(0.0, 0.02, clean.shape)
    demand = joint_demand(shaken, time, rate, 0.5)
    assert demand.raw_speed_rad_s > 4.0
    assert demand.speed_rad_s.max() == pytest.approx(0.5 * np.pi, rel=0.2)


def test_no_speed_is_made_up_across_a_gap() -> None:
    time = np.array([0.0, 0.1, 0.2, 5.0, 5.1])
    joints = np.array([0.0, 0.0, 0.0, 3.0, 3.0])[:, None]
    demand = joint_demand(joints, time, 10.0, 1.0)
    assert demand.raw_speed_rad_s == 0.0
    assert len(demand.speed_rad_s) == 3
    with pytest.raises(ValueError, match="follow each other"):
        joint_demand(joints[[0, 3]], time[[0, 3]], 10.0, 1.0)


def test_speed_asks_for_its_ratio_and_acceleration_for_the_root() -> None:
    demand = Demand(np.array([1.0, 4.0, 8.0, 1.0]), np.array([100.0, 225.0]), 9.0)
    slow = slowing(demand, 2.0, 25.0)
    assert slow.by_speed == 4.0
    assert slow.by_acceleration == 3.0
    assert slow.throughout == 4.0
    assert slow.where_needed == pytest.approx((1 + 2 + 4 + 1) / 4)
    easy = slowing(Demand(np.array([0.5]), np.array([1.0]), 0.5), 2.0, 25.0)
    assert (easy.throughout, easy.where_needed) == (1.0, 1.0)


@pytest.mark.parametrize("wave_hz", [0.0, 1e-18, 1e-6])
def test_a_body_that_does_not_move_demands_nothing(wave_hz: float) -> None:
    """Its wave has a frequency of rounding errors, for which the filter was as wide as memory."""
    still = np.tile(np.linspace(-0.4, 0.4, 8), (40, 1))
    demand = joint_demand(still, np.arange(40) / 25.0, 25.0, wave_hz)
    assert demand.speed_rad_s.max() == pytest.approx(0.0, abs=1e-9)
    assert slowing(demand, 2.0, 20.0).throughout == 1.0
