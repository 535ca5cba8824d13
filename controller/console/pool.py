"""The one pool of processes: on this machine, or on the workers of a Dask cluster."""

import os
import tempfile
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from multiprocessing import active_children, parent_process
from typing import TypeVar

from snakewalk.config.errors import InputError
from snakewalk.controller.console.child_process import SafePool

A = TypeVar("A")
B = TypeVar("B")


@contextmanager
def process_pool(workers: int) -> Iterator[ProcessPoolExecutor]:
    """Yield a pool whose workers are fresh interpreters.

    If an exception or an interrupt ends the block, the workers are killed at once, and their
    temporary files are deleted with the pool's folder. Workers whose parent is killed end by
    themselves.
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
    """Let a worker's temporary files lie in the pool's folder, and the worker end with its parent.

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

    Raises:
        InputError: no scheduler answers at that address.

    """
    if dask is not None:
        yield from _on_cluster(work, items, dask)
        return
    with process_pool(workers) as pool:
        waiting = {pool.submit(work, item): item for item in items}
        for done in as_completed(waiting):
            yield waiting[done], done.result()


def _on_cluster(work: Callable[[A], B], items: Sequence[A], address: str) -> Iterator[tuple[A, B]]:
    import distributed  # noqa: PLC0415  an extra

    try:
        client = distributed.Client(address, timeout="5s")
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(f"--dask {address}: no scheduler answers there ({error})") from None
    with client:
        futures = client.map(work, items, pure=False)
        waiting = {future.key: item for future, item in zip(futures, items, strict=True)}
        for future in distributed.as_completed(futures):
            yield waiting[future.key], future.result()
