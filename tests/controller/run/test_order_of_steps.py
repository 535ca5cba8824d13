"""A run checks everything before it opens anything, and switches torque on last."""

import json
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("mujoco")

from snakewalk.config.errors import InputError
from snakewalk.config.pose import TrackerConfig
from snakewalk.controller.console.result_files import RUN_FILES
from snakewalk.controller.rehearsal.rehearsal import SimulatedPort
from snakewalk.controller.run.external.served_robot import ServedRobot, Serving, place_of
from snakewalk.controller.run.factory import prepare_job
from snakewalk.controller.run.kinds.gait_factory import prepare_gait
from snakewalk.controller.run.observers import Observers
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.runtime.drive import Progress
from snakewalk.drivers.safety.stop_button import PressedButton
from tests.helpers.calls import calls_of

ORDER = (
    "refuse_another_run",
    "pose_faults",
    "map_faults",
    "check_compliance",
    "RunShadow.check",
    "WalkRun.check_plan",
    "SimulatedPort.open",
    "Logger.warning",  # the pose is not measured
    "StopButton.__init__",
    "clear_run",
    "RunLog.__init__",
    "Observer.on_button",
    "RunLog.config",
    "pose_provider",
    "map_provider",
    "WalkRun.make_source",
    "second_body",
    "SafeLink.__init__",
    "RunShadow.__init__",
    "SafeLink.enable",
    "RunShadow.begin",
    "SafeLink.write",
    "SafeLink.disable",
    "StopButton.report_end",
    "RunShadow.end",
    "StopButton.end",
    "end map_provider",
    "end pose_provider",
    "RunLog.__exit__",
    "read_log",
    "write_summary",
)


class Observer:
    """An observer whose E-STOP is lost at a time that a test chooses."""

    def __init__(self) -> None:
        self.reason: str | None = None
        self.rows = 0
        self.button: Path | None = None

    def lost(self, now_s: float) -> str | None:
        return self.reason

    def rejected(self) -> list[str]:
        return []

    def on_row(self, topic: str, row: bytes) -> None:
        self.rows += 1

    def on_button(self, path: Path) -> None:
        assert path.exists()
        self.button = path

    def on_picture(self, image: np.ndarray, time_s: float) -> None: ...


@contextmanager
def served(prepared: Any, folder: Path) -> Iterator[SimulatedPort]:
    serving = Serving(TrackerConfig())
    truth = folder / "truth.jsonl"
    with ServedRobot(prepared.robot, prepared.world, place_of(prepared), serving, truth) as robot:
        yield SimulatedPort(robot)


@pytest.mark.slow
def test_a_run_keeps_the_order_of_its_steps(tmp_path: Path) -> None:
    prepared = prepare_job("flat-square", pose="joints", time_limit_s=0.2)
    with served(prepared, tmp_path) as port, calls_of(ORDER) as calls:
        observer = Observer()
        run_robot(
            RunRequest(prepared, tmp_path / "run", port, observers=Observers(observer), shadow=True)
        )
    assert calls == list(ORDER)
    assert observer.rows > 0


@pytest.mark.slow
def test_few_functions_and_files_lead_from_a_command_to_its_loop(tmp_path: Path) -> None:
    file = tmp_path / "rows.json"
    words = [sys.executable, "-m", "benchmarks", "run_path", "--json", str(file)]
    ended = subprocess.run(words, check=False, capture_output=True, text=True)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    rows = json.loads(file.read_text())["rows"]["run_path"]
    judged = {row["what"]: row["met"] for row in rows if row["target"] is not None}
    assert judged == {"functions": True, "files of cli/ console/ run/": True}


def test_a_port_that_fails_leaves_the_files_of_the_folder(tmp_path: Path) -> None:
    for name in RUN_FILES:
        (tmp_path / name).write_text("of an earlier run")
    prepared = prepare_gait("lateral-undulation", seconds=0.2)
    with pytest.raises(InputError, match="/dev/nosuch"):
        run_robot(RunRequest(prepared, tmp_path, "/dev/nosuch", overwrite=True))
    assert all((tmp_path / name).read_text() == "of an earlier run" for name in RUN_FILES)


@pytest.mark.parametrize("source", ["operator", "button", "observer"])
def test_a_stop_is_asked_of_operator_button_and_observers_in_this_order(
    source: str, tmp_path: Path
) -> None:
    """All of them stop from the same cycle on; those before ``source`` do not."""
    order = ("operator", "button", "observer")
    stopping = order[order.index(source) :]
    observer = Observer()
    is_due = False

    def on_progress(progress: Progress) -> None:
        nonlocal is_due
        is_due = True
        if "button" in stopping and observer.button is not None:
            with PressedButton(observer.button) as button:
                button.press("the button")
        observer.reason = "the observer" if "observer" in stopping else None

    def stop_requested() -> str | None:
        return "the operator" if is_due and "operator" in stopping else None

    prepared = prepare_gait("lateral-undulation", seconds=0.2)
    finished = run_robot(
        RunRequest(
            prepared,
            tmp_path / "run",
            observers=Observers(observer),
            stop_requested=stop_requested,
            on_progress=on_progress,
        )
    )
    assert f"the {source}" in (finished.outcome.tripped or "")
