"""Runs side by side: only what differs is said to differ, and curves are what the log holds."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from snakewalk.controller.cli.command_line import app
from snakewalk.controller.console import options
from snakewalk.controller.runlog.record import RunRecord
from snakewalk.controller.studies.run_comparison import (
    compared_run,
    differing,
    flat,
    log_names,
)

pytestmark = pytest.mark.usefixtures("legible_figures")

Make = Callable[..., Path]


def test_logs_are_named_by_what_tells_them_apart() -> None:
    logs = [Path("a/log.mcap"), Path("b/log.mcap"), Path("old.mcap")]
    assert log_names(logs) == ["a", "b", "old"]
    assert log_names([Path("x/a/log.mcap"), Path("y/a/log.mcap")]) == [
        "x/a/log.mcap",
        "y/a/log.mcap",
    ]


def test_what_differs_is_told_by_its_key(record: RunRecord) -> None:
    header = record.header
    slower = header.run.model_copy(
        update={"behaviour": header.run.behaviour.model_copy(update={"pulse_body_lengths_s": 0.1})}
    )
    other = replace(record, header=replace(header, run=slower))
    runs = [compared_run(record, "a"), compared_run(other, "b"), compared_run(record, "c")]
    assert differing(runs) == {"run.behaviour.pulse_body_lengths_s": [0.25, 0.1, 0.25]}
    assert differing(runs[::2]) == {}


def test_values_of_joints_and_tables_have_keys_of_their_own() -> None:
    values = {"servo": {"gain": 800}, "joints": [{"id": 3, "zero": [0, 1]}], "axes": ["y"]}
    assert flat(values, "robot") == {
        "robot.servo.gain": 800,
        "robot.joints.0.id": 3,
        "robot.joints.0.zero": [0, 1],
        "robot.axes": ["y"],
    }


def test_the_curves_are_the_logs(record: RunRecord) -> None:
    run, cycle = compared_run(record, "a"), record.cycle
    row = int(np.flatnonzero(cycle.valid.all(axis=1))[50])
    off = cycle.measured_rad[row] - cycle.sent_rad[row]
    assert run.tracking_rms_rad[row] == pytest.approx(np.sqrt((off**2).mean()))
    assert run.current_a[row] == np.abs(cycle.current_a[row]).max()
    assert np.nanmean(run.path_error_m) == pytest.approx(run.summary.path_error_mean_m, abs=1e-5)


@pytest.mark.slow
def test_the_command_compares_and_draws(make: Make, tmp_path: Path) -> None:
    logs = [
        str(make(tmp_path / name, seconds=seconds, seed=seed))
        for name, seconds, seed in (("one.mcap", 8.0, 0), ("two.mcap", 12.0, 3))
    ]
    picture = tmp_path / "both.png"
    done = CliRunner().invoke(app, ["log", "compare", *logs, "--picture", str(picture), "--json"])
    assert done.exit_code == 0, done.output
    told = json.loads(done.stdout)
    assert told["differing"] == {"run.seed": [0, 3]}
    assert [s["duration_s"] > 10.0 for s in told["summaries"]] == [False, True]
    assert picture.read_bytes().startswith(b"\x89PNG")
    table = CliRunner().invoke(app, ["log", "compare", *logs]).stdout
    assert "{" not in table
    assert "run.seed" in table
    assert "path error mean " in table
    assert "friction law" not in table, "a number that is the same"
    assert "verdict.evidence" not in table, "the same"
    assert table.rstrip().endswith("--json prints all. Pose: simulated.")
    assert " m " in table.partition("path error mean ")[2].partition("\n")[0]


def test_long_names_are_told_apart_at_80_columns(
    make: Make, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    logs = []
    for seed in range(3):
        folder = tmp_path / f"jacksboro-traverse-serpenoid-seed{seed}"
        folder.mkdir()
        logs.append(str(make(folder / "log.mcap", seconds=4.0, seed=seed)))
    monkeypatch.setattr(options.console, "_width", 80)
    table = CliRunner().invoke(app, ["log", "compare", *logs]).stdout
    assert all(table.count(f"seed{seed}") == 2 for seed in range(3))
    assert "\N{HORIZONTAL ELLIPSIS}" not in table


def test_the_largest_current_is_that_of_any_joint_and_unknown_without_a_reading(
    record: RunRecord,
) -> None:
    current_a = np.full_like(record.cycle.current_a, np.nan)
    current_a[1, 2], current_a[1, 3], current_a[2, 0] = 0.3, -0.7, 0.0
    run = compared_run(replace(record, cycle=replace(record.cycle, current_a=current_a)), "a")
    assert run.current_a[:3] == pytest.approx([np.nan, 0.7, 0.0], nan_ok=True)
    assert np.isnan(run.current_a[3:]).all()
