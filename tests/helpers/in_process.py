"""The command line without a new process: the same door, code and streams; a pool without any."""

import io
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from typing import Any
from unittest import mock

import pytest


@dataclass(frozen=True)
class Done:
    returncode: int
    stdout: str
    stderr: str


def snakewalk(*words: str) -> Done:
    """Run ``snakewalk WORDS``; what it raises other than its exit is a fault of the test."""
    from snakewalk.controller.app.cli import main as cli

    out, err, code = io.StringIO(), io.StringIO(), 0
    argv = mock.patch.object(sys, "argv", ["snakewalk", *words])
    with argv, redirect_stdout(out), redirect_stderr(err):
        try:
            cli.main()
        except SystemExit as end:
            code = end.code if isinstance(end.code, int) else int(end.code is not None)
    return Done(code, out.getvalue(), err.getvalue())


class _Here(Executor):
    """Does at once what it is given, where a worker would first import everything."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> "Future[Any]":
        done: Future[Any] = Future()
        done.set_result(fn(*args, **kwargs))
        return done


def work_in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """Studies start no workers; ``test_pool`` shows that those give the same."""
    from snakewalk.controller.app.studies import pool, tune

    @contextmanager
    def here(workers: int) -> Iterator[Executor]:
        yield _Here()

    for module in (pool, tune):
        monkeypatch.setattr(module, "process_pool", here)
