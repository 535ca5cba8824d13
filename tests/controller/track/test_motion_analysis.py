"""Pulse speed, sliding, amplitudes and frequency of motions by formula, and of real animals."""

import json
from pathlib import Path

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.controller.animals.synthesis.synthesis import Behaviour, Sampling, Start, synthesise
from snakewalk.controller.mechanics.speed_law import SpeedLaw
from snakewalk.controller.track.analysis import analyse
from snakewalk.controller.track.choice import Choice
from snakewalk.controller.track.pulse_speed import measure_pulse_speed
from snakewalk.controller.track.readers.arrays import save_track
from snakewalk.controller.track.readers.load import load_track
from snakewalk.controller.track.resample import body_points
from snakewalk.controller.track.track import Track, track_from_points
from snakewalk.controller.walk.angle_track import AngleTrack
from tests.helpers.command import snakewalk

pytestmark = pytest.mark.usefixtures("legible_figures")

N = np.arange(100)


def travelling(u: float, frames: int = 60, waves: float = 1.5) -> np.ndarray:
    """Theta(n - u t): 0.6 rad, ``waves`` on the body, u points a frame."""
    place = N - u * np.arange(frames)[:, None]
    return 0.6 * np.sin(2 * np.pi * waves * place / 100)


@pytest.mark.parametrize("u", [0.25, 1.0, 2.6, 7.4, -3.3])
def test_a_travelling_wave_has_its_pulse_speed_everywhere(u: float) -> None:
    found = measure_pulse_speed(travelling(u), np.arange(60))
    known = np.isfinite(found.points_per_frame)
    assert known.mean() > 0.75
    np.testing.assert_allclose(found.points_per_frame[known], u, atol=0.025)
    assert found.error_rad[known].max() < 1e-3


def test_the_printed_sum_is_wrong_and_the_difference_right() -> None:
    """U = u + w ([PT] 2.4) would be 3 + 0.4 here: the model looks up n - (u - w)."""
    at = N[20:80]
    before = np.sin(0.1 * N)
    u, w = 3, 0.4
    model = before[at - u] + w * (before[at + 1 - u] - before[at - u])
    as_u_minus_w = np.abs(model - np.sin(0.1 * (at - (u - w)))).max()
    as_printed = np.abs(model - np.sin(0.1 * (at - (u + w)))).max()
    assert as_u_minus_w < 2e-3 < 0.05 < as_printed
    two = np.stack([np.sin(0.1 * N), np.sin(0.1 * (N - 2.6))])
    found = measure_pulse_speed(two, np.arange(2)).points_per_frame
    assert np.nanmedian(found) == pytest.approx(2.6, abs=0.01)


def test_two_speeds_along_one_body_are_told_apart() -> None:
    """[PT] 2.4: U depends on n; here 2 points a frame in front and 4 behind."""
    place = np.where(N < 50, N / 2.0, 25.0 + (N - 50) / 4.0)  # frames since the head
    angles = 0.5 * np.sin(0.35 * (place - np.arange(40)[:, None]))
    found = measure_pulse_speed(angles, np.arange(40)).points_per_frame
    assert np.nanmedian(found[:, 10:40]) == pytest.approx(2.0, abs=0.05)
    assert np.nanmedian(found[:, 62:90]) == pytest.approx(4.0, abs=0.05)


def _in_place(angles_rad: np.ndarray) -> Track:
    """A body of these angles (T, 100) whose head stays."""
    step = np.stack([np.cos(angles_rad), np.sin(angles_rad)], axis=-1) / 100.0
    points = np.concatenate([np.zeros((len(step), 1, 2)), -step.cumsum(axis=1)], axis=1)
    return track_from_points("made", points, 25.0)


