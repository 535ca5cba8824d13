"""Recordings with gaps, every n-th frame or few cycles: figures from consecutive frames only."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from snakewalk.controller.track.analysis import analyse
from snakewalk.controller.track.choice import Choice
from snakewalk.controller.track.frame_runs import common_step, consecutive, is_mostly_every_nth
from snakewalk.controller.track.readers.arrays import save_track
from snakewalk.controller.track.readers.load import load_file
from snakewalk.controller.track.track import Track, track_from_points
from snakewalk.controller.track.wave import below, measure_wave
from tests.helpers.command import snakewalk
from tests.helpers.travelling import S, ends


def wave_points(frames: int, rate_hz: float, hz: float = 1.0) -> np.ndarray:
    """(T, 101, 2) a wave of 0.5 rad and 1.5 waves that travels forwards."""
    time = np.arange(frames)[:, None] / rate_hz
    bodies = ends(0.5 * np.sin(2 * np.pi * (1.5 * S - hz * time) + 0.4))
    return bodies + 0.1 * time[:, None] * [1.0, 0.0]


def four_gaps(gap: int, frames: int = 500) -> np.ndarray:
    """Numbers of the frames that four gaps leave."""
    kept = np.ones(frames, bool)
    for k in range(4):
        kept[80 + 100 * k : 80 + 100 * k + gap] = False
    return np.flatnonzero(kept)


def cut(number: np.ndarray, rate_hz: float, noise: float = 0.0) -> Track:
    points = wave_points(500, rate_hz)
    points = points + np.random.default_rng(0).normal(0.0, noise, points.shape)
    return track_from_points("cut", points[number], rate_hz, frame=number)


@pytest.mark.fast_cases(2)
@pytest.mark.parametrize("gap", [37, 50])
@pytest.mark.parametrize(("rate_hz", "noise"), [(10.0, 0.0), (25.0, 0.002), (30.0, 0.0)])
def test_four_gaps_do_not_change_the_wave(gap: int, rate_hz: float, noise: float) -> None:
    track = cut(four_gaps(gap), rate_hz, noise)
    wave = measure_wave(track)
    assert wave.frequency_hz == pytest.approx(1.0, abs=1e-3)
    assert wave.waves == pytest.approx(1.5, rel=0.01)
    assert (wave.unknown_reason, wave.towards_tail, wave.headward) == (None, True, 0.0)
    assert track.absent == 4 * gap


@pytest.mark.nightly("a further film: 2 s of CPU")
def test_four_gaps_hardly_change_the_other_figures() -> None:
    gap = 50
    track = cut(four_gaps(gap), 25.0, 0.002)
    facts = analyse(track).facts()
    whole = analyse(cut(np.arange(500), 25.0, 0.002)).facts()
    assert facts["frames_missing"] == 4 * gap
    assert facts["frequency_hz"] == pytest.approx(1.0, abs=1e-3)
    for name in ("pulse_body_lengths_s", "travel", "bend_k_rad"):
        assert facts[name] == pytest.approx(whole[name], rel=0.02), name
    for name in ("angle_amplitude_rad", "lateral_amplitude_body_lengths"):
        np.testing.assert_allclose(facts[name], whole[name], rtol=0.08, atol=0.004)


def test_single_lost_frames_do_not_change_the_wave() -> None:
    lost = np.random.default_rng(1).choice(np.arange(1, 499), 150, replace=False)
    wave = measure_wave(cut(np.setdiff1d(np.arange(500), lost), 30.0, 0.002))
    assert wave.frequency_hz == pytest.approx(1.0, abs=2e-3)
    assert wave.towards_tail


def test_parts_shorter_than_a_cycle_tell_no_wave() -> None:
    number = np.flatnonzero(np.arange(500) % 40 < 20)  # 0.67 cycles of 30 frames, 0.67 without
    wave = measure_wave(cut(number, 30.0))
    assert "the longest part without a gap has 0.7" in str(wave.unknown_reason)


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("every", [2, 5])
def test_a_table_of_every_nth_frame_is_a_recording_at_that_rate(tmp_path: Path, every: int) -> None:
    points = wave_points(240, 30.0)[::every, ::10]
    rows = ["t,frame,point,x_m,y_m"]
    for k, body in enumerate(points):
        rows += [f"{k * every / 30.0:.6f},{k * every},{n},{x:.6f},{y:.6f}"
                 for n, (x, y) in enumerate(body)]  # fmt: skip
    (tmp_path / "nth.csv").write_text("\n".join(rows))
    for rate_hz in (None, 30.0):
        track = load_file(tmp_path / "nth.csv", Choice(rate=rate_hz))
        assert (track.every, track.absent, track.dropped) == (every, 0, 0)
        assert track.rate_hz == pytest.approx(30.0 / every, rel=1e-4)
        assert analyse(track).facts()["frequency_hz"] == pytest.approx(1.0, abs=0.02)


def test_every_nth_frame_with_exceptions_is_read_by_its_times() -> None:
    number = np.append(np.arange(0, 400, 5), [401, 404, 409])
    track = track_from_points("nth", wave_points(410, 30.0)[number], 30.0, frame=number)
    assert track.uneven
    assert track.rate_hz == pytest.approx(6.0)
    assert measure_wave(track).frequency_hz == pytest.approx(1.0, abs=0.02)


def test_runs_and_steps_of_frame_numbers() -> None:
    assert [run.tolist() for run in consecutive(np.array([3, 4, 7, 9, 10]))] == [
        [0, 1],
        [2],
        [3, 4],
    ]
    assert common_step(np.arange(0, 80, 10)) == 10
    assert common_step(np.array([0, 4])) == 1  # two rows are no rule
    assert not is_mostly_every_nth(np.arange(20))


def test_figures_just_below_a_limit_have_the_digits_that_show_it() -> None:
    assert [below(value, 2.0) for value in (1.2, 1.96, 1.996, 1.99996)] == [
        "1.2", "1.96", "1.996", "1.99996",
    ]  # fmt: skip
    brief = measure_wave(track_from_points("", wave_points(59, 30.0)[:59], 30.0))
    assert "1.9" in str(brief.unknown_reason)
    assert "2.0 cycles" not in str(brief.unknown_reason)


@pytest.mark.slow
def test_missing_frames_and_notes_are_in_the_result_of_both_commands(tmp_path: Path) -> None:
    track = cut(four_gaps(37), 25.0)
    rows = ["t,frame,point,x_m,y_m"]
    for k, body in zip(four_gaps(37).tolist(), track.points[:, ::10], strict=True):
        rows += [f"{k / 25.0:.4f},{k},{n},{x:.6f},{y:.6f}" for n, (x, y) in enumerate(body)]
    (tmp_path / "gaps.csv").write_text("\n".join(rows))
    (facts,) = json.loads(snakewalk("animal", "track", str(tmp_path / "gaps.csv"), "--json").stdout)
    assert facts["frames_missing"] == 148
    for name in ("track", "analyse"):
        words = snakewalk("animal", name, str(tmp_path / "gaps.csv")).stdout.split()
        assert "frames missing 148" in " ".join(words)


def test_notes_stay_in_the_file_that_is_written(tmp_path: Path) -> None:
    track = track_from_points("a", wave_points(20, 10.0), 10.0)
    track = replace(track, notes=("2 markers are left out",))
    save_track(tmp_path / "a.npz", track)
    assert load_file(tmp_path / "a.npz").notes == ("2 markers are left out",)
