"""The verdict on a run: its sentence, its exit code, and what a user may accept."""

from dataclasses import fields
from typing import Any

import pytest

from snakewalk.controller.metrics.summary import RunSummary
from snakewalk.controller.metrics.verdict import NOT_MEASURED, RunVerdict, verdict
from snakewalk.controller.runlog.record import RunRecord


def numbers(**changes: Any) -> RunSummary:
    """Summary of a run that arrived, measured by the simulator; other values are unknown."""
    arrived: dict[str, Any] = {
        "backend": "sim",
        "outcome": "finished",
        "waypoints": 2,
        "waypoints_reached": 2,
        "path_error_mean_m": 0.0123,
        "travelled_m": 1.5,
        "duration_s": 12.34,
        "pose_evidence": "measured",
        "pose_source": "simulator",
    }
    return RunSummary(**({f.name: None for f in fields(RunSummary)} | arrived | changes))


DEAD_RECKONED = {
    "pose_evidence": "dead-reckoned",
    "pose_source": "joints",
    "waypoints_reached": None,
    "path_error_mean_m": None,
    "travelled_m": None,
    "dead_reckoned_waypoints_reached": 2,
    "dead_reckoned_path_error_mean_m": 0.05,
    "dead_reckoned_travelled_m": 2.5,
}

UNCONFIRMED = DEAD_RECKONED | {"pose_evidence": "unconfirmed", "pose_source": "udp"}


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({}, "2 of 2 waypoints, 1.2 cm from its path, 12.3 s"),
        (
            {"waypoints": 1, "waypoints_reached": 1, "path_error_mean_m": None},
            "1 of 1 waypoint, 12.3 s",
        ),
        ({"waypoints": 0}, "moved 1.50 m, 12.3 s"),
        ({"waypoints": 0, "travelled_m": None, "duration_s": None}, ""),
        (DEAD_RECKONED, "2 of 2 waypoints, 5.0 cm from its path, 12.3 s, by dead reckoning"),
        (UNCONFIRMED, "2 of 2 waypoints, 5.0 cm from its path, 12.3 s, by an unconfirmed pose"),
        (DEAD_RECKONED | {"waypoints": 0}, "moved 2.50 m, 12.3 s, by dead reckoning"),
        ({"waypoints": 0, "trip": "heat"}, "stopped by safety, moved 1.50 m, 12.3 s"),
        ({"waypoints": 0, "outcome": "interrupted by Ctrl-C"}, "interrupted, moved 1.50 m, 12.3 s"),
    ],
)
def test_the_sentence(record: RunRecord, changes: dict[str, Any], sentence: str) -> None:
    assert verdict(record, numbers(**changes)).sentence == sentence


@pytest.mark.parametrize(
    ("changes", "exit_code", "next_command"),
    [
        ({}, 0, None),
        ({"trip": "heat"}, 1, "snakewalk log report a.mcap"),
        ({"trip": "heat", "backend": "/dev/x"}, 1, "snakewalk doctor --port /dev/x"),
        (DEAD_RECKONED, NOT_MEASURED, None),
        (DEAD_RECKONED | {"waypoints": 0}, 0, None),
        (UNCONFIRMED, NOT_MEASURED, "snakewalk pose check None --run None"),
        (UNCONFIRMED | {"waypoints": 0}, NOT_MEASURED, "snakewalk pose check None"),
    ],
)
def test_the_exit_code_and_the_next_command(
    record: RunRecord, changes: dict[str, Any], exit_code: int, next_command: str | None
) -> None:
    found = verdict(record, numbers(**changes), "a.mcap")
    assert (found.exit_code, found.next_command) == (exit_code, next_command)
    assert (found.cause is None) == (exit_code == 0) == (not found.explanation)


def test_a_user_accepts_a_dead_reckoned_arrival_and_nothing_else() -> None:
    assumed = RunVerdict("2 of 2", "dead-reckoned (joints)", NOT_MEASURED, "not measured", None)
    assert assumed.accepted(False) is assumed
    assert assumed.accepted(True) == RunVerdict("2 of 2", assumed.evidence, 0, None, None)
    wrong = RunVerdict("2 of 2", "unconfirmed (udp)", NOT_MEASURED, "did not agree", None)
    assert wrong.accepted(True) is wrong
    missed = RunVerdict("1 of 2", "simulated", 1, "slip", "snakewalk log shadow log.mcap")
    assert missed.accepted(True) is missed
    assert missed.explanation == "exit code 1: slip; more: snakewalk log shadow log.mcap"
