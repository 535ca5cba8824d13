"""``python -m benchmarks.watched_cycles``: how late cycles begin that somebody looks on at.

A gait runs at 50 Hz on a pseudo-terminal, whose servos another process simulates, without a page
and with one: nobody has it open; a browser reads what it is sent; one has stopped reading; one is
killed in the middle of the run; the page's own process is stopped, or killed. A browser is stood in
for by a program that opens the page's socket as one does. Conditions take turns, round by round.
"""

import argparse
import math
import multiprocessing
import os
import re
import signal
import subprocess
import sys
import threading
from collections import defaultdict
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from urllib.parse import urlsplit

import numpy as np
import viser
from rich.console import Console
from rich.table import Table
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
from websockets.typing import Origin, Subprotocol

from snakewalk.config.arrays import Floats
from snakewalk.controller.run.kinds.gait_factory import prepare_gait
from snakewalk.controller.run.observers import Observers
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.view.live_view import LiveView

CONDITIONS = (
    "no page",
    "a page, no browser",
    "a browser that reads",
    "a browser that does not read",
    "a browser that is killed",
    "a page that is stopped",
    "a page that is killed",
)
PATIENT = {
    "run.safety.stale_limit_s": 5.0,
    "run.safety.slow_stale_limit_s": 20.0,
    "run.safety.watchdog_s": 2.5,
    "run.safety.following_time_s": 20.0,
}
"""On a busy machine the simulated servos answer late; the run goes on."""
_SERVE = (
    "from snakewalk.controller.cli.main import main; "
    "import sys; sys.argv[1:] = ['bus', 'serve', '--servos', '1-16']; main()"
)


def browse(url: str, reads: bool) -> None:
    """Open the page's socket as a browser does, and read what comes, or nothing."""
    protocol = Subprotocol(f"viser-v{viser.__version__}")
    place = urlsplit(url)
    cookie = f"snakewalk-{place.port}={place.query.removeprefix('token=')}"
    with connect(
        f"ws://{place.netloc}/",
        origin=Origin(f"http://{place.netloc}"),
        additional_headers={"Cookie": cookie},
        subprotocols=[protocol],
        max_size=None,
    ) as line:
        if not reads:
            signal.pause()
        with suppress(ConnectionClosed):
            for _ in line:
                pass


@contextmanager
def served() -> Iterator[str]:
    """Serve sixteen simulated servos by another process; yields their port."""
    with subprocess.Popen([sys.executable, "-c", _SERVE], stdout=subprocess.PIPE, text=True) as bus:
        assert bus.stdout is not None
        yield next(found[1] for line in bus.stdout if (found := re.match(r"port (\S+)", line)))
        bus.kill()


def lateness_s(condition: str, seconds: float) -> tuple[Floats, int]:
    """Run once: (T,) how late each cycle began, and how many were skipped."""
    spawn = multiprocessing.get_context("spawn")
    with ExitStack() as stack:
        folder = Path(stack.enter_context(TemporaryDirectory()))
        port = stack.enter_context(served())
        page = None if condition == "no page" else stack.enter_context(LiveView("127.0.0.1:0"))
        browser = None
        if page is not None and "browser " in condition:
            reads = "does not" not in condition
            browser = spawn.Process(target=browse, args=(page.url, reads), daemon=True)
            browser.start()
            stack.callback(browser.kill)
        ill = None
        if "is killed" in condition or "is stopped" in condition:
            victim = browser if browser is not None else page and page._process
            assert victim
            what = signal.SIGSTOP if "stopped" in condition else signal.SIGKILL
            ill = threading.Timer(0.4 * seconds, lambda: os.kill(victim.pid or 0, what))
            ill.start()
        finished = run_robot(
            RunRequest(
                prepare_gait(
                    "lateral-undulation",
                    seconds=seconds,
                    keys=PATIENT | {"run.safety.lost_observer": "warn"},
                ),
                folder / "run",
                port,
                observers=None if page is None else Observers(page),
            )
        )
        if ill is not None:
            ill.join()
    cycle = finished.record.cycle
    periods = round(
        (cycle.deadline_s[-1] - cycle.deadline_s[0]) * finished.record.header.run.cycle_hz
    )
    return cycle.lateness_s, periods + 1 - len(cycle.time_s)


def main() -> None:
    """Measure and show."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.watched_cycles", description=__doc__
    )
    parser.add_argument("--seconds", type=float, default=15.0, help="of each run")
    parser.add_argument("--rounds", type=int, default=3)
    given = parser.parse_args()
    late: dict[str, list[Floats]] = defaultdict(list)
    skipped: dict[str, int] = defaultdict(int)
    loads, errors = [], Console(stderr=True)
    for number in range(given.rounds):
        for condition in CONDITIONS:
            errors.print(f"round {number + 1}: {condition}")
            found_s, skips = lateness_s(condition, given.seconds)
            late[condition].append(found_s)
            skipped[condition] += skips
            loads.append(os.getloadavg()[0])
    heads = ("cycles", "median, ms", "99 %, ms", "longest, ms", "skipped")
    table = Table("", *heads, box=None, width=100)
    for condition, parts in late.items():
        all_ms = 1e3 * np.concatenate(parts)
        values = (np.median(all_ms), np.quantile(all_ms, 0.99), all_ms.max())
        numbers = (f"{value:.2f}" for value in values)
        table.add_row(condition, str(len(all_ms)), *numbers, str(skipped[condition]))
    Console().print(table)
    cores = os.cpu_count() or math.nan
    print(f"load {min(loads):.1f} to {max(loads):.1f} on {cores} cores")


if __name__ == "__main__":
    main()
