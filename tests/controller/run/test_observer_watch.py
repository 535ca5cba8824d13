"""A run reports what is wrong with its observers, and stops when an E-STOP is lost."""

import json
import os
import signal
import socket
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("mujoco")

from snakewalk.controller.run.kinds.gait_factory import prepare_gait
from snakewalk.controller.run.observer_process import ObserverProcess
from snakewalk.controller.run.observers import Observers
from snakewalk.controller.run.request import RunRequest, RunResult
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.runlog.row_line import ObserverEnd
from snakewalk.controller.runtime.drive import Progress
from tests.helpers.tiers import slow_after


class Observer:
    """An observer with an E-STOP, as its test says."""

    def __init__(self) -> None:
        self.reason: str | None = None
        self.faults: list[str] = []

    def lost(self, now_s: float) -> str | None:
        return self.reason

    def rejected(self) -> list[str]:
        faults, self.faults = self.faults, []
        return faults

    def on_row(self, topic: str, row: bytes) -> None: ...
    def on_button(self, path: Path) -> None: ...
    def on_picture(self, image: np.ndarray, time_s: float) -> None: ...


def run(folder: Path, observer: Observer, policy: str, at_cycle: int = 20) -> tuple[RunResult, int]:
    """A second of a gait, in which the observer is lost; returns the cycles that follow, too."""
    cycles = 0

    def on_progress(progress: Progress) -> None:
        nonlocal cycles
        cycles += 1
        if cycles == at_cycle:
            observer.reason = "page: its process has ended"
            observer.faults = ["page: a command of 1.2 MB"] * 3

    finished = run_robot(
        RunRequest(
            prepare_gait("anguilliform", seconds=1.0, keys={"run.safety.lost_observer": policy}),
            folder,
            observers=Observers(observer),
            on_progress=on_progress,
        )
    )
    return finished, cycles - at_cycle


def test_a_lost_e_stop_ends_the_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    finished, after = run(tmp_path / "run", Observer(), "stop")
    assert finished.outcome.tripped == (
        "page: its process has ended; to go on in this case: --set run.safety.lost_observer=warn"
    )
    assert after <= 2


def test_the_run_goes_on_with_a_warning_if_the_user_chose_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    finished, after = run(tmp_path / "run", Observer(), "warn")
    assert finished.outcome.tripped is None
    assert after > 20
    warned = [event.text for event in finished.record.events if event.kind == "observer"]
    assert warned == ["page: its process has ended; the run goes on (safety.lost_observer)"]
    refused = [event.text for event in finished.record.events if event.kind == "refused"]
    assert refused == ["page: a command of 1.2 MB"]


def test_an_observer_without_an_e_stop_is_not_watched() -> None:
    observers = Observers()
    assert observers.stop_requested() is None
    progressed: list[Progress] = []
    assert observers.reporting(progressed.append) == progressed.append


def serve(line: socket.socket) -> None:
    """An observer's process that asks for rows once a cycle and obeys two of them."""
    line.sendall(b'{"process": %d}\n' % os.getpid())
    end = ObserverEnd(line)
    end.ask()
    try:
        while True:
            for topic, row in end.rows(1.0):
                if topic == "/event":
                    os.kill(os.getpid(), signal.Signals[row["signal"]])
                if topic == "/pose":
                    end.ask()
    except EOFError:
        return


@pytest.mark.slow_cases(1, "2 cases of 2.0 s of CPU")
@pytest.mark.slow
@pytest.mark.parametrize("name", slow_after(1, ["SIGKILL", "SIGSTOP"]))
def test_a_process_that_is_killed_or_stopped_is_lost(name: str) -> None:
    now_s = 0.0
    with ObserverProcess(serve, what="page", fault="page") as observer:
        observers = Observers(observer, now_s=lambda: now_s)

        def cycle() -> str | None:
            nonlocal now_s
            now_s += 0.02
            observers.on_row("/cycle", b"{}")
            observers.on_row("/pose", b"{}")
            return observers.lost()

        while observer._end._requests < 5:
            assert cycle() is None
            now_s -= 0.02  # as long as it takes
        observers.on_row("/event", json.dumps({"signal": name}).encode())
        reason, began_s = None, now_s
        while reason is None:
            reason = cycle()
            if name == "SIGKILL":
                now_s -= 0.02
        os.kill(observer.said["process"], signal.SIGKILL)
    if name == "SIGKILL":
        assert reason == "page: its process has ended, and its E-STOP with it"
    else:
        assert reason == "page: it does not respond, so its E-STOP may not work"
        assert now_s - began_s < 4.0
