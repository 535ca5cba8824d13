"""Ctrl-C and signals: every command ends at once with exit code 130, and says what became of it."""

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path

import pytest
from pytest_mock import MockerFixture

from snakewalk.controller.cli.main import main
from snakewalk.controller.metrics.summary import summary
from snakewalk.controller.run.kinds.gait_factory import prepare_gait
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.runlog.reader import read_log
from snakewalk.controller.runtime.drive import Progress
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.errors import BusError, DriverError, PortError


def after(cycles: int, stop: Callable[[], None]) -> Callable[[Progress], None]:
    left = iter(range(cycles))

    def on_progress(progress: Progress) -> None:
        if next(left, None) is None:
            stop()

    return on_progress


def run(out: Path, stop: Callable[[], None]) -> None:
    job = prepare_gait("lateral-undulation", seconds=2.0)
    run_robot(RunRequest(job, out, on_progress=after(20, stop)))


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_run_says_what_became_of_torque_and_log(
    number: signal.Signals, tmp_path: Path
) -> None:
    pytest.importorskip("mujoco")
    with pytest.raises((KeyboardInterrupt, SystemExit)) as stop:
        run(tmp_path, lambda: signal.raise_signal(number))
    log = tmp_path / "log.mcap"
    assert stop.value.__notes__ == [
        "torque is off",
        f"log: {log}; its page: snakewalk log report {log}",
    ]
    assert [path.name for path in tmp_path.iterdir()] == ["log.mcap"]
    record = read_log(log)
    assert record.complete
    assert record.events[-1].text == "torque is off"
    assert summary(record).outcome == "interrupted"


