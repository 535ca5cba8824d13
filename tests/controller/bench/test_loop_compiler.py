"""All loops are found and compiled in advance; a command that compiles reports it."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from snakewalk.controller.bench.loop_compiler import ALL, compile_loops, loop_modules
from snakewalk.controller.cli.main import CompilationNotice, is_run
from snakewalk.controller.console.child_process import start_module
from snakewalk.drivers.compilation import observe_compilation, report_compiled

ROOT = Path(__file__).resolve().parents[3]
PROGRAM = """
from snakewalk.drivers.compilation import observe_compilation
observe_compilation(print)
from snakewalk.drivers.compiling import compiled

@compiled("float64(float64)", makes_arrays=True)
def doubled(value):
    return 2.0 * value
"""


def test_every_module_with_a_loop_is_found() -> None:
    written = {
        "snakewalk." + ".".join(file.relative_to(ROOT).with_suffix("").parts)
        for top in ("drivers", "sim", "controller")
        for file in (ROOT / top).rglob("*.py")
        if any(
            line.startswith("from snakewalk.drivers.compiling import")
            for line in file.read_text(encoding="utf-8").splitlines()
        )
    }
    found = [
        name
        for top in ("drivers", "sim", "controller")
        for name in loop_modules(f"snakewalk.{top}")
    ]
    assert len(found) > 40
    assert sorted(found) == sorted(written)


def test_a_failed_child_is_reported_and_a_note_of_both_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Both children printed that the folder is not writable."""
    child = tmp_path / "child"
    child.write_text("#!/bin/sh\necho note loops are stored elsewhere\nexit 1\n")
    child.chmod(0o700)
    monkeypatch.setattr(sys, "executable", str(child))
    with pytest.raises(RuntimeError, match="not compiled"):
        compile_loops(lambda done, total, name: None, ALL)
    assert caplog.messages == ["loops are stored elsewhere"]


def test_a_terminal_s_interrupt_is_left_to_the_parent() -> None:
    """Ctrl-C in the first run printed a traceback of each compiling child."""
    code = "import signal; print(signal.pthread_sigmask(signal.SIG_BLOCK, []))"
    with start_module("timeit", "-n", "1", "-r", "1", code) as child:
        assert "SIGINT" in (child.stdout.read() if child.stdout else "")


@pytest.mark.slow
@pytest.mark.parametrize("runs", [2])
def test_only_a_loop_that_is_not_cached_is_reported(tmp_path: Path, runs: int) -> None:
    """The first process compiles; the second one uses the cache and reports nothing."""
    file = tmp_path / "loop.py"
    file.write_text(PROGRAM)
    environ = dict(os.environ, NUMBA_CACHE_DIR=str(tmp_path / "cache"), PYTHONPATH=str(tmp_path))
    outputs = [
        subprocess.run(
            [sys.executable, "-c", "import loop"],
            env=environ, check=True, capture_output=True, text=True,
        ).stdout.split()
        for _ in range(runs)
    ]  # fmt: skip
    assert "loop.doubled" in outputs[0]
    assert outputs[1] == []


def test_the_notice_is_one_line_and_then_progress(monkeypatch: pytest.MonkeyPatch) -> None:
    lines: list[str] = []
    notice = CompilationNotice(lines.append)
    times = iter([0.0, 1.0, 4.0, 4.5, 9.0])
    monkeypatch.setattr(notice._clock, "now_s", lambda: next(times))
    remove = observe_compilation(notice)
    for name in "abcde":
        report_compiled(name)
    remove()
    report_compiled("f")
    assert "snakewalk tools compile" in lines[0]
    assert lines[1:] == ["compiled 3 loops", "compiled 5 loops"]


def test_the_second_loop_of_a_run_has_the_others_compiled_in_children() -> None:
    """A failed child leaves the loops to this process."""
    calls: list[str] = []

    def fail() -> None:
        calls.append("children")
        raise RuntimeError

    notice = CompilationNotice(calls.append, fail)
    for name in "abc":
        notice(name)
    assert calls[1:] == ["children"]


@pytest.mark.parametrize(
    ("words", "compiles"),
    [
        ("run", True),
        ("run flat-slalom", True),
        ("gait run rolling", True),
        ("trials run", True),
        ("gait list", False),
        ("doctor --port /dev/ttyUSB0", False),
        ("", False),
    ],
)
def test_only_commands_that_run_compile_in_children(words: str, compiles: bool) -> None:
    assert is_run(words.split()) is compiles