def test_one_speed_for_the_body_leaves_an_error_by_the_slope() -> None:
    """[PT] Fig. 5(a): ``abs(Theta_e - Theta)`` goes with ``abs(Theta_n)`` where speeds differ."""
    even = measure_pulse_speed(travelling(2.6), np.arange(60))
    np.testing.assert_allclose(even.body_points_per_frame, 2.6, atol=0.02)
    assert np.nanmax(np.abs(even.body_error_rad)) < 3e-3
    assert np.isnan(even.body_error_rad[:, :2]).all()  # what comes from beyond the head

    shift = np.where(N < 50, 2.0, 4.0)
    wave = 0.5 * np.sin(0.35 * N)
    moved = 0.5 * np.sin(0.35 * (N - shift))
    found = measure_pulse_speed(np.stack([wave, moved]), np.arange(2))
    one = float(found.body_points_per_frame[0])
    assert one == pytest.approx(3.0, abs=0.15)
    model = 0.5 * np.sin(0.35 * (N - one))
    seen = np.isfinite(found.body_error_rad[0])
    np.testing.assert_allclose(found.body_error_rad[0][seen], (model - moved)[seen], atol=0.01)
    inside = seen & (np.abs(N - 50) > 8)  # nine neighbours with one shift
    error, slope = np.abs(found.body_error_rad[0]), np.abs(np.gradient(moved))
    assert np.corrcoef(error[inside], slope[inside])[0, 1] > 0.9


def test_the_error_does_not_follow_the_slope_where_amplitudes_grow() -> None:
    """No shift makes a wave larger: the error is greatest at its crests, where the slope is 0."""
    wave = np.sin(0.15 * (N - np.arange(80)[:, None]))
    grows = analyse(_in_place((0.2 + 0.9 * N / 100.0) * wave)).error_slope
    assert grows is not None
    assert grows[1] < 0.0


def test_noise_of_one_degree_moves_the_median_little() -> None:
    rng = np.random.default_rng(0)
    noise = rng.normal(0.0, np.radians(1.0), (60, 100))
    found = measure_pulse_speed(travelling(4.0) + noise, np.arange(60))
    assert found.typical == pytest.approx(4.0, abs=0.15)


def test_what_cannot_be_known_is_not_told() -> None:
    angles = travelling(5.0)
    found = measure_pulse_speed(angles, np.arange(60))
    assert np.isnan(found.points_per_frame[:, :9]).all()  # it came from ahead of the head
    straight = angles.copy()
    straight[:, 60:] = straight[:, 60:61]
    flat = measure_pulse_speed(straight, np.arange(60)).points_per_frame
    assert np.isnan(flat[:, 72:]).all()
    gap = np.r_[0:30, 40:70]
    assert len(measure_pulse_speed(angles, gap).frame) == 58  # never across the gap
    with pytest.raises(ValueError, match="cannot look for shifts"):
        measure_pulse_speed(angles, np.arange(60), most=60)


@pytest.mark.parametrize(("waves", "u"), [(1.0, 7.4), (2.5, 7.4), (2.5, -7.4), (1.0, 9.3)])
def test_what_came_from_beyond_an_end_is_never_a_number(waves: float, u: float) -> None:
    """A bend that looks alike before and after its top fits a shift that is far off."""
    found = measure_pulse_speed(travelling(u, waves=waves), np.arange(60)).points_per_frame
    known = np.isfinite(found)
    np.testing.assert_allclose(found[known], u, atol=0.05)
    assert known.mean() > 0.7
    reach = int(np.floor(abs(u)) + 4)
    beyond = found[:, :reach] if u > 0 else found[:, -reach:]
    assert np.isnan(beyond).all()


def test_turned_frames_are_turned_back() -> None:
    """Files of joint angles hold no heading: every frame is turned to mean zero."""
    angles = travelling(3.0, waves=1.3)
    turned = angles - angles.mean(axis=1, keepdims=True)
    blind = measure_pulse_speed(turned, np.arange(60)).points_per_frame
    seeing = measure_pulse_speed(turned, np.arange(60), heading_known=False).points_per_frame
    np.testing.assert_allclose(np.nanmedian(seeing), 3.0, atol=0.05)
    assert np.nanstd(seeing) < 0.2 * np.nanstd(blind)


def wave_track(
    travel: float, amplitude: float = 0.5, rate_hz: float = 40.0, frames: int = 151
) -> Track:
    """1.4 waves at 0.8 Hz for three cycles, head advancing at ``travel`` of the wave's speed."""
    waves, hz, length = 1.4, 0.8, 0.3
    time = np.arange(frames) / rate_hz
    s = (N + 0.5) / 100
    angles = amplitude * np.sin(2 * np.pi * (waves * s - hz * time[:, None]))
    step = np.stack([np.cos(angles[:, 0]), np.sin(angles[:, 0])], axis=-1)
    head = np.cumsum(step, axis=0) * travel * hz / waves / rate_hz
    points = (body_points(angles) + head[:, None]) * length
    return track_from_points("wave", points, rate_hz, scale_m=1.0)


