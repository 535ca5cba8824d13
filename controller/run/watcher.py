"""Who looks on at a run: a process of its own, which is fed with the rows of the log."""

import json
import signal
import socket
from collections.abc import Callable
from multiprocessing import get_context
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Protocol, Self

from snakewalk.config.arrays import Image
from snakewalk.config.errors import InputError
from snakewalk.controller.runlog.row_line import RunEnd

_START_S: Final = 60.0
"""How long it may take to start: a busy machine imports slowly (ours)."""
_END_S: Final = 2.0


class Watcher(Protocol):
    """Takes what a run tells; returns at once."""

    def on_row(self, topic: str, row: bytes) -> None:
        """Take a row of the log."""
        ...

    def on_button(self, path: Path) -> None:
        """Take the run's stop button, which the watcher may press."""
        ...

    def on_picture(self, image: Image, time_s: float) -> None:
        """Take a picture (H, W, 3), blue first, of the run's camera, from any thread."""
        ...


class WatcherProcess:
    """A watcher in a process of its own; use it in a ``with``.

    Raises:
        InputError: it did not start; says why.

    """

    def __init__(self, serve: Callable[..., None], *options: Any, fault: str) -> None:
        """Start ``serve(line, *options)`` in a fresh interpreter.

        Args:
            serve: a function of a module; sends one line of JSON when it is ready, with ``fault``
                if it cannot be, and ends when the line does.
            options: what can be pickled.
            fault: beginning of the sentence that says what could not be started.

        """
        ours, far = socket.socketpair()
        context = get_context("spawn")
        self._process = context.Process(target=serve, args=(far, *options), daemon=True)
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # Ctrl-C is the run's
        try:
            self._process.start()
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
        far.close()
        ours.settimeout(_START_S)
        try:
            # unbuffered: what follows the line is the run's to read
            said = json.loads(ours.makefile("rb", buffering=0).readline() or "{}")
        except OSError:
            said = {}
        if not said or "fault" in said:
            self._process.kill()
            raise InputError(f"{fault}: {said.get('fault', 'it did not start')}")
        self.said: dict[str, Any] = said
        """What it said of itself."""
        self._end = RunEnd(ours)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._end.close(0.5)
        self._process.join(_END_S)
        if self._process.is_alive():
            self._process.kill()

    def on_row(self, topic: str, row: bytes) -> None:
        """Take a row of the log; returns at once."""
        self._end.add(topic, row)

    def on_picture(self, image: Image, time_s: float) -> None:
        """Let a picture go by."""

    def on_button(self, path: Path) -> None:
        """Take the run's stop button, which the watcher presses."""
        self._end.add("/button", json.dumps({"path": str(path)}).encode())
