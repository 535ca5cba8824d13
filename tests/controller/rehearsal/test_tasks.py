"""Tasks that compare controllers: conditions, score, and controllers that do not fit."""

import json
import re
import sys
import textwrap
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from snakewalk.config.errors import InputError
from snakewalk.controller.cli.command_line import app
from snakewalk.controller.console import plugins
from snakewalk.controller.rehearsal import tasks
from snakewalk.controller.rehearsal.commands.tasks import cell, condition
from snakewalk.controller.rehearsal.tasks import TASKS, TaskResult, TaskRun, run_task
from tests.helpers.in_process import work_in_this_process


def test_twelve_tasks_state_friction_servo_and_noise() -> None:
    rows = [condition(task) for task in TASKS]
    assert len({row["task"] for row in rows}) == 12
    for row in rows:
        assert row["servo"] == "XM430-W350"
        assert 0.0 < float(str(row["along"])) <= float(str(row["across"]))
    assert "0.01 m, 3 deg, 0.1 s late" in str(rows[-1]["noise"])


def test_a_short_swim_and_a_walk_without_waypoints(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The score is a share of the distance that the body moved; the command resumes."""
    work_in_this_process(monkeypatch)
    short = tuple(
        replace(task, seconds=4.0, distance_m=2.0) for task in TASKS if task.name == "swimming"
    )
    monkeypatch.setattr(tasks, "TASKS", short)
    out = tmp_path / "tasks.jsonl"
    words = [
        "trials",
        "tasks",
        "swimming",
        "--controller",
        "gait",
        "--controller",
        "walk",
        "-o",
        str(out),
    ]
    found = json.loads(CliRunner().invoke(app, [*words, "--json"], catch_exceptions=False).stdout)
    swum, walked = found["tasks"]
    assert 0.1 < swum["share"] < 1.0
    assert swum["verdict"].startswith("moved ")
    assert not swum["is_tripped"]
    assert walked["share"] is None
    assert walked["verdict"].startswith("not applicable: walk goes to waypoints")

    def twice(item: TaskRun) -> TaskResult:
        raise AssertionError(f"{item} ran twice")

    monkeypatch.setattr("snakewalk.controller.rehearsal.commands.tasks.run_task", twice)
    shown = CliRunner().invoke(app, words, catch_exceptions=False).stdout
    assert f"{swum['share']:.2f}" in shown
    out.write_text("{}\n")
    broken = CliRunner().invoke(app, words)
    assert "line 1 is not a result of a task" in str(broken.exception)


def blocks_of_the_page(language: str) -> list[str]:
    """Code of the page that explains how to add a controller."""
    page = (Path(__file__).parents[3] / "docs" / "tasks.md").read_text()
    found = re.findall(rf"   ```{language}\n(.*?)   ```", page, re.DOTALL)
    return [textwrap.dedent(each) for each in found]


def test_a_controller_of_another_package_enters_as_on_the_page(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package, info = tmp_path / "my_snake", tmp_path / "my_snake-1.0.dist-info"
    package.mkdir()
    info.mkdir()
    (package / "__init__.py").write_text("")
    code, manifest = blocks_of_the_page("python")
    (package / "controllers.py").write_text(code)
    (package / "manifest.py").write_text(manifest)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: my-snake\nVersion: 1.0\n")
    (entry,) = tomllib.loads(blocks_of_the_page("toml")[0])["project"]["entry-points"].items()
    rows = "\n".join(f"{name} = {module}" for name, module in entry[1].items())
    (info / "entry_points.txt").write_text(f"[{entry[0]}]\n{rows}\n")
    monkeypatch.syspath_prepend(tmp_path)
    short = [replace(t, seconds=4.0, distance_m=2.0) for t in TASKS if t.name == "swimming"]
    monkeypatch.setattr(tasks, "TASKS", (*short, TASKS[0]))
    plugins.foreign_plugins.cache_clear()
    try:
        own = run_task(TaskRun("swimming", "slow-wave", 0))
        unknown = run_task(TaskRun("swimming", "slow-wav", 0))
    finally:
        plugins.foreign_plugins.cache_clear()
        for name in [name for name in sys.modules if name.startswith("my_snake")]:
            del sys.modules[name]  # another page installs a package of this name
    assert own.verdict.startswith("moved ")
    assert own.share is not None
    assert 0.0 < own.share < 1.0
    assert unknown.verdict.startswith("not applicable: ")


def test_the_score_is_the_way_of_the_body_between_the_ends() -> None:
    time_s = np.linspace(0.0, 10.0, 101)
    centre_m = np.stack([0.3 * time_s, 0.0 * time_s, 0.1 * time_s], axis=1)
    pose = type("Pose", (), {"time_s": time_s, "centre_m": centre_m})
    record = type("Record", (), {"pose": pose})
    assert tasks._moved_distance_m(record, "x") == pytest.approx(0.3 * 9.5)  # type: ignore[arg-type]
    assert tasks._moved_distance_m(record, "z") == pytest.approx(0.1 * 9.5)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("task", "controller", "why"),
    [
        ("rehearsal", "cpg", "does not use a pose"),
        ("slalom", "nosuch", "unknown"),
        ("pole", "serpenoid", "goes to waypoints"),
    ],
)
def test_a_controller_that_does_not_fit_is_a_result(task: str, controller: str, why: str) -> None:
    result = run_task(TaskRun(task, controller, 0))
    assert result.share is None
    assert result.verdict.startswith("not applicable: ")
    assert why in result.verdict


def test_an_unknown_task_is_named() -> None:
    with pytest.raises(InputError, match="no such task; use one of slalom"):
        run_task(TaskRun("volcano", "walk", 0))


def test_cells_are_means_over_the_seeds() -> None:
    rows = [
        TaskResult("slalom", "walk", k, share=s, duration_s=10.0, is_tripped=e)
        for k, (s, e) in enumerate([(1.0, False), (0.5, True)])
    ]
    assert cell(rows) == "0.75 10 s, 1 tripped"
    assert cell([TaskResult("slalom", "walk", 0, verdict="not applicable: x")]) == "-"
