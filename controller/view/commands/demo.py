"""``snakewalk demo``: a recorded run in the browser at once, then the same run live."""

import os
import select
import signal
import sys
from pathlib import Path

from snakewalk.config.extras import require_extra
from snakewalk.controller.bench.loop_compiler import compile_with_progress
from snakewalk.controller.console.child_process import run_command, start
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import VIEW_AT, ViewAt
from snakewalk.controller.runlog.reader import read_log
from snakewalk.controller.view.live_view import host_and_port
from snakewalk.controller.view.log_page import LogPage, play
from snakewalk.drivers.clock import WallClock

RECORDED = Path(__file__).resolve().parents[1] / "demonstration.mcap"
"""Log of ``snakewalk run`` on its defaults; it is part of the program."""
_LIVE_COMMAND = "snakewalk run --view"
_NICE = 3
"""Loops are compiled behind the page (ours)."""


@command("demo", examples=("demo", "demo --view-at 0.0.0.0:8080"))
def demo(view_at: ViewAt = VIEW_AT) -> None:
    """Show a recorded run in the browser at once; offer the same run live.

    The loops are compiled while it plays. Needs no servo. ^C ends it.
    """
    require_extra("the page needs", "viser")
    record = read_log(RECORDED).from_torque_on()
    page = LogPage({"walk": record}, *host_and_port(view_at), repeats=True)
    page.toggle()
    print(f"{page.url}  (a recorded run; ^C ends)", flush=True)
    compiler = start(_compile_behind, daemon=True)
    clock = WallClock()
    play(page, clock, lambda: not compiler.is_alive())
    print(f"{_LIVE_COMMAND}  runs the same live; Enter starts it now", flush=True)
    play(page, clock, _is_enter_pressed)
    page.server.stop()
    raise SystemExit(run_command([*_LIVE_COMMAND.split()[1:], "--view-at", view_at]))


def _is_enter_pressed() -> bool:
    return sys.stdin.isatty() and bool(select.select([sys.stdin], [], [], 0.0)[0])


def _compile_behind() -> None:
    """In a child: compile the loops of runs at a low priority."""
    signal.signal(signal.SIGTERM, lambda number, frame: sys.exit())  # this ends its children
    os.nice(_NICE)
    compile_with_progress(runs=True)
