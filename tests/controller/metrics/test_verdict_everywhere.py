"""The verdict on a run: its labels, and the same verdict wherever a result is stated."""

import dataclasses
import json
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from snakewalk.controller.cli.command_line import app
from snakewalk.controller.metrics.summary import RunSummary, summary
from snakewalk.controller.metrics.verdict import RunVerdict, verdict
from snakewalk.controller.run.kinds.gait_factory import prepare_gait
from snakewalk.controller.run.observers import Observers
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.runlog.record import Event, RunRecord
from snakewalk.controller.runlog.row_line import VERDICT
from snakewalk.controller.studies import trials

ARRIVED = {
    "waypoints": 5,
    "waypoints_reached": 5,
    "path_error_mean_m": 0.0239,
    "duration_s": 40.84,
    "trip": None,
    "backend": "sim",
    "pose_evidence": "measured",
    "pose_source": "simulator",
    "outcome": "every waypoint reached",
}
RECKONED = {
    "pose_evidence": "dead-reckoned",
    "pose_source": "joints",
    "pose_is_simulated": False,
    "port_is_pseudo_terminal": False,
    "waypoints_reached": None,
    "dead_reckoned_waypoints_reached": 5,
    "dead_reckoned_path_error_mean_m": 0.0114,
}


@pytest.fixture(scope="module")
def arrived(record: RunRecord) -> RunSummary:
    return dataclasses.replace(summary(record), **ARRIVED)


@pytest.mark.parametrize(
    ("changes", "sentence", "evidence", "exit_code"),
    [
        ({}, "5 of 5 waypoints, 2.4 cm from its path, 40.8 s", "simulated", 0),
        (
            {"waypoints": 1, "waypoints_reached": 1, "pose_source": "udp", "backend": "/dev/x"},
            "1 of 1 waypoint, 2.4 cm from its path, 40.8 s",
            "measured (udp)",
            0,
        ),
        (
            {"waypoints": 0, "waypoints_reached": None, "travelled_m": 1.234},
            "moved 1.23 m, 40.8 s",
            "simulated",
            0,
        ),
        (
            RECKONED,
            "5 of 5 waypoints, 1.1 cm from its path, 40.8 s, by dead reckoning",
            "dead-reckoned (joints)",
            3,
        ),
        (
            {"waypoints_reached": 3},
            "3 of 5 waypoints, 2.4 cm from its path, 40.8 s",
            "simulated",
            1,
        ),
        (
            {"waypoints_reached": 3, "trip": "joint 4: 2.1 A"},
            "stopped by safety, 3 of 5 waypoints, 2.4 cm from its path, 40.8 s",
            "simulated",
            1,
        ),
        (
            {"waypoints_reached": 3, "outcome": "interrupted after 3"},
            "interrupted, 3 of 5 waypoints, 2.4 cm from its path, 40.8 s",
            "simulated",
            1,
        ),
    ],
)
def test_a_verdict_has_labels_and_rounded_numbers(
    record: RunRecord,
    arrived: RunSummary,
    changes: dict[str, Any],
    sentence: str,
    evidence: str,
    exit_code: int,
) -> None:
    numbers = dataclasses.replace(arrived, pose_is_simulated=False, port_is_pseudo_terminal=False)
    found = verdict(record, dataclasses.replace(numbers, **changes))
    assert (found.sentence, found.evidence, found.exit_code) == (sentence, evidence, exit_code)
    assert bool(found.explanation) == (found.cause is not None) == bool(exit_code)
    assert found.text.startswith(sentence)


def test_exit_code_3_is_explained_and_may_be_accepted(
    record: RunRecord, arrived: RunSummary
) -> None:
    found = verdict(record, dataclasses.replace(arrived, **RECKONED))
    assert found.explanation == (
        "exit code 3: the arrival is dead-reckoned, nothing measured the pose; give a pose source "
        "with --pose, or accept it with --accept-dead-reckoning"
    )
    assert found.failure is None
    accepted = found.accepted(True)
    assert (accepted.exit_code, accepted.explanation) == (0, "")
    assert accepted.sentence == accepted.text == found.sentence
    assert found.accepted(False) == found


@pytest.mark.parametrize(
    ("backend", "command"),
    [
        ("sim", "snakewalk log report a/log.mcap"),
        ("/dev/ttyUSB0", "snakewalk doctor --port /dev/ttyUSB0"),
    ],
)
def test_a_stop_by_safety_names_cause_and_next_command(
    record: RunRecord, arrived: RunSummary, backend: str, command: str
) -> None:
    trip = Event(2.0, "error", "trip", "joint yaw_05 (ID 5): 2.1 A")
    stopped = dataclasses.replace(record, events=(trip,))
    numbers = dataclasses.replace(arrived, trip=trip.text, backend=backend)
    found = verdict(stopped, numbers, "a/log.mcap")
    assert found.failure == "safety"
    assert found.explanation == f"exit code 1: stopped by safety: {trip.text}; more: {command}"


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
    (row,) = trials.table([trial, dataclasses.replace(trial, seed=1, exit_code=3)], [case])
    assert row.exit_codes == {"0": 1, "3": 1}


def test_the_comparison_states_the_verdicts(record: RunRecord, make: Any, tmp_path: Path) -> None:
    log = str(make(tmp_path / "one.mcap", seconds=4.0))
    done = CliRunner().invoke(app, ["log", "compare", log, log, "--json"])
    one, other = (each["verdict"] for each in json.loads(done.stdout)["summaries"])
    assert one == other
    table = CliRunner().invoke(app, ["log", "compare", log, log]).stdout
    words = " ".join(table.split())
    assert f"verdict {one['sentence']} {one['sentence']}" in words
    assert f"exit code {one['exit_code']} {one['exit_code']} cause {one['cause']}" in words
