"""An observer in a process of its own, which receives the rows of the log."""

import json
import socket
from collections.abc import Callable
from pathlib import Path
from typing import Any, Self

from snakewalk.config.arrays import Image
from snakewalk.config.errors import InputError
from snakewalk.controller.console.child_process import start
from snakewalk.controller.runlog.row_line import BUTTON, RunEnd

_START_S = 60.0
"""Longest time until it starts; a busy machine imports slowly (ours)."""
_END_S = 2.0


class ObserverProcess:
    """An observer in a process of its own, as a context manager.

    Raises:
        InputError: it did not start; with the reason.

    """

    def __init__(self, serve: Callable[..., None], *options: Any, what: str, fault: str) -> None:
        """Start ``serve(line, *options)`` in a fresh interpreter.

        Args:
            serve: a function of a module; sends one line of JSON when it is ready, with ``fault``
                if it cannot be, and ends when the line does.
            options: options that can be pickled.
            what: name of the observer in messages.
            fault: beginning of the sentence that says what could not be started.

        """
        near_end, far_end = socket.socketpair()
        self._process = start(serve, far_end, *options, daemon=True)
        far_end.close()
        near_end.settimeout(_START_S)
        try:
            # unbuffered: the bytes after the line are for the run
            said = json.loads(near_end.makefile("rb", buffering=0).readline() or "{}")
        except OSError:
            said = {}
        if not said or "fault" in said:
            self._process.kill()
            raise InputError(f"{fault}: {said.get('fault', 'it did not start')}")
        self.said: dict[str, Any] = said
        """Description that the observer gave of itself."""
        self._end = RunEnd(near_end)
        self._what = what

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *raised: object) -> None:
        self._end.close(0.5)
        self._process.join(_END_S)
        if self._process.is_alive():
            self._process.kill()

    def lost(self, now_s: float) -> str | None:
        """Return why its E-STOP has failed, or None."""
        if self._end.is_closed:
            return f"{self._what}: its process has ended, and its E-STOP with it"
        if self._end.is_silent(now_s):
            return f"{self._what}: it does not respond, so its E-STOP may not work"
        return None

    def rejected(self) -> list[str]:
        """Return why commands were rejected since the last call."""
        return [f"{self._what}: {why}" for why in self._end.rejected()]

    def on_row(self, topic: str, row: bytes) -> None:
        """Queue a row of the log; returns at once."""
        self._end.add(topic, row)

    def on_picture(self, image: Image, time_s: float) -> None:
        """Skip a picture."""

    def on_button(self, path: Path) -> None:
        """Store the run's stop button for the observer."""
        self._end.add(BUTTON, json.dumps({"path": str(path)}).encode())
