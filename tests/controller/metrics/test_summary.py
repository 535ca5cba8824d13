"""The numbers of a run that was made up, so that they are known."""

import dataclasses
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from snakewalk.controller.metrics.path_error import travelled_m
from snakewalk.controller.metrics.summary import summary
from snakewalk.controller.runlog.reader import read_log
from snakewalk.controller.runlog.record import RunRecord

Make = Callable[..., Path]


def test_pauses_of_the_computer_are_counted(record: RunRecord) -> None:
    """A run ended by an old reading, with 0 missed deadlines and 0 failed reads."""
    assert (summary(record).stalls, summary(record).stalled_s) == (0, 0.0)
    stalled_s = np.zeros(len(record.slow.time_s))
    stalled_s[3:], stalled_s[7:] = 0.05, 0.11
    slow = record.slow.with_columns(stalled_s=stalled_s)
    n = summary(dataclasses.replace(record, slow=slow))
    assert (n.stalls, n.stalled_s) == (2, 0.11)


def test_numbers_of_a_known_run(record: RunRecord) -> None:
    n = summary(record)
    assert n.outcome == "3 of 4 waypoints reached"
    assert n.waypoints_reached == n.waypoints_counted == 3
    said = [e.time_s for e in record.events if e.kind == "waypoint"]
    assert n.waypoint_times_s == pytest.approx(said)
    assert n.eta == pytest.approx(0.75, rel=0.01)
    assert n.pulse_m_s == 0.3
    assert n.eta_predicted == pytest.approx(0.8)
    assert n.lag_s == pytest.approx(0.06, abs=3e-3)
    assert n.peak_torque_n_m == pytest.approx(1.78 * n.peak_current_a)
    assert n.missed_deadlines == 3
    assert n.cycles == 1500 - 3
    assert n.wire_use_max == pytest.approx(0.0086 / 0.02)
    assert n.clamps == record.cycle.verdict.count("clamp") == 29
    assert n.vetoes == 0
    assert n.alarms == 1
    assert n.failed_reads == int((~record.cycle.valid).sum()) > 0
    assert n.states_visited == len(set(record.walk.state))
    assert n.state_library["refused"] == 61
    assert n.config_hash == record.header.config_hash
    # the clamp of 0.05 rad on one joint is part of what was sent, so it is an error of tracking
    assert 0.0 < n.tracking_rms_rad < n.tracking_max_rad < 0.2


def test_speed_counts_only_while_the_shape_moves(record: RunRecord) -> None:
    pose = record.pose
    still = np.zeros_like(pose.pulse_m_s)
    stopped = dataclasses.replace(record, pose=dataclasses.replace(pose, pulse_m_s=still))
    n = summary(stopped)
    assert n.eta is None
    assert n.speed_m_s == pytest.approx(travelled_m(pose) / np.ptp(pose.time_s), rel=1e-5)
    moving = np.flatnonzero(pose.pulse_m_s > 0.0)
    span_s = pose.time_s[moving[-1]] - pose.time_s[moving[0]]
    travelled = travelled_m(pose, moving[0], moving[-1])
    assert summary(record).speed_m_s == pytest.approx(travelled / span_s, rel=1e-5)
    assert summary(record).travelled_m == pytest.approx(travelled, rel=1e-5)


def test_the_start_into_the_first_shape_is_no_distance(record: RunRecord) -> None:
    pose, moves = record.pose, record.pose.pulse_m_s > 0.0
    first = int(np.flatnonzero(moves)[0])
    assert first > 20
    swung_m = pose.centre_m.copy()
    rest = np.arange(first - 10)
    swung_m[rest, 1] += 0.3 * np.sin(0.05 * rest)  # as a delay that is not known yet
    swung = dataclasses.replace(record, pose=dataclasses.replace(pose, centre_m=swung_m))
    assert travelled_m(swung.pose) > travelled_m(pose) + 0.2
    assert summary(swung).travelled_m == pytest.approx(summary(record).travelled_m, rel=0.01)


def test_a_trip_is_the_outcome(make: Make, tmp_path: Path) -> None:
    n = summary(read_log(make(tmp_path / "run.mcap", seconds=3.0, trip=True)))
    assert n.outcome == "stopped by safety: joint 7: current 2.4 A for 0.5 s"
    assert n.vetoes == 24


def test_a_cut_log_still_gives_numbers(make: Make, tmp_path: Path) -> None:
    path = make(tmp_path / "run.mcap", seconds=6.0)
    data = path.read_bytes()
    for share in (0.2, 0.5, 0.9):
        path.write_bytes(data[: int(share * len(data))])
        n = summary(read_log(path))
        assert not n.log_complete
        assert "cut or damaged" in n.log_note
        json.dumps(n.to_dict(), allow_nan=False)


def test_a_run_that_never_moved_has_no_nan_in_its_numbers(make: Make, tmp_path: Path) -> None:
    n = summary(read_log(make(tmp_path / "run.mcap", seconds=0.0)))
    assert n.path_error_mean_m is None
    assert n.lag_s is None
    assert n.cycles == n.decisions == 0
    json.dumps(n.to_dict(), allow_nan=False)
