"""Wave, direction and slowing of motions whose answers are known in closed form."""

import numpy as np
import pytest

from snakewalk.controller.capture.readers.load import load_track
from snakewalk.controller.capture.slowing import Demand, joint_demand, slowing
from snakewalk.controller.capture.track import Track, track_from_points
from snakewalk.controller.capture.wave import measure_wave
from tests.helpers.travelling import RATE_HZ, WAVE_HZ, WAVES, ends, wave_angles


def made(angles: np.ndarray) -> Track:
    return track_from_points("made", ends(angles), RATE_HZ)


@pytest.mark.parametrize("towards_tail", [True, False])
def test_a_wave_is_measured_as_it_was_made(towards_tail: bool) -> None:
    wave = measure_wave(made(wave_angles(towards_tail)))
    assert wave.waves == pytest.approx(WAVES, rel=0.05)
    assert wave.frequency_hz == pytest.approx(WAVE_HZ, rel=0.05)
    assert wave.towards_tail is towards_tail
    assert wave.headward == (0.0 if towards_tail else 1.0)
    assert wave.share > 0.95
    speed = WAVE_HZ / WAVES * (1 if towards_tail else -1)
    assert wave.pulse_body_lengths_s == pytest.approx(speed, rel=0.1)


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
