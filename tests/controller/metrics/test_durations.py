"""Terminal, summary and report state the same duration and the same waypoint times."""

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

from snakewalk.controller.metrics.summary import summary
from snakewalk.controller.run.factory import prepare_job
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.runlog.record import RunRecord
from snakewalk.controller.runtime.drive import Progress
from tests.helpers.short_run import SHORT_RUN


def later(record: RunRecord, by_s: float) -> RunRecord:
    """Return a record whose connection was opened ``by_s`` earlier."""
    start = dataclasses.replace(record.events[0], kind="start", time_s=-by_s)
    moved = dataclasses.replace(record, events=(start, *record.events)).from_torque_on()
    return dataclasses.replace(
        moved, events=(dataclasses.replace(start, time_s=by_s), *moved.events[1:])
    )


def test_terminal_summary_and_report_agree(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    pytest.importorskip("matplotlib")
    from snakewalk.controller.report.artifacts import make_artifacts

    file = tmp_path / "short.toml"
    file.write_text(SHORT_RUN, encoding="utf-8")
    shown: list[Progress] = []
    finished = run_robot(
        RunRequest(prepare_job(str(file)), tmp_path / "out", on_progress=shown.append)
    )
    record, numbers = finished.record, finished.summary
    assert record.torque_on_s > 0.05  # connecting takes a while, so the two zeros differ
    assert numbers.duration_s == pytest.approx(finished.outcome.duration_s, abs=1e-4)
    assert 0.0 < numbers.duration_s - shown[-1].time_s < record.period_s
    (reached_s,) = numbers.waypoint_times_s or ()
    first = next(progress.time_s for progress in shown if progress.reached == 1)
    assert reached_s == pytest.approx(first, abs=1e-4)
    event = next(e for e in record.from_torque_on().events if e.kind == "waypoint")
    assert 0.0 <= event.time_s - reached_s < record.period_s
    made = make_artifacts(record, tmp_path / "out", numbers, film=None)
    assert made.report is not None
    page = made.report.read_text(encoding="utf-8")
    assert f"in {numbers.duration_s:.1f} s" in page
    assert f"{event.time_s:.2f}" in page
    written = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    assert written["duration_s"] == numbers.duration_s


def test_a_slow_connection_changes_no_number(record: RunRecord) -> None:
    slow = later(record, 3.0)
    assert slow.pose.time_s[0] == pytest.approx(record.pose.time_s[0] + 3.0)
    assert slow.cycle.deadline_s[-1] == pytest.approx(record.cycle.deadline_s[-1] + 3.0)
    ours, theirs = summary(slow).to_dict(), summary(record).to_dict()
    assert theirs["duration_s"] == 30.0
    for key, value in theirs.items():
        is_number = isinstance(value, int | float | tuple)
        assert ours[key] == (pytest.approx(value, rel=1e-4) if is_number else value), key


def test_a_log_that_breaks_off_lasts_to_its_last_row(record: RunRecord) -> None:
    torn = dataclasses.replace(later(record, 3.0), complete=False)
    cut = dataclasses.replace(torn, events=tuple(e for e in torn.events if e.kind != "stop"))
    assert cut.duration_s == pytest.approx(cut.end_s - 3.0)
    assert np.isfinite(cut.duration_s)
