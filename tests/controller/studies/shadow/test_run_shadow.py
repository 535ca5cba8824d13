"""A run with a shadow: its rows, its alarm, the cause at its end."""

import json
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_world
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.bench.emergency_stop import StopOutcome, runs_of, stop_runs
from snakewalk.controller.cli.command_line import app
from snakewalk.controller.console.result_files import SUMMARY
from snakewalk.controller.metrics.comparison import compare
from snakewalk.controller.run.deviation import Deviation
from snakewalk.controller.run.external import simulated_backend
from snakewalk.controller.run.kinds.gait_factory import prepare_gait
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.studies.shadow.diagnosis import MOST_S, goals_of
from snakewalk.controller.studies.shadow.run_shadow import ALARM_A, RunShadow


def short_run(seconds: float) -> Any:
    prepared = prepare_gait("lateral-undulation", robot="yaw16", seconds=seconds)
    robot = RobotConfig(name="short", joint_axes="yyy", link_mass_kg=0.5)
    run = prepared.run.model_copy(update={"physics_step_s": 0.005})
    return replace(prepared, robot=robot, run=run)


@pytest.mark.nightly("a long run with its shadow: 5 s of CPU")
def test_a_run_says_what_differs_while_it_lasts_and_why_at_its_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    weak = Deviation(torque=np.array([1.0, 0.4, 1.0]))
    weaker = partial(simulated_backend.simulated, deviation=weak)
    monkeypatch.setattr(simulated_backend, "simulated", weaker)
    told: list[tuple[str, str]] = []
    finished = run_robot(
        RunRequest(
            short_run(4.0),
            tmp_path / "run",
            shadow=True,
            stoppable=False,
            on_event=lambda kind, text: told.append((kind, text)),
        )
    )
    record = finished.record
    np.testing.assert_array_equal(record.shadow.time_s, record.cycle.time_s)
    late = record.cycle.time_s > record.cycle.time_s[0] + 2.0
    apart_a = (record.cycle.current_a - record.shadow.current_a)[late]
    assert np.sqrt((apart_a**2).mean(axis=0)).argmax() == 1
    events = [event.text for event in record.events if event.kind == "shadow"]
    assert "joint yaw_02 (ID 2)" in events[0]
    assert "differs from its shadow" in events[0]
    assert "a weaker servo: joint yaw_02" in events[-1]
    assert [text for kind, text in told if kind == "shadow"] == events
    ended = CliRunner().invoke(
        app, ["log", "shadow", str(finished.log), "--workers", "1", "--json"]
    )
    said = json.loads(ended.stdout)  # the log alone says the same
    assert (ended.exit_code, said["named"], said["at"]) == (1, "weaker servo", 1)
    assert said["text"] == events[-1]


def test_a_stop_during_the_diagnosis_learns_that_the_run_has_ended(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    stopped: list[StopOutcome] = []

    def diagnose(shadow: RunShadow, time_s: float) -> None:
        stopped.extend(stop_runs(runs_of(), "test"))

    monkeypatch.setattr(RunShadow, "end", diagnose)
    run_robot(RunRequest(short_run(0.5), tmp_path / "run", shadow=True))
    ((how, text, safe),) = [(each.how, each.text, each.safe) for each in stopped]
    assert (how, text, safe) == ("latched", "it had come to its end", True)
    assert runs_of() == []


@pytest.mark.slow
def test_a_run_of_half_a_minute_is_judged_by_its_last_seconds(tmp_path: Path) -> None:
    finished = run_robot(
        RunRequest(short_run(30.0), tmp_path / "run", shadow=True, stoppable=False)
    )
    record = finished.record
    assert record.cycle.time_s[-1] - record.cycle.time_s[0] > 30.0
    assert len(record.shadow.time_s) == len(record.cycle.time_s)
    events = [event.text for event in record.events if event.kind == "shadow"]
    assert len(events) == 1
    assert events[0].startswith("nothing differs from the shadow")
    assert (finished.log.parent / SUMMARY).is_file()
    goals, measured = goals_of(record)
    assert measured.shape == (2, *goals.sent_rad.shape)
    np.testing.assert_array_equal(measured[1], record.cycle.measured_rad[-len(measured[1]) :])
    assert goals.since_start_s[-1] == pytest.approx(MOST_S, abs=0.03)


def test_a_robot_as_told_is_its_shadow_and_a_shadow_changes_nothing(tmp_path: Path) -> None:
    runs = [
        run_robot(
            RunRequest(short_run(1.0), tmp_path / name, shadow=shadow, stoppable=False)
        ).record
        for name, shadow in (("with", True), ("without", False))
    ]
    beside = runs[0].shadow
    assert np.abs(beside.current_a - runs[0].cycle.current_a).max() < 0.1 * ALARM_A
    assert np.abs(beside.position_rad - runs[0].cycle.measured_rad).max() < 1e-6
    assert compare(runs[0], runs[1], tolerances={}).is_equal
    assert len(runs[1].shadow.time_s) == 0


def test_ground_on_which_a_shadow_means_nothing_is_refused(tmp_path: Path) -> None:
    prepared = replace(short_run(1.0), world=load_world("ramp-10"))
    with pytest.raises(InputError, match="a shadow needs a level floor without obstacles"):
        run_robot(RunRequest(prepared, tmp_path / "run", shadow=True, stoppable=False))
    assert not (tmp_path / "run").exists()
