"""The verdict on a run: its sentence, its exit code, and the same wherever a result is stated."""

import json
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from snakewalk.controller.cli.command_line import app
from snakewalk.controller.learning.policy_trials import PolicyTrial, measure_trial
from snakewalk.controller.metrics.summary import RunSummary
from snakewalk.controller.metrics.verdict import NOT_MEASURED, RunVerdict, verdict
from snakewalk.controller.run.kinds.gait_factory import prepare_gait
from snakewalk.controller.run.observers import Observers
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.runlog.record import Event, RunRecord
from snakewalk.controller.runlog.row_line import VERDICT
from snakewalk.controller.studies import trials


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
        (
            UNCONFIRMED,
            "believes 2 of 2 waypoints, 5.0 cm from its path, 12.3 s, by an unconfirmed pose",
        ),
        (DEAD_RECKONED | {"waypoints": 0}, "moved 2.50 m, 12.3 s, by dead reckoning"),
        ({"waypoints_reached": 1}, "1 of 2 waypoints, 1.2 cm from its path, 12.3 s"),
        ({"waypoints": 0, "trip": "heat"}, "stopped by safety, moved 1.50 m, 12.3 s"),
        ({"waypoints": 0, "outcome": "interrupted by Ctrl-C"}, "interrupted, moved 1.50 m, 12.3 s"),
    ],
)
def test_the_sentence(record: RunRecord, changes: dict[str, Any], sentence: str) -> None:
    assert verdict(record, numbers(**changes)).sentence == sentence


@pytest.mark.parametrize(
    ("changes", "evidence"),
    [
        ({}, "simulated"),
        ({"pose_source": "udp"}, "measured (udp)"),
        ({"pose_source": "udp", "pose_is_simulated": True}, "measured (udp, simulated)"),
        (DEAD_RECKONED, "dead-reckoned (joints)"),
    ],
)
def test_the_evidence(record: RunRecord, changes: dict[str, Any], evidence: str) -> None:
    assert verdict(record, numbers(**changes)).evidence == evidence


@pytest.mark.parametrize(
    ("changes", "exit_code", "next_command"),
    [
        ({}, 0, None),
        ({"pose_source": "udp", "pose_position_sd_m": 0.9}, 0, None),
        ({"pose_source": "udp", "pose_position_sd_m": 1.3}, NOT_MEASURED, None),
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
    assert found.text == "; ".join(filter(None, (found.sentence, found.explanation)))


def test_exit_code_3_is_explained(record: RunRecord) -> None:
    found = verdict(record, numbers(**DEAD_RECKONED))
    assert found.failure is None
    assert found.explanation == (
        "exit code 3: the arrival is dead-reckoned, nothing measured the pose; give a pose source "
        "with --pose, or accept it with --accept-dead-reckoning"
    )


def test_a_stop_by_safety_names_its_cause(record: RunRecord) -> None:
    trip = Event(2.0, "error", "trip", "joint yaw_05 (ID 5): 2.1 A")
    found = verdict(replace(record, events=(trip,)), numbers(trip=trip.text), "a/log.mcap")
    assert found.failure == "safety"
    assert found.with_cause == f"{found.sentence}; stopped by safety: {trip.text}"
    assert found.explanation == (
        f"exit code 1: stopped by safety: {trip.text}; more: snakewalk log report a/log.mcap"
    )


def test_a_missed_waypoint_has_exit_code_1(record: RunRecord) -> None:
    found = verdict(record, numbers(waypoints_reached=1))
    assert (found.exit_code, found.sentence[:16]) == (1, "1 of 2 waypoints")


def test_a_user_accepts_a_dead_reckoned_arrival_and_nothing_else() -> None:
    assumed = RunVerdict("2 of 2", "dead-reckoned (joints)", NOT_MEASURED, "not measured", None)
    assert assumed.accepted(False) is assumed
    assert assumed.accepted(True) == RunVerdict("2 of 2", assumed.evidence, 0, None, None)
    wrong = RunVerdict("2 of 2", "unconfirmed (udp)", NOT_MEASURED, "did not agree", None)
    assert wrong.accepted(True) is wrong
    missed = RunVerdict("1 of 2", "simulated", 1, "slip", "snakewalk log shadow log.mcap")
    assert missed.accepted(True) is missed
    assert missed.explanation == "exit code 1: slip; more: snakewalk log shadow log.mcap"


def test_observers_get_the_verdict_of_the_result() -> None:
    pytest.importorskip("mujoco")
    rows = []

    class Listener:
        def on_row(self, topic: str, row: bytes) -> None:
            if topic == VERDICT:
                rows.append(json.loads(row))

        def on_button(self, path: Path) -> None:
            pass

        def on_picture(self, image: Any, time_s: float) -> None:
            pass

    prepared = prepare_gait("lateral-undulation", seconds=1.0)
    result = run_robot(RunRequest(prepared, observers=Observers(Listener()), stoppable=False))
    assert rows == [result.verdict.to_dict()]
    assert RunVerdict(**rows[0]) == result.verdict
    assert result.verdict.sentence.startswith("moved ")


def test_the_tables_of_trials_state_the_verdict() -> None:
    pytest.importorskip("mujoco")
    case = trials.Case("lateral-undulation", "gait")
    trial = trials.run_trial(case, 0, 0.0, {"seconds": 1.0})
    assert trial.verdict.startswith("moved ")
    assert (trial.exit_code, trial.cause, trial.why) == (0, "", "")
    (row,) = trials.table([trial, replace(trial, seed=1, exit_code=3)], [case])
    assert row.exit_codes == {"0": 1, "3": 1}


def test_the_trials_of_policies_state_the_verdict() -> None:
    pytest.importorskip("mujoco")
    result = measure_trial(PolicyTrial("lateral-undulation", "flat", 0, 5.0))
    assert result.verdict.sentence.startswith("moved ")
    assert (result.verdict.evidence, result.is_tripped) == ("simulated", False)


def test_the_comparison_states_the_verdicts(record: RunRecord, make: Any, tmp_path: Path) -> None:
    logs = [str(make(tmp_path / f"{s:g}.mcap", seconds=s)) for s in (4.0, 8.0)]
    done = CliRunner().invoke(app, ["log", "compare", *logs, "--json"])
    one, other = (each["verdict"] for each in json.loads(done.stdout)["summaries"])
    assert one["sentence"] != other["sentence"]
    words = " ".join(CliRunner().invoke(app, ["log", "compare", *logs]).stdout.split())
    assert f"verdict {one['sentence']} {other['sentence']}" in words
    assert one["exit_code"] == other["exit_code"]
    assert "exit code" not in words  # only differences are listed
