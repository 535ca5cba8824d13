"""The pool of processes: on this machine, or on the workers of a Dask cluster."""

import os
import tempfile
import threading
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ALL_COMPLETED, FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from itertools import islice
from multiprocessing import active_children, parent_process
from typing import TypeVar

from snakewalk.config.errors import InputError
from snakewalk.controller.console.child_process import SafePool

A = TypeVar("A")
B = TypeVar("B")
AHEAD = 4
"""Items that are submitted for each worker, so that none waits for this process (ours)."""
LEAST_AHEAD = 16
"""Items that are submitted to a cluster at least: its workers may still start (ours)."""
ATTEMPTS = 3
"""Times that an item may end its worker (ours)."""


@contextmanager
def process_pool(workers: int) -> Iterator[ProcessPoolExecutor]:
    """Yield a pool whose workers are fresh interpreters.

    If an exception or an interrupt ends the block, the workers are killed, and their temporary
    files are deleted. Workers of a killed parent end by themselves.
    """
    others = {child.pid for child in active_children()}
    with (
        tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder,
        SafePool(workers, _begin, folder) as pool,
    ):
        try:
            yield pool
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            for child in active_children():
                if child.pid not in others:
                    child.kill()
            raise


def _begin(folder: str) -> None:
    """Put a worker's temporary files into the pool's folder, and end the worker with its parent.

    A busy worker does not notice that no process will receive its result.
    """
    tempfile.tempdir = folder
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def each(
    work: Callable[[A], B], items: Sequence[A], *, workers: int, dask: str | None = None
) -> Iterator[tuple[A, B]]:
    """Yield (item, result) as they finish; ``dask`` is the address of a scheduler.

    A few items per worker are submitted at a time, so memory does not grow with their number. If a
    worker dies, its items start again.

    Raises:
        InputError: no scheduler replies at that address, or an item ended its worker ``ATTEMPTS``
            times.

    """
    if dask is not None:
        yield from _on_cluster(work, items, dask)
        return
    upcoming = iter(range(len(items)))
    suspects = deque[int]()
    deaths: Counter[int] = Counter()
    is_done = False
    while not is_done:
        with suppress(BrokenProcessPool):
            yield from _on_one_pool(work, items, workers, upcoming, suspects, deaths)
            is_done = True


def _on_one_pool(
    work: Callable[[A], B],
    items: Sequence[A],
    workers: int,
    upcoming: Iterator[int],
    suspects: deque[int],
    deaths: Counter[int],
) -> Iterator[tuple[A, B]]:
    """Yield results until all are done.

    ``suspects`` are the items that ran or waited when a worker died. They run first, one at a time,
    so that ``deaths`` counts only the item that ends its worker.

    Raises:
        BrokenProcessPool: a worker died. The others are killed: one that starts just then would
            never end, and the pool waits for it (Python 3.11).

    """
    waiting: dict[Future[B], int] = {}
    with process_pool(workers) as pool:
        while True:
            most, source = (1, suspects) if suspects else (AHEAD * workers, None)
            broken = False
            while len(waiting) < most and not broken:
                number = suspects.popleft() if source else next(upcoming, None)
                if number is None:
                    break
                try:
                    waiting[pool.submit(work, items[number])] = number
                except BrokenProcessPool:  # a worker has died since the last result
                    suspects.append(number)
                    broken = True
            if not waiting and not broken:
                return
            alone = len(waiting) == 1 and not broken
            finished, _ = wait(waiting, return_when=ALL_COMPLETED if broken else FIRST_COMPLETED)
            for future in finished:
                try:
                    result = future.result()
                except BrokenProcessPool:
                    broken = True
                    continue
                number = waiting.pop(future)
                yield items[number], result
            if broken:
                suspects.extend(sorted(waiting.values()))
                if alone:
                    _count_death(deaths, suspects[-1], items)
                raise BrokenProcessPool


def _count_death(deaths: Counter[int], number: int, items: Sequence[A]) -> None:
    deaths[number] += 1
    if deaths[number] >= ATTEMPTS:
        raise InputError(
            f"{items[number]}: a worker process ended {ATTEMPTS} times while it ran this item; "
            "look for a lack of memory, then repeat the command: finished items are kept"
        )


def _on_cluster(work: Callable[[A], B], items: Sequence[A], address: str) -> Iterator[tuple[A, B]]:
    import distributed  # noqa: PLC0415  an extra

    try:
        client = distributed.Client(address, timeout="5s")
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(f"--dask {address}: no scheduler answers there ({error})") from None
    with client:
        upcoming = iter(range(len(items)))
        waiting = dict[str, int]()
        finished = distributed.as_completed()

        def submit(number: int) -> None:
            future = client.submit(work, items[number], pure=False)
            waiting[future.key] = number
            finished.add(future)

        deaths: Counter[int] = Counter()
        while True:
            ahead = max(LEAST_AHEAD, AHEAD * sum(client.nthreads().values()))
            for number in islice(upcoming, ahead - len(waiting)):
                submit(number)
            if not waiting:
                return
            for _ in range(min(len(waiting), LEAST_AHEAD)):
                future = next(finished)
                number = waiting.pop(future.key)
                try:
                    result = future.result()
                except distributed.KilledWorker:
                    _count_death(deaths, number, items)
                    submit(number)
                    continue
                yield items[number], result
