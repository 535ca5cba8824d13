"""How child processes are started: the one place, so that all of them have a safe module path.

A child interpreter searches the working folder first, before it runs a line of this program: a
file ``multiprocessing.py`` or ``resource.py`` next to a downloaded model would be executed.
``PYTHONSAFEPATH`` prevents it. Isolated mode (``-I``) would also ignore the user's ``PYTHONPATH``
and packages (``pip install --user``), from which ROS and other dependencies may come.
"""

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context, resource_tracker
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from pathlib import Path
from typing import Any, Final

from snakewalk.controller.console.safe_path import module_folders

_CONTEXT: Final = get_context("spawn")
"""A forked child would inherit the threads of MuJoCo and numba in an unknown state."""
_LOCK: Final = threading.RLock()
"""The environment belongs to the whole process."""


def child_environ() -> dict[str, str]:
    """Return the environment of a child: this one, with a safe module path."""
    environ = dict(os.environ)
    environ["PYTHONSAFEPATH"] = "1"
    folders = module_folders(environ)
    environ.pop("PYTHONPATH", None)
    if folders:
        environ["PYTHONPATH"] = os.pathsep.join(folders)
    return environ


def start_module(module: str, *arguments: str) -> "subprocess.Popen[str]":
    """Start a Python module in a child; its output is a pipe of text."""
    return subprocess.Popen(
        [sys.executable, "-m", module, *arguments],
        stdout=subprocess.PIPE,
        text=True,
        env=child_environ(),
    )


def run_code(
    code: str, *arguments: str, folder: Path | None = None, timeout_s: float | None = None
) -> "subprocess.CompletedProcess[str]":
    """Run Python code in a child and wait; returns its exit code and output as text.

    Args:
        code: the program.
        arguments: of the program.
        folder: working folder of the child; default: that of this process.
        timeout_s: the child is killed after this time.

    Raises:
        TimeoutError: the child was killed.

    """
    return run_program([sys.executable, "-c", code, *arguments], folder, timeout_s)


def run_program(
    command: Sequence[str], folder: Path | None = None, timeout_s: float | None = None
) -> "subprocess.CompletedProcess[str]":
    """Run a program as ``run_code`` runs Python code.

    Raises:
        TimeoutError: the program was killed.

    """
    try:
        return subprocess.run(
            command,
            env=child_environ(),
            cwd=folder,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=timeout_s,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise TimeoutError(f"{command[0]} does not end") from None


def start(target: Callable[..., object], *arguments: Any, daemon: bool = False) -> SpawnProcess:
    """Start ``target(*arguments)`` in a fresh interpreter that leaves Ctrl-C to this process.

    Args:
        target: a function of a module.
        arguments: picklable values.
        daemon: whether the child is killed when this process exits.

    """
    process = _CONTEXT.Process(target=target, args=arguments, daemon=daemon)
    with _starting():
        process.start()
    return process


def pipe() -> tuple[Connection, Connection]:
    """Return both ends of a line between this process and a child."""
    return _CONTEXT.Pipe()


class SafePool(ProcessPoolExecutor):
    """A pool of fresh interpreters, started as ``start`` does."""

    def __init__(self, workers: int, begin: Callable[..., object], *arguments: Any) -> None:
        """Make a pool; each worker calls ``begin(*arguments)`` first."""
        with _starting():  # its locks start a process, too
            super().__init__(workers, _CONTEXT, begin, arguments)

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> "Future[Any]":
        """Submit a call; may start a worker."""
        with _starting():
            return super().submit(fn, *args, **kwargs)


@contextmanager
def _starting() -> Iterator[None]:
    """Let the children started in this block inherit a safe module path and a blocked SIGINT.

    A terminal sends Ctrl-C to all processes; this one decides what the children do.
    """
    with _LOCK:
        before = dict(os.environ)
        _set_environ(child_environ())
        try:
            if os.name == "posix":  # it is a child, and its start would unblock SIGINT
                resource_tracker.ensure_running()
            mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
            try:
                yield
            finally:
                signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        finally:
            _set_environ(before)


def _set_environ(environ: dict[str, str]) -> None:
    """Set the two variables that decide where a child finds modules."""
    for name in ("PYTHONSAFEPATH", "PYTHONPATH"):
        if name in environ:
            os.environ[name] = environ[name]
        else:
            os.environ.pop(name, None)