def test_closed_form_of_a_wave() -> None:
    facts = analyse(wave_track(1.0)).facts()
    assert facts["frequency_hz"] == pytest.approx(0.8, rel=0.01)
    assert facts["waves_on_body"] == pytest.approx(1.4, rel=0.02)
    assert facts["wave_number_rad_per_body_length"] == pytest.approx(2.8 * np.pi, rel=0.02)
    assert facts["pulse_body_lengths_s"] == pytest.approx(0.8 / 1.4, rel=0.01)
    assert facts["wave_speed_body_lengths_s"] == pytest.approx(0.8 / 1.4, rel=0.02)
    assert facts["angle_amplitude_rad"] == pytest.approx([0.5] * 5, abs=0.02)
    # y' = sin(0.5 sin(phase)): its first harmonic is 2 J1(0.5), over k for the path itself
    sideways = 2 * 0.24227 / (2.8 * np.pi)
    assert facts["lateral_amplitude_body_lengths"][2] == pytest.approx(sideways, rel=0.15)
    assert facts["length_m"] == pytest.approx(0.3, rel=1e-3)
    assert facts["energy_kept"] > 0.99


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("travel", [0.4, 0.7, 1.0])
def test_travel_and_sliding_weight_of_a_slipping_wave(travel: float) -> None:
    """The head's speed is exact; points behind it slip sideways too, so theirs is near."""
    found = analyse(wave_track(travel, amplitude=0.25))
    assert found.travel == pytest.approx(travel, abs=0.03)
    assert found.sliding is not None
    assert found.sliding < 0.02  # it slips; nothing glides


@pytest.mark.fast_cases(2)
@pytest.mark.parametrize("sliding", [0.0, 0.2, 0.5, 0.8])
def test_the_synthesis_sliding_weight_is_measured_again(sliding: float) -> None:
    """[PT] 2.6.4 forwards, 2.4 backwards: what w_d did is what is found."""
    oldest_first = 0.5 * np.sin(2 * np.pi * np.arange(600) / 60.0)
    track = AngleTrack(oldest_first[:100][::-1])
    track.append(oldest_first[100:])
    law = SpeedLaw.printed(0.15)
    how = Behaviour(sliding=sliding)
    run = synthesise(
        track, law, 120, Sampling(0.04, 0.01), behaviour=how, start=Start(speed_m_s=0.24)
    )
    found = analyse(track_from_points("made", run.points_m[20:], 25.0))
    assert found.sliding == pytest.approx(sliding, abs=0.02)


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("travel", [0.0, -0.6])
def test_who_holds_station_in_a_flow_has_no_sliding_told(travel: float) -> None:
    """Swimming at 0.8 against water of 0.8 or of 1.4: the ground knows nothing of the water."""
    moving = wave_track(travel)
    drift = 0.01 * np.sin(np.arange(moving.frames))[:, None, None] * [1.0, 0.5]
    found = analyse(track_from_points("held", moving.points + drift, moving.rate_hz))
    facts = found.facts()
    assert (facts["travel"], facts["sliding_weight"]) == (None, None)
    assert "holds station in a flow" in facts["travel_not_told"]
    assert facts["frequency_hz"] == pytest.approx(0.8, rel=0.01)  # the wave is what it is
    assert facts["wave_not_told"] is None


@pytest.mark.slow
def test_what_is_not_told_is_no_number_anywhere(tmp_path: Path) -> None:
    """Frames too far apart, and noise: null with the reason in JSON, words in the table."""
    coarse = wave_track(0.8, rate_hz=2.6, frames=60)
    noise = np.random.default_rng(0).normal(0.0, 0.006, (120, 101, 2))
    save_track(tmp_path / "coarse.npz", coarse)
    points = wave_track(0.8, frames=120).points + noise
    save_track(tmp_path / "noisy.npz", track_from_points("noisy", points, 40.0, scale_m=1.0))
    files = [str(tmp_path / name) for name in ("coarse.npz", "noisy.npz")]
    done = snakewalk("animal", "analyse", *files, "--picture", str(tmp_path), "--json")
    assert done.returncode == 0, done.stderr
    assert "NaN" not in done.stdout
    few, noisy = json.loads(done.stdout)
    assert few["pulse_not_told"] == few["wave_not_told"] == few["travel_not_told"]
    assert "frames a cycle are too few" in few["wave_not_told"]
    assert "of the bending" in noisy["wave_not_told"]
    for facts in (few, noisy):
        for key in ("frequency_hz", "waves_on_body", "wave_towards_tail", "time_towards_head"):
            assert facts[key] is None
    for key in ("pulse_body_lengths_s", "travel", "sliding_weight", "one_pulse_error_rad"):
        assert few[key] is None
    assert (tmp_path / "coarse.png").read_bytes().startswith(b"\x89PNG")
    for command in ("analyse", "track"):
        assert "wave not told 3.2 frames" in " ".join(
            snakewalk("animal", command, files[0]).stdout.split()
        )


