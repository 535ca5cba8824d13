"""What a command would start beside itself, done in its own process, or left out."""

import pickle
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest


class InProcessExecutor(Executor):
    """Does at once what it is given, where a worker would first import everything.

    Work and result are pickled and read back, as on their way to a worker and from it.
    """

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        pass

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> "Future[Any]":
        done: Future[Any] = Future()
        sent_fn, sent_args, sent_kwargs = pickle.loads(pickle.dumps((fn, args, kwargs)))
        done.set_result(pickle.loads(pickle.dumps(sent_fn(*sent_args, **sent_kwargs))))
        return done


def work_in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """Studies start no workers; ``test_pool`` shows that those give the same."""
    from snakewalk.controller.console import pool
    from snakewalk.controller.studies import tune

    @contextmanager
    def here(workers: int) -> Iterator[Executor]:
        yield InProcessExecutor()

    for module in (pool, tune):
        monkeypatch.setattr(module, "process_pool", here)


def leave_out_pages(monkeypatch: pytest.MonkeyPatch) -> None:
    """Runs leave their log and numbers: a page takes two seconds, and is drawn by other tests."""
    from snakewalk.controller.report import artifacts
    from snakewalk.controller.run import run_robot

    def numbers_only(record: Any, folder: Path, numbers: Any = None, **options: Any) -> Any:
        assert numbers is not None, "the command makes a page of a log that was there before"
        run_robot.write_summary(numbers, folder)
        return artifacts.Artifacts(None, None, ())

    monkeypatch.setattr(artifacts, "make_artifacts", numbers_only)
