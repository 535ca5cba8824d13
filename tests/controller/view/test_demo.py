"""The demonstration: a recorded run that ships with the program, then the same run live."""

import os
import pty
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

pytest.importorskip("viser")

from snakewalk.config.loader import load_robot, load_run, load_world
from snakewalk.controller.console.options import DEFAULT_RUN
from snakewalk.controller.metrics.summary import summary
from snakewalk.controller.metrics.verdict import verdict
from snakewalk.controller.runlog.reader import read_log
from snakewalk.controller.view.commands.demo import RECORDED
from snakewalk.controller.view.log_page import LogPage
from tests.controller.view.test_live_page import COMMAND


def test_the_recorded_run_is_the_one_that_is_offered_live() -> None:
    record = read_log(RECORDED)
    assert not record.note
    run = load_run(DEFAULT_RUN)
    assert record.header.run == run
    assert record.header.robot == load_robot(run.robot)
    assert record.header.world == load_world(run.world)
    assert verdict(record, summary(record)).text.startswith("4 of 4 waypoints")


def test_it_begins_again_at_its_end() -> None:
    page = LogPage({"walk": read_log(RECORDED).from_torque_on()}, "127.0.0.1", 0, repeats=True)
    page.toggle()
    page.time_s = page._end_s - 0.01
    page._slider.value = page.time_s
    page.step(0.05, 1.0)
    assert page.playing
    assert page.time_s == page._begin_s
    page.server.stop()


def lines_of(terminal: int) -> Iterator[str]:
    """What a program prints into a terminal, line by line."""
    text = ""
    while True:
        try:
            text += os.read(terminal, 4096).decode(errors="replace")
        except OSError:  # the program has ended
            return
        *whole, text = re.split(r"[\r\n]+", text)
        yield from whole


@contextmanager
def demo_in_terminal(
    folder: Path, **variables: str
) -> Iterator[tuple[subprocess.Popen[bytes], int, Iterator[str]]]:
    """Run ``demo`` in a terminal: the program, the terminal, and the lines that it prints."""
    ours, theirs = pty.openpty()
    with subprocess.Popen(
        [sys.executable, "-c", COMMAND, "demo", "--view-at", "127.0.0.1:0"],
        cwd=folder,
        stdin=theirs,
        stdout=theirs,
        stderr=theirs,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path), "COLUMNS": "200"} | variables,
    ) as child:
        os.close(theirs)
        try:
            yield child, ours, lines_of(ours)
        finally:
            child.kill()
            os.close(ours)


@pytest.mark.slow
def test_enter_runs_the_same_live(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    with demo_in_terminal(tmp_path) as (_, terminal, lines):
        assert any("a recorded run; ^C ends" in line for line in lines)
        assert any("snakewalk run --view  runs the same live" in line for line in lines)
        os.write(terminal, b"\n")
        assert any("token=" in line for line in lines)


@pytest.mark.slow
def test_an_interrupt_of_it_alone_ends_its_compiling_children(tmp_path: Path) -> None:
    """They went on, and printed a traceback (BrokenPipeError) each. The text ends with them."""
    with demo_in_terminal(tmp_path, NUMBA_CACHE_DIR=str(tmp_path), TERM="xterm") as opened:
        child, _, lines = opened
        assert any(re.search(r"compiling loops .*[1-9]%", line) for line in lines)
        child.send_signal(signal.SIGINT)
        said = "\n".join(lines)
        assert child.wait() == 130
    assert "interrupted" in said
    assert "Traceback" not in said
