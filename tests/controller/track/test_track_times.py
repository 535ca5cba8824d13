"""Frames at uneven times: bodies between them at an even rate, gaps left as gaps."""

import json
from pathlib import Path

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.controller.run.factory import prepare_playback
from snakewalk.controller.track.analysis import analyse
from snakewalk.controller.track.choice import Choice
from snakewalk.controller.track.frame_status import FrameStatus
from snakewalk.controller.track.readers.load import load_track
from snakewalk.controller.track.resample import body_points
from snakewalk.controller.track.track import track_from_points


def bodies(time_s: np.ndarray) -> np.ndarray:
    """(T, 101, 2) a wave of 0.8 Hz and 1.5 waves, going forward at a tenth of its speed."""
    s = (np.arange(100) + 0.5) / 100
    angles = 0.6 * np.sin(2.0 * np.pi * (1.5 * s - 0.8 * time_s[:, None]))
    return body_points(angles) + 0.05 * time_s[:, None, None] * [1.0, 0.0]


def uneven_s(frames: int) -> np.ndarray:
    return np.cumsum(np.random.default_rng(3).uniform(0.02, 0.06, frames))


def test_bodies_lie_where_they_were_between_the_frames() -> None:
    time_s = uneven_s(250)
    track = track_from_points("phone", bodies(time_s), 30.0, time_s=time_s, scale_m=1.0)
    assert track.uneven
    assert track.rate_hz == pytest.approx(1.0 / np.median(np.diff(time_s)))
    steps = np.diff(track.time_s) * track.rate_hz
    assert np.allclose(steps, np.rint(steps))
    error = np.hypot(*(track.points - bodies(track.time_s + time_s[0])).transpose(2, 0, 1))
    assert error.max() < 1e-3
    by_number = track_from_points("phone", bodies(time_s), 30.0, scale_m=1.0)
    assert np.hypot(*(by_number.points - bodies(by_number.time_s + time_s[0])).T).max() > 0.1
    facts = analyse(track).facts()
    assert facts["frequency_hz"] == pytest.approx(0.8, rel=0.01)


def test_no_body_is_put_into_a_gap() -> None:
    time_s = uneven_s(80)
    time_s[40:] += 1.0
    points = bodies(time_s)
    points[60] = np.nan
    status = [FrameStatus.GOOD] * 60 + [FrameStatus.LARGER] + [FrameStatus.ROUGH] * 19
    track = track_from_points("phone", points, 30.0, time_s=time_s, status=status)
    inside = (track.time_s > time_s[39] - time_s[0]) & (track.time_s < time_s[40] - time_s[0])
    beside = (track.time_s > time_s[59] - time_s[0]) & (track.time_s < time_s[61] - time_s[0])
    assert not inside.any()
    assert not beside.any()
    assert track.dropped == 1
    assert set(track.status) == {FrameStatus.GOOD, FrameStatus.ROUGH}
    assert track.status[-1] is FrameStatus.ROUGH


def test_even_times_change_nothing() -> None:
    time_s = np.rint(1e3 * np.arange(40) / 30.0) * 1e-3
    one = track_from_points("a", bodies(time_s), 30.0)
    other = track_from_points("a", bodies(time_s), 30.0, time_s=time_s)
    assert not other.uneven
    assert one.angles_rad.tobytes() == other.angles_rad.tobytes()
    with pytest.raises(InputError, match="must increase"):
        track_from_points("a", bodies(time_s), 30.0, time_s=time_s[::-1])


def test_files_with_times_are_read_by_them(tmp_path: Path) -> None:
    time_s = uneven_s(60)
    points = bodies(time_s)
    np.savez(tmp_path / "a.npz", points=points, t=time_s, length_m=1.0)
    wcon = {
        "units": {"t": "s", "x": "m", "y": "m"},
        "data": [{"id": "1", "t": time_s.tolist(), "x": points[..., 0].tolist(),
                  "y": points[..., 1].tolist()}],
    }  # fmt: skip
    (tmp_path / "a.wcon").write_text(json.dumps(wcon))
    rows = ["t,frame,point,x_m,y_m"]
    for k, (at, body) in enumerate(zip(time_s, points[:, ::10], strict=True)):
        rows += [f"{at:.6f},{k},{n},{x:.6f},{y:.6f}" for n, (x, y) in enumerate(body)]
    (tmp_path / "a.csv").write_text("\n".join(rows))
    for name in ("a.npz", "a.wcon", "a.csv"):
        track = load_track(str(tmp_path / name))
        assert track.uneven, name
        assert track.time_s[-1] == pytest.approx(time_s[-1] - time_s[0], abs=0.05)
        assert not load_track(str(tmp_path / name), Choice(rate=25.0)).uneven


def test_an_assumed_rate_stays_assumed_in_the_file_that_is_written(tmp_path: Path) -> None:
    from snakewalk.controller.track.readers.arrays import save_track

    np.savez(tmp_path / "pixels.npz", skeletons=100.0 * bodies(np.arange(20) / 30.0))
    first = load_track(str(tmp_path / "pixels.npz"))
    save_track(tmp_path / "again.npz", first)
    assert first.rate_assumed
    assert load_track(str(tmp_path / "again.npz")).rate_assumed
    assert not load_track(str(tmp_path / "again.npz"), Choice(rate=30.0)).rate_assumed


def test_milliseconds_in_a_table_are_asked_about(tmp_path: Path) -> None:
    time_s = np.arange(60) / 50.0
    table = ["t,frame,point,x_m,y_m"]
    for frame, body in enumerate(bodies(time_s)[:, ::10]):
        table += [
            f"{20 * frame},{frame},{point},{x:.5f},{y:.5f}"
            for point, (x, y) in enumerate(body.tolist(), start=1)
        ]
    path = tmp_path / "ms.csv"
    path.write_text("\n".join(table))
    with pytest.raises(
        InputError, match=r"0\.05 Hz \(--time-unit s\) or .* 50 Hz \(--time-unit ms\)"
    ):
        load_track(str(path))
    assert load_track(str(path), Choice(rate=50.0)).time_s[-1] == pytest.approx(1.18)
    assert load_track(str(path), choice=Choice(time_unit="ms")).time_s[-1] == pytest.approx(1.18)
    with pytest.raises(InputError, match="--time-unit s"):
        _ = prepare_playback(str(path)).joint_track
    played = prepare_playback(str(path), time_unit="ms")
    assert played.joint_track[0][-1] == pytest.approx(1.18)
