"""The same results from processes and from a cluster; a scheduler that is not there is one line."""

import math
import os
import signal
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from operator import attrgetter
from pathlib import Path
from typing import Any

import pytest

from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot
from snakewalk.controller.console.pool import AHEAD, each, process_pool
from snakewalk.controller.gaits.registry import GAITS
from snakewalk.controller.studies.sweep_points import points_of
from snakewalk.controller.studies.trials import Case, trials
from tests.helpers.dying_workers import square
from tests.helpers.library import library

distributed = pytest.importorskip("distributed")


def test_a_cluster_by_its_address_gives_what_processes_give() -> None:
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None
    ) as cluster:
        far = dict(each(math.factorial, range(7), workers=1, dask=cluster.scheduler_address))
    assert far == {n: math.factorial(n) for n in range(7)}


def dying(folder: Path, *deaths: int) -> list[tuple[str, int, int]]:
    return [(str(folder), number, many) for number, many in enumerate(deaths)]


@pytest.mark.costs("starts processes")
def test_a_worker_that_is_killed_loses_no_item(tmp_path: Path) -> None:
    items = dying(tmp_path, 0, 0, 0, 1, 0, 0, 0, 0, 0, 2, *[0] * 10)
    found = list(each(square, items, workers=2))
    assert sorted(result for _, result in found) == [n**2 for n in range(20)]
    assert {item: item[1] ** 2 for item in items} == dict(found)
    assert len(list(tmp_path.iterdir())) == 3


def test_an_item_that_always_ends_its_worker_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="ended 3 times while it ran this item"):
        list(each(square, dying(tmp_path, 0, 9), workers=1))
    assert len(list(tmp_path.iterdir())) in {3, 4}  # maybe once beside the other, then alone


@pytest.mark.nightly("starts a cluster: 4 s of CPU")
def test_a_cluster_whose_worker_is_killed_loses_no_item(tmp_path: Path) -> None:
    items = dying(tmp_path, 0, 0, 1, *[0] * 17)
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
    ) as cluster:
        found = list(each(square, items, workers=1, dask=cluster.scheduler_address))
    assert {item: item[1] ** 2 for item in items} == dict(found)
    assert len(found) == len(items)


def test_few_items_are_under_way_at_a_time() -> None:
    class Items(Sequence[Any]):
        taken = 0

        def __len__(self) -> int:
            return 40

        def __getitem__(self, number: Any) -> Any:
            Items.taken += 1
            return number

    most = 0
    for done, _ in enumerate(each(math.factorial, Items(), workers=1)):
        most = max(most, Items.taken - 2 * done)  # each is looked at again when it is yielded
    assert most <= AHEAD + 2


@pytest.mark.slow
def test_points_travel_to_other_processes() -> None:
    points, _ = points_of(GAITS["rolling"], load_robot("alternating16"), 2, seed=0, seconds=5.0)
    found = {point.number: key for point, key in each(attrgetter("key"), points, workers=1)}
    assert found == {point.number: point.key for point in points}


def test_no_scheduler() -> None:
    with pytest.raises(InputError, match="no scheduler"):
        dict(each(math.factorial, [1], workers=1, dask="inproc://nowhere/1/1"))


_BLOCKED = """
import os, signal, sys
from pathlib import Path
from snakewalk.controller.console.pool import each

def wait_for_ever(fifo):
    Path("ready").write_text(str(os.getpid()))
    Path(fifo).read_text()  # nobody ever writes

if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a job in the background ignores it
    os.mkfifo("fifo")
    dict(each(wait_for_ever, ["fifo"] * 3, workers=1))
"""


def blocked_parent(folder: Path) -> "subprocess.Popen[str]":
    """A program whose one worker is at work for ever, and has said so."""
    script = folder / "blocked.py"
    script.write_text(_BLOCKED)
    parent = subprocess.Popen(
        [sys.executable, script],
        cwd=folder,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        env=os.environ | {"TMPDIR": str(folder)},
    )
    ready = folder / "ready"
    while not ready.is_file() or not ready.read_text():
        assert parent.poll() is None
    return parent


def test_an_interrupt_waits_for_no_worker(tmp_path: Path) -> None:
    with blocked_parent(tmp_path) as parent:
        os.killpg(parent.pid, signal.SIGINT)  # as a terminal does
        try:
            said = parent.communicate(timeout=600)[1]
        finally:
            with suppress(ProcessLookupError):
                os.killpg(parent.pid, signal.SIGKILL)
    assert said.count("Traceback") == 1, "the parent's own; the worker is silent"
    with pytest.raises(ProcessLookupError):
        os.kill(int((tmp_path / "ready").read_text()), 0)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["blocked.py", "fifo", "ready"]


def test_workers_end_with_a_parent_that_is_killed(tmp_path: Path) -> None:
    with blocked_parent(tmp_path) as parent:
        parent.kill()
        try:
            parent.communicate(timeout=600)  # until nobody holds the other end: no orphan is left
        finally:
            with suppress(ProcessLookupError):
                os.killpg(parent.pid, signal.SIGKILL)


@pytest.mark.nightly("a pool of trials: 5 s of CPU")
def test_trials_never_fork_beside_the_physics(monkeypatch: pytest.MonkeyPatch) -> None:
    def forked() -> int:
        raise AssertionError("forked: a worker must be a fresh interpreter")

    monkeypatch.setattr(os, "fork", forked)
    changes = {"time_limit_s": 0.5}
    planned = [(Case("flat-slalom", "serpenoid"), 0)]
    (trial,) = trials(planned, 1, spread_m=0.0, changes=changes)
    assert not trial.complete
    assert trial.duration_s > 0.0


def test_processes_are_started_in_one_place_and_spawned() -> None:
    names = (
        "get_context(", "subprocess", "set_start_method", "multiprocessing.pool", "os.fork",
        "os.spawn", "os.posix_spawn", "os.exec", "os.system", "os.popen", "pty.spawn", "runpy",
        "LocalCluster",
    )  # fmt: skip
    starters = {file.name for file in library() if any(name in file.text for name in names)}
    stop_program = "drivers/safety/stop_output.py"  # runs a program of the user's, not of ours
    assert starters == {"controller/console/child_process.py", stop_program}
    with process_pool(1) as pool:
        assert pool._mp_context.get_start_method() == "spawn"
