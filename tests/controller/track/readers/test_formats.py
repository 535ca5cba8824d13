"""One wave by formula, saved in every format, loads back to the same angles."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from snakewalk.controller.track.choice import Choice
from snakewalk.controller.track.readers.arrays import save_track
from snakewalk.controller.track.readers.load import load_track
from snakewalk.controller.track.resample import body_points, equal_arc_length, tangent_angles
from snakewalk.controller.track.track import track_from_points
from tests.helpers.travelling import FRAMES, RATE_HZ, ends, wave_angles

Save = Callable[[Path, np.ndarray], Path]


def midline_csv(folder: Path, angles: np.ndarray, unit: str = "mm", length: float = 200.0) -> Path:
    points = ends(angles, length)[:, ::5]
    rows = [f"t,frame,point,x_{unit},y_{unit}"]
    for k, body in enumerate(points):
        rows += [f"{k / RATE_HZ},{k + 1},{p + 1},{x},{y}" for p, (x, y) in enumerate(body)]
    (folder / "midline.csv").write_text("\n".join(rows))
    return folder / "midline.csv"


def sleap_csv(folder: Path, angles: np.ndarray) -> Path:
    points = ends(angles, 500.0)[:, ::5] * [1, -1] + 700  # pixels, rows downwards
    names = [f"k{p}.{axis}" for p in range(points.shape[1]) for axis in ("x", "y", "score")]
    rows = [",".join(["track", "frame_idx", "instance.score", *names])]
    for k, body in enumerate(points):
        rows.append(",".join(["", str(k), "1.0", *(f"{x},{y},0.9" for x, y in body)]))
    (folder / "sleap.csv").write_text("\n".join(rows))
    return folder / "sleap.csv"


def joints_npy(folder: Path, angles: np.ndarray) -> Path:
    np.save(folder / "joints.npy", angles[:, :-1] - angles[:, 1:])
    return folder / "joints.npy"


def skeletons_npz(folder: Path, angles: np.ndarray) -> Path:
    pixels = ends(angles, 80.0)[:, ::2] * [1, -1] + 40
    np.savez(folder / "skeletons.npz", skeletons=pixels.astype(np.float32))
    return folder / "skeletons.npz"


def angles_npz(folder: Path, angles: np.ndarray) -> Path:
    np.savez(folder / "angles.npz", angles_rad=angles, rate_hz=RATE_HZ, length_m=0.2)
    return folder / "angles.npz"


def points_npz(folder: Path, angles: np.ndarray) -> Path:
    np.savez(folder / "points.npz", points=ends(angles, 0.2), rate_hz=RATE_HZ, length_m=0.2)
    return folder / "points.npz"


@pytest.mark.parametrize(
    ("save", "length_m", "assumed", "faced"),
    [
        (midline_csv, 0.2, False, True),
        (sleap_csv, None, True, True),
        (joints_npy, None, True, False),
        (skeletons_npz, None, True, True),
        (angles_npz, 0.2, False, True),
        (points_npz, 0.2, False, True),
    ],
)
def test_every_format_gives_back_the_same_angles(
    save: Save, length_m: float | None, assumed: bool, faced: bool, tmp_path: Path
) -> None:
    angles = wave_angles()
    track = load_track(str(save(tmp_path, angles)))
    wanted = angles if faced else angles - angles.mean(axis=1, keepdims=True)
    assert np.abs(track.angles_rad - wanted).max() < 0.02
    assert (track.frames, track.dropped, track.flips) == (FRAMES, 0, 0)
    assert track.rate_assumed is assumed
    assert track.rate_hz == pytest.approx(track.rate_hz if assumed else RATE_HZ)
    assert track.length_m == (None if length_m is None else pytest.approx(length_m, rel=1e-3))
    again = load_track(str(save(tmp_path, angles)), Choice(rate=12.5))
    assert (again.rate_hz, again.rate_assumed) == (12.5, False)
    assert again.time_s[-1] == pytest.approx((FRAMES - 1) / 12.5)


def test_a_csv_in_metres_is_as_long_as_it_says(tmp_path: Path) -> None:
    track = load_track(str(midline_csv(tmp_path, wave_angles(), "m", 1.7)))
    assert track.length_m == pytest.approx(1.7, rel=1e-3)


def test_our_own_format_keeps_all_of_a_track_gaps_too(tmp_path: Path) -> None:
    points = ends(wave_angles(), 0.3)
    points[[0, 7, 8]] = np.nan
    first = track_from_points("eel", points, RATE_HZ, scale_m=1.0)
    first = replace(first, source="the sea", licence="CC0")
    save_track(tmp_path / "eel.npz", first)
    again = load_track(str(tmp_path / "eel.npz"))
    np.testing.assert_allclose(again.angles_rad, first.angles_rad, atol=1e-9)
    np.testing.assert_allclose(np.diff(again.time_s), np.diff(first.time_s))
    assert (again.name, again.source, again.licence) == ("eel", "the sea", "CC0")


def test_empty_frames_are_left_out_counted_and_their_time_stays_empty() -> None:
    points = ends(wave_angles())
    points[10:13, 4] = np.nan
    points[20] = 0.0  # all points in one place: no body either
    track = track_from_points("gap", points, RATE_HZ)
    assert (track.frames, track.dropped) == (FRAMES - 4, 4)
    assert np.diff(track.time_s).max() == pytest.approx(4 / RATE_HZ)
    np.testing.assert_allclose(track.angles_rad[9], wave_angles()[9], atol=0.01)


def test_angles_do_not_jump_when_a_body_turns_round_and_round() -> None:
    turning = wave_angles() + np.linspace(0.0, 5 * np.pi, FRAMES)[:, None]
    track = track_from_points("circling", ends(turning), RATE_HZ)
    assert np.abs(track.angles_rad - turning).max() < 0.02


def test_exchanged_heads_and_tails_are_seen() -> None:
    points = ends(wave_angles())
    points[30:40] = points[30:40, ::-1]
    assert track_from_points("flip", points, RATE_HZ).flips == 2


def test_equal_arcs_of_a_circle_turn_by_equal_angles() -> None:
    at = np.linspace(0.0, 1.0, 12) ** 1.5 * 2.0  # uneven points on a circle of radius 1
    even = equal_arc_length(np.stack([np.cos(at), np.sin(at)], axis=-1))
    turn = np.diff(tangent_angles(even))
    np.testing.assert_allclose(turn, 2.0 / 100, atol=2e-3)
    np.testing.assert_allclose(turn.sum(), 2.0 * 99 / 100, atol=5e-3)


def test_tangent_angles_and_points_are_inverse() -> None:
    angles = wave_angles()
    np.testing.assert_allclose(tangent_angles(body_points(angles, 0.4)), angles, atol=1e-9)
