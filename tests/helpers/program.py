"""Programs of a test that run in processes of their own and need not import first.

A server that has imported what they need starts them, by fork; a program from nothing takes more
than a second of CPU until its first line.
"""

import os
import signal
import sys
from collections.abc import Callable
from contextlib import ExitStack
from multiprocessing import get_context
from multiprocessing.connection import Connection
from types import TracebackType

from snakewalk.controller.cli.main import main

_SERVER = get_context("forkserver")
_SERVER.set_forkserver_preload(
    [
        "tests.helpers.swing_child",
        "snakewalk.controller.bench.commands.bus_serve",
        "snakewalk.controller.run.factory",
        "snakewalk.sim.serve.pty",
    ]
)


def _begin(
    out: Connection, err: Connection, env: dict[str, str], run: Callable[..., object], *args: str
) -> None:
    for end, number in ((out, 1), (err, 2)):
        os.dup2(end.fileno(), number)
        end.close()
    os.environ.clear()
    os.environ.update(env)
    # a runner in the background has SIGINT ignored, which its children inherit
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        run(*args)
    except KeyboardInterrupt:  # ends as an interpreter does
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        os.kill(os.getpid(), signal.SIGINT)


def _command(*words: str) -> None:
    sys.argv = ["snakewalk", *words]
    main()


class Program:
    """``run(*args)`` in a process of its own, with the names of ``subprocess.Popen``."""

    def __init__(self, run: Callable[..., object], *args: str) -> None:
        (stdout, out), (stderr, err) = (_SERVER.Pipe(duplex=False) for _ in range(2))
        self._process = _SERVER.Process(
            target=_begin, args=(out, err, dict(os.environ), run, *args), daemon=True
        )
        self._process.start()
        with ExitStack() as done:
            for end in (stdout, out, stderr, err):
                done.enter_context(end)
            self.stdout, self.stderr = (os.fdopen(os.dup(end.fileno())) for end in (stdout, stderr))

    @property
    def pid(self) -> int:
        assert self._process.pid is not None
        return self._process.pid

    @property
    def returncode(self) -> int | None:
        return self._process.exitcode

    def poll(self) -> int | None:
        return self._process.exitcode

    def wait(self) -> int | None:
        self._process.join()
        return self._process.exitcode

    def send_signal(self, number: int) -> None:
        os.kill(self.pid, number)

    def kill(self) -> None:
        self._process.kill()

    def communicate(self) -> tuple[str, str]:
        """All that it still says, once it has ended; less than a pipe holds goes to ``stderr``."""
        said = self.stdout.read(), self.stderr.read()
        self.wait()
        return said

    def __enter__(self) -> "Program":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.wait()
        self.stdout.close()
        self.stderr.close()


def command(*words: str) -> Program:
    """Start ``snakewalk WORDS...``."""
    return Program(_command, *words)
