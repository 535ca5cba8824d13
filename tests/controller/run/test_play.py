"""A recording played in time: within the limits, on the same path as every run."""

import json
from dataclasses import replace
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest
from typer.testing import CliRunner

from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot
from snakewalk.controller.cli.command_line import app
from snakewalk.controller.motion.recorded import RAMP_S
from snakewalk.controller.run.factory import prepare_playback, prepare_run, prepare_walk
from snakewalk.controller.runlog.reader import read_log
from snakewalk.controller.track.recorded_joints import recorded_joints
from tests.helpers.in_process import leave_out_pages


def test_auto_is_as_fast_as_the_joints_can_and_faster_is_refused() -> None:
    """The default just keeps the limits; twice that is one line."""
    prepared = prepare_playback("worm-like")
    assert 0.0 < prepared.speed <= 1.0
    prepared.check_plan()
    with pytest.raises(InputError, match="--speed"):
        prepare_playback("worm-like", speed=min(2.0 * prepared.speed, 10.0) + 1.0)


def test_slower_takes_longer_in_proportion() -> None:
    """Half the speed is twice the time, beside that of the ramps."""
    fast, slow = (prepare_playback("worm-like", speed=speed) for speed in (0.2, 0.1))
    assert slow.duration_s - RAMP_S == pytest.approx(2.0 * (fast.duration_s - RAMP_S))


def test_a_worm_is_played_at_its_own_speed() -> None:
    """The rest before the first frame is no jerk: it does not slow the whole recording."""
    assert prepare_playback("worm-like").speed == 1.0
    with pytest.raises(InputError, match=r"up to 0\.\d+ times the animal's own speed"):
        prepare_playback("lamprey-like", speed=1.0)


def test_a_recording_that_bends_too_far_is_refused_scaled_or_clipped(tmp_path: Path) -> None:
    """Frame, joint and remedy are told; what was done is in the log."""
    robot = load_robot("yaw16")
    time_s = np.arange(91) / 30.0
    wave = 0.4 * np.sin(2.0 * time_s[:, None] + np.arange(16) / 3.0)
    wave[:, 4] += 2.2 * np.exp(-(((time_s - 1.5) / 0.4) ** 2))
    limit, reach = robot.limit_rad[4], float(np.abs(wave[:, 4]).max())
    assert reach > limit
    worst = int(np.argmax(np.abs(wave[:, 4])))
    path = tmp_path / "far.npz"
    np.savez(path, joints_rad=wave, rate_hz=30.0, robot="yaw16")
    least = np.floor(100.0 * limit / (1.003 * reach)) / 100.0  # the spline goes a little beyond
    with pytest.raises(InputError, match=rf"in frame {worst}; its limit is .*--scale {least:.2f}"):
        prepare_playback(str(path))
    small = prepare_playback(str(path), scale=least)
    np.testing.assert_allclose(small.joint_track[1], least * wave)
    assert small.clipped is None
    clipped = prepare_playback(str(path), clip=True)
    _, joints = clipped.joint_track
    assert np.abs(joints).max() <= limit
    calm = np.abs(wave) < 0.85 * limit
    np.testing.assert_array_equal(joints[calm], wave[calm])
    clipped.check_plan()
    told: list[str] = []
    clipped.make_source(lambda kind, text: told.append(text))
    past = np.abs(wave) > robot.limit_rad
    assert told[0] == clipped.clipped
    assert f"in {int(past.any(axis=1).sum())} of 91 frames" in told[0]
    assert f"in frame {worst}" in told[0]
    told.clear()
    small.make_source(lambda kind, text: told.append(text))
    assert told[0] == f"joint angles scaled by {least:g}"


