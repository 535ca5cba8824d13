"""The one pool of processes: on this machine, or on the workers of a Dask cluster."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from typing import TypeVar

from snakewalk.config.errors import InputError

A = TypeVar("A")
B = TypeVar("B")


def process_pool(workers: int) -> ProcessPoolExecutor:
    """Return a pool whose workers are fresh interpreters.

    A forked worker would inherit the threads of MuJoCo and numba in whatever state they are.
    """
    return ProcessPoolExecutor(workers, mp_context=get_context("spawn"))


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
        try:
            for done in as_completed(waiting):
                yield waiting[done], done.result()
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


def _on_cluster(work: Callable[[A], B], items: Sequence[A], address: str) -> Iterator[tuple[A, B]]:
    from distributed import Client  # noqa: PLC0415  an extra
    from distributed import as_completed as finished  # noqa: PLC0415

    try:
        client = Client(address, timeout="5s")  # type: ignore[no-untyped-call]
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(f"--dask {address}: no scheduler answers there ({error})") from None
    with client:
        futures = client.map(work, items, pure=False)
        waiting = {future.key: item for future, item in zip(futures, items, strict=True)}
        for future in finished(futures):  # type: ignore[no-untyped-call]
            yield waiting[future.key], future.result()