def test_nothing_to_analyse_is_one_line() -> None:
    still = track_from_points("still", np.stack([body_points(travelling(1.0)[0])] * 6), 10.0)
    with pytest.raises(InputError, match="still: no motion"):
        analyse(still)
    few = track_from_points("few", body_points(travelling(1.0)[:3]), 10.0)
    with pytest.raises(InputError, match="few: an analysis needs 4"):
        analyse(few)


def test_a_real_lamprey(shared_data: Path) -> None:
    """Published with the recording: 3.85 Hz, a wave of 0.57 body lengths; so 2.2 lengths/s."""
    facts = analyse(load_track(str(shared_data / "lamprey" / "lampreydata.csv"))).facts()
    assert facts["frequency_hz"] == pytest.approx(3.85, rel=0.02)
    assert facts["pulse_body_lengths_s"] == pytest.approx(0.57 * 3.85, rel=0.05)
    assert facts["wavelength_body_lengths"] == pytest.approx(0.6, abs=0.06)
    head, *_, tail = facts["lateral_amplitude_body_lengths"]
    assert tail > 3.0 * head  # anguilliform: the tail swings most
    assert 0.07 < tail < 0.11
    assert 0.7 < facts["travel"] < 1.0  # a swimmer slips
    assert facts["energy_kept"] > 0.99


def test_a_real_worm_that_backs_up(shared_data: Path) -> None:
    """Forward, back from second 6.5 to 10.5, an omega turn, forward again."""
    found = analyse(
        load_track(
            str(shared_data / "worm-joint-angles" / "kymogram_omega-turn.npy"), Choice(rate=32.0)
        )
    )
    u = found.pulse.points_per_frame
    when = found.track.time_s[found.pulse.frame]
    assert np.nanmedian(u[(when > 0.5) & (when < 6.0)]) > 0.3
    assert np.nanmedian(u[(when > 7.0) & (when < 10.0)]) < -0.8
    assert np.nanmedian(u[when > 12.5]) > 0.5
    assert found.travel is None


@pytest.mark.nightly("pictures of several tables: 5 s of CPU")
def test_the_command_takes_names_and_files_and_draws(tmp_path: Path) -> None:
    save_track(tmp_path / "mine.npz", wave_track(0.8))
    words = [
        "animal",
        "analyse",
        str(tmp_path / "mine.npz"),
        "lamprey-like",
        "--picture",
        str(tmp_path),
    ]
    done = snakewalk(*words, "--json")
    assert done.returncode == 0, done.stderr
    mine, shipped = json.loads(done.stdout)
    assert mine["travel"] == pytest.approx(0.8, abs=0.06)
    assert shipped["pulse_body_lengths_s"] == pytest.approx(2.3, abs=0.15)
    assert (tmp_path / "mine.png").read_bytes().startswith(b"\x89PNG")
    again = snakewalk(*words)
    assert again.returncode == 2
    assert "mine.png: exists; --force overwrites it" in again.stderr
    table = snakewalk("animal", "analyse", words[2], "--min-score", "0").stdout
    assert "sliding weight" in table


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([], ": is required"),
        (["nosuch"], "nosuch: no such recording or file"),
        (["worm-like", "--picture", "a.docx"], "a.docx: a picture ends in"),
        (["worm-like", "lamprey-like", "--picture", "a.png"], "a.png: one file for 2"),
    ],
)
def test_bad_input_ends_with_2(words: list[str], said: str) -> None:
    done = snakewalk("animal", "analyse", *words)
    assert done.returncode == 2
    assert said in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize("command", ["analyse", "body"])
def test_help_has_an_example(command: str) -> None:
    done = snakewalk("animal", command, "--help")
    assert done.returncode == 0
    assert f"snakewalk animal {command} worm-like" in done.stdout