@pytest.mark.slow
def test_joints_of_a_synthesis_are_played_as_they_are(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No detour over midlines where the file holds the robot's own joints; run and log agree."""
    leave_out_pages(monkeypatch)
    robot = load_robot("yaw16")
    time_s = np.arange(61) / 30.0
    wave = 0.2 * np.sin(2.0 * time_s[:, None] + np.arange(16) / 3.0)
    path = tmp_path / "made.npz"
    np.savez(path, joints_rad=wave, rate_hz=30.0, robot="yaw16")
    known_s, joints = recorded_joints(str(path), robot)
    np.testing.assert_allclose(known_s, time_s)
    np.testing.assert_array_equal(joints, wave)
    found = CliRunner().invoke(
        app, ["play", str(path), "--no-film", "--json", "--out", str(tmp_path / "run")]
    )
    assert found.exit_code == 0, found.output
    told = json.loads(found.stdout)
    assert told["tripped"] is None
    record = read_log(Path(told["log"]))
    np.testing.assert_allclose(record.cycle.asked_rad[-1], wave[-1], atol=1e-3)
    header = record.header
    again = prepare_run(header.run, header.robot, header.world)
    np.testing.assert_allclose(again.make_source(lambda kind, text: None).goal_rad(), wave[0])


def test_a_gap_without_midlines_stays_a_gap(tmp_path: Path) -> None:
    """Frames that a capture left out are not crossed by a line between shapes."""
    at = np.arange(200)
    missing = (at > 80) & (at < 130)
    body = np.linspace(0.0, 1.0, 12)
    wave = 0.05 * np.sin(2.0 * np.pi * (at[:, None] / 50.0 - body))
    points = np.stack([np.broadcast_to(-body, wave.shape), wave], axis=-1)
    points[missing] = np.nan
    path = tmp_path / "capture.npz"
    np.savez(path, points=points, rate_hz=50.0)
    time_s, joints = recorded_joints(str(path), load_robot("yaw16"))
    assert len(time_s) == len(joints) == 151
    np.testing.assert_allclose(time_s[[0, 80, 81, -1]], [0.0, 1.6, 2.6, 3.98])
    assert any("1 gaps, of up to 1 s" in line for line in prepare_playback(str(path)).notes)


def test_a_recording_of_which_no_shape_is_used_is_told() -> None:
    """Shapes that only slip are left out; then the walk is not the animal's, and says so."""
    prepared = prepare_walk("flat-slalom")
    assert prepared.warnings == ()
    unused = replace(prepared)
    unused.__dict__["library"] = replace(prepared.library, recorded=0)
    (line,) = unused.warnings
    assert line.startswith("no shape of worm-like is used")
    events: list[str] = []
    unused.make_source(lambda kind, text: events.append(text))
    assert events == [line]
    assert prepare_walk("flat-slalom", motion="serpenoid").warnings == ()


@pytest.mark.parametrize("arguments", [["nowhere.npz"], ["worm-like", "--speed", "quick"]])
def test_bad_input_is_one_line(arguments: list[str]) -> None:
    """No such recording, no such speed."""
    found = CliRunner().invoke(app, ["play", *arguments])
    assert isinstance(found.exception, InputError)
    assert len(found.exception.faults) == 1


def test_a_motion_without_thrust_is_reported(tmp_path: Path) -> None:
    """A standing wave bends the joints, and friction returns the body to its place."""
    time_s = np.arange(121) / 30.0
    beat, place = np.pi * time_s[:, None], 0.6 * np.arange(16)
    waves = {"standing": np.sin(beat) * np.sin(place), "travelling": np.sin(place - beat)}
    for name, wave in waves.items():
        path = tmp_path / f"{name}.npz"
        np.savez(path, joints_rad=0.3 * wave, rate_hz=30.0, robot="yaw16")
        on_event = Mock()
        prepare_playback(str(path)).make_source(on_event)
        told = [call.args[1] for call in on_event.mock_calls if call.args[0] == "thrust"]
        assert len(told) == (name == "standing")
        assert all("the traction model predicts" in text and "no thrust" in text for text in told)