@pytest.mark.parametrize("kind", [BusError, PortError])
def test_a_torque_off_that_is_not_confirmed_says_what_tripped_and_where_the_log_is(
    kind: type[DriverError],
    tmp_path: Path,
    mocker: MockerFixture,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """It said neither; and 2, of a port that is gone, means that nothing has moved."""
    pytest.importorskip("mujoco")
    job, reasons = prepare_gait("lateral-undulation", seconds=2.0), [None] * 50
    mocker.patch.object(ServoChain, "disable", side_effect=kind("joint 3 is not confirmed"))

    def run_into_a_trip() -> None:
        run_robot(
            RunRequest(job, tmp_path, stop_requested=lambda: reasons.pop() if reasons else "a hand")
        )

    mocker.patch(
        "snakewalk.controller.cli.main._check_words",
        side_effect=lambda words: run_into_a_trip(),
    )
    monkeypatch.setattr("sys.argv", ["snakewalk", "list"])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 1
    log = tmp_path / "log.mcap"
    lines = capsys.readouterr().err.splitlines()
    told = "; ".join(line.removeprefix("snakewalk: ") for line in lines)
    assert told.endswith(
        f"joint 3 is not confirmed; tripped by: a hand; log: {log}; its page: "
        f"snakewalk log report {log}"
    )
    assert read_log(log).events[-1].text == "joint 3 is not confirmed"


def test_a_run_that_is_over_is_whole_when_its_summary_is_interrupted(
    tmp_path: Path, mocker: MockerFixture
) -> None:
    pytest.importorskip("mujoco")
    mocker.patch("snakewalk.controller.run.run_robot.summary", side_effect=KeyboardInterrupt)
    with pytest.raises(KeyboardInterrupt) as stop:
        run_robot(RunRequest(prepare_gait("lateral-undulation", seconds=0.2), tmp_path))
    log = tmp_path / "log.mcap"
    assert stop.value.__notes__ == [
        "torque is off",
        f"the run is complete: {log}; its page: snakewalk log report {log}",
    ]
    assert read_log(log).complete


def test_the_command_line_prints_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("mujoco")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(
        "snakewalk.controller.console.progress.TimeBar.on_progress",
        lambda bar, progress: signal.raise_signal(signal.SIGINT),
    )
    monkeypatch.setattr("sys.argv", ["snakewalk", "gait", "run", "lateral-undulation"])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 130
    log = Path("runs") / "gait-lateral-undulation-yaw16" / "log.mcap"
    assert capsys.readouterr().err.splitlines()[-1] == (
        f"snakewalk: interrupted; torque is off; log: {log}; its page: snakewalk log report {log}"
    )


NOT_ON, OFF = "torque was not switched on", "torque is off"
PHASES = {
    "plan": ("snakewalk.controller.run.kinds.gait_run.GaitRun.check_plan", NOT_ON, None),
    "port": ("snakewalk.controller.run.run_robot._backend", NOT_ON, None),
    "log": ("snakewalk.controller.runlog.writer.Writer.start", NOT_ON, None),
    "header": ("snakewalk.controller.runlog.writer.RunLog.config", NOT_ON, None),
    "shadow is made": ("snakewalk.controller.run.run_robot._shadow", NOT_ON, "log"),
    "cycle": ("snakewalk.controller.console.progress.TimeBar.on_progress", OFF, "log"),
    "after the last cycle": (
        "snakewalk.drivers.safety.stop_button.StopButton.report_end",
        OFF,
        "the run is complete",
    ),
    "result of the shadow": (
        "snakewalk.controller.studies.shadow.run_shadow.RunShadow.end",
        OFF,
        "the run is complete",
    ),
    "bar and observers close": (
        "snakewalk.controller.console.progress.TimeBar.__exit__",
        OFF,
        "the run is complete",
    ),
    "log is read": ("snakewalk.controller.run.run_robot.read_log", OFF, "the run is complete"),
    "report": ("snakewalk.controller.report.artifacts._draw", OFF, "the run is complete"),
    "film": ("snakewalk.controller.report.artifacts._film", OFF, "the run is complete"),
    "result": ("snakewalk.controller.run.results.show", OFF, "the run is complete"),
}
"""What a signal interrupts: the function called then, the state of torque, the name of the log."""


@pytest.mark.slow_cases(8, "23 cases of 0.6 s of CPU")
@pytest.mark.fast_cases(9)
@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
@pytest.mark.parametrize("phase", PHASES)
def test_each_signal_in_each_phase_says_what_became_of_torque_and_log(
    phase: str,
    name: str,
    tmp_path: Path,
    mocker: MockerFixture,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    pytest.importorskip("mujoco")
    number = signal.Signals[name]
    place, torque, what = PHASES[phase]
    for slow in ("_draw", "_write_page", "_film"):
        mocker.patch(f"snakewalk.controller.report.artifacts.{slow}")
    mocker.patch(place, side_effect=lambda *_, **__: signal.raise_signal(number))
    out = tmp_path / "out"
    words = ["gait", "run", "lateral-undulation", "--seconds", "0.2", "--shadow", "--out"]
    monkeypatch.setattr("sys.argv", ["snakewalk", *words, str(out)])
    before = signal.signal(number, signal.SIG_DFL if name != "SIGINT" else signal.SIG_IGN)
    try:
        with pytest.raises(SystemExit) as end:
            main()
    finally:
        signal.signal(number, before)
    assert end.value.code == 128 + number
    log = out / "log.mcap"
    told = [torque]
    if what is not None:
        told.append(f"{what}: {log}; its page: snakewalk log report {log}")
    how = "interrupted" if name == "SIGINT" else f"ended by {name}"
    assert capsys.readouterr().err.splitlines()[-1] == f"snakewalk: {'; '.join([how, *told])}"
    if what is None:
        assert not out.exists()
    else:
        record = read_log(log)
        assert record.complete
        assert (summary(record).outcome == "interrupted") == (what == "log")


def test_a_second_interrupt_while_the_log_is_closed_takes_nothing_away(
    tmp_path: Path, mocker: MockerFixture
) -> None:
    """The second exception has none of the notes of the first."""
    pytest.importorskip("mujoco")
    mocker.patch(
        "snakewalk.controller.runlog.writer.RunLog._restore",
        side_effect=lambda: signal.raise_signal(signal.SIGINT),
    )
    with pytest.raises(KeyboardInterrupt) as stop:
        run(tmp_path, lambda: signal.raise_signal(signal.SIGINT))
    part = tmp_path / "log.mcap.part"
    assert stop.value.__notes__ == [OFF, f"log: {part}; its page: snakewalk log report {part}"]


def test_an_interrupt_before_the_first_line_of_a_command_is_one_line(
    mocker: MockerFixture, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    mocker.patch("snakewalk.controller.cli.main._check_words", side_effect=KeyboardInterrupt)
    monkeypatch.setattr("sys.argv", ["snakewalk", "list"])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 130
    assert capsys.readouterr().err == "snakewalk: interrupted\n"


@pytest.mark.parametrize("name", ["SIGTERM", "SIGHUP", "SIGQUIT"])
def test_a_signal_before_anything_moves_is_one_line_too(
    name: str,
    mocker: MockerFixture,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """The system ended the program without a word, and without the ends of its contexts."""
    number = signal.Signals[name]
    mocker.patch(
        "snakewalk.controller.cli.main._check_words",
        side_effect=lambda words: signal.raise_signal(number),
    )
    monkeypatch.setattr("sys.argv", ["snakewalk", "list"])
    before = signal.signal(number, signal.SIG_DFL)
    try:
        with pytest.raises(SystemExit) as end:
            main()
    finally:
        signal.signal(number, before)
    assert end.value.code == 128 + number
    assert capsys.readouterr().err == f"snakewalk: ended by {name}\n"


@pytest.mark.parametrize(("name", "code"), [("SIGINT", 130), ("SIGQUIT", 131), ("SIGHUP", 0)])
def test_what_a_script_starts_beside_itself_stops(name: str, code: int) -> None:
    """A shell has it ignore ^C and SIGQUIT; nohup's SIGHUP stays ignored."""
    number = int(signal.Signals[name])
    program = (
        f"import signal, sys; signal.signal({number}, signal.SIG_IGN)\n"
        "from snakewalk.controller.cli import main\n"
        f"main._check_words = lambda words: signal.raise_signal({number})\n"
        'sys.argv = ["snakewalk", "--version"]; main.main()'
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=False
    )
    assert done.returncode == code, done.stderr
    assert done.stdout.startswith("snakewalk 0") == (code == 0)


def test_what_is_imported_before_an_interrupt_is_caught_is_little() -> None:
    code = "import sys, snakewalk.controller.cli.main; print(*sys.modules)"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = {name.partition(".")[0] for name in found.stdout.split()}
    assert not loaded & {"typer", "rich", "pydantic", "numpy", "numba", "scipy", "mujoco"}


@pytest.mark.parametrize(
    "words", [("log", "report", "{pipe}"), ("bus", "serve", "--faults", "{pipe}")]
)
def test_a_named_pipe_that_is_waited_for_is_told(
    words: tuple[str, ...],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """A program without a word waited for a writer until ^C."""
    pipe = tmp_path / "pipe.toml"
    os.mkfifo(pipe)
    monkeypatch.setattr("sys.argv", ["snakewalk", *(word.format(pipe=pipe) for word in words)])
    writer = threading.Thread(target=pipe.write_text, args=("no = 1",))
    writer.start()
    with pytest.raises(SystemExit) as end:
        main()
    writer.join()
    assert end.value.code == 2
    told = f"snakewalk: {pipe}: a named pipe: waits for a program that writes to it; ^C ends\n"
    assert told in capsys.readouterr().err


@pytest.mark.parametrize(
    "words",
    [
        ("gait", "run", "lateral-undulation", "--robot", "{pipe}"),
        ("plan", "{pipe}"),
        ("gait", "fit", "{pipe}"),
        ("animal", "capture", "{pipe}"),
    ],
)
def test_a_named_pipe_is_not_told_to_be_missing(
    words: tuple[str, ...],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    pipe = tmp_path / "pipe.toml"
    os.mkfifo(pipe)
    monkeypatch.setattr("sys.argv", ["snakewalk", *(word.format(pipe=pipe) for word in words)])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 2
    assert capsys.readouterr().err == (
        f"snakewalk: {pipe}: is a pipe or a device; copy its contents into a file\n"
    )
