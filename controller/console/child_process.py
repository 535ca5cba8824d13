"""Start of child processes with a safe module path; the only place for it.

A child interpreter searches the working folder first: a file ``multiprocessing.py`` or
``resource.py`` next to a downloaded model would be executed. ``PYTHONSAFEPATH`` prevents it.
Isolated mode (``-I``) would also ignore the user's ``PYTHONPATH`` and packages (``pip install
--user``), which ROS and other dependencies may need.
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
from typing import Any

from snakewalk.controller.console.imports import module_folders

_CONTEXT = get_context("spawn")
"""A forked child would inherit the threads of MuJoCo and numba in an unknown state."""
_LIMITS = """
import sys
*words, memory_bytes, cpu_s = sys.argv[1:]
try:
    import resource
except ImportError:  # Windows
    pass
else:
    for which, most in (("AS", memory_bytes), ("CPU", cpu_s), ("FSIZE", memory_bytes)):
        resource.setrlimit(getattr(resource, "RLIMIT_" + which), (int(most), int(most)))
"""
_LOCK = threading.RLock()
"""Lock of the environment, which belongs to the whole process."""


def child_environ() -> dict[str, str]:
    """Environment of a child: that of this process, with a safe module path."""
    environ = dict(os.environ)
    environ["PYTHONSAFEPATH"] = "1"
    folders = module_folders(environ)
    environ.pop("PYTHONPATH", None)
    if folders:
        environ["PYTHONPATH"] = os.pathsep.join(folders)
    return environ


def start_module(module: str, *arguments: str) -> "subprocess.Popen[str]":
    """Start a Python module in a child that leaves Ctrl-C to this process; its output is a pipe."""
    with _starting():
        return subprocess.Popen(
            [sys.executable, "-m", module, *arguments], stdout=subprocess.PIPE, text=True
        )


def run_command(words: Sequence[str]) -> int:
    """Run a command of this program in the same terminal and return its exit code.

    Ctrl-C is left to the command, which ends as it would alone.
    """
    code = "from snakewalk.controller.cli.main import main; main()"
    before = signal.getsignal(signal.SIGINT)
    with subprocess.Popen([sys.executable, "-c", code, *words], env=child_environ()) as child:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        try:
            return child.wait()
        finally:
            signal.signal(signal.SIGINT, before)


def run_code(
    code: str, *arguments: str, folder: Path | None = None, timeout_s: float | None = None
) -> "subprocess.CompletedProcess[str]":
    """Run Python code in a child and wait; return its exit code and output as text.

    ``folder`` is its working folder, by default that of this process. It is killed after
    ``timeout_s``.

    Raises:
        TimeoutError: the child was killed.

    """
    return run_program([sys.executable, "-c", code, *arguments], folder, timeout_s)


def run_limited(
    code: str,
    *arguments: str,
    most: tuple[int, int],
    folder: Path | None = None,
    timeout_s: float | None = None,
) -> "subprocess.CompletedProcess[str]":
    """Run code like ``run_code`` within limits; its ``words`` are the arguments.

    ``most`` are bytes of memory and of a file, and seconds of CPU time.
    """
    return run_code(_LIMITS + code, *arguments, *map(str, most), folder=folder, timeout_s=timeout_s)


def run_program(
    command: Sequence[str], folder: Path | None = None, timeout_s: float | None = None
) -> "subprocess.CompletedProcess[str]":
    """Run a program like ``run_code``.

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

    ``target`` is a function of a module, ``arguments`` are picklable. A ``daemon`` is killed when
    this process exits.
    """
    process = _CONTEXT.Process(target=target, args=arguments, daemon=daemon)
    with _starting():
        process.start()
    return process


def pipe() -> tuple[Connection, Connection]:
    """Return both ends of a connection to a child."""
    return _CONTEXT.Pipe()


class SafePool(ProcessPoolExecutor):
    """A pool of fresh interpreters, started like ``start``."""

    def __init__(self, workers: int, begin: Callable[..., object], *arguments: Any) -> None:
        """Make a pool; each worker calls ``begin(*arguments)`` first."""
        with _starting():  # its locks start a process too
            super().__init__(workers, _CONTEXT, begin, arguments)

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> "Future[Any]":
        """Submit a call; may start a worker."""
        with _starting():
            return super().submit(fn, *args, **kwargs)


@contextmanager
def _starting() -> Iterator[None]:
    """Give children started in this block a safe module path and a blocked SIGINT.

    A terminal sends Ctrl-C to all processes; the parent decides how its children end.
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
    """Set the two variables for a child's module path."""
    for name in ("PYTHONSAFEPATH", "PYTHONPATH"):
        if name in environ:
            os.environ[name] = environ[name]
        else:
            os.environ.pop(name, None)
