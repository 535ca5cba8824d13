"""Stop output: cuts the servos' supply from outside if torque off is not confirmed.

It is a modem line of a serial port that switches a relay, or a program of the user. A simulated run
opens the simulated supply instead.
"""

import os
import shlex
import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, Self

import serial

from snakewalk.drivers.errors import PortError

PATIENCE_S = 5.0
"""Longest time that a program for the stop output may need, s (ours)."""
_LINES = ("rts", "dtr")


class StopOutput(Protocol):
    """Stops the servos without their bus; a context manager."""

    @property
    def name(self) -> str:
        """For messages."""
        ...

    def activate(self) -> None:
        """Stop the servos.

        Raises:
            OSError: it failed.

        """
        ...

    def __enter__(self) -> Self:
        """Prepare the output."""
        ...

    def __exit__(self, *raised: object) -> None:
        """Release the output."""
        ...


class _UnpreparedOutput:
    """Base of outputs that need no preparation."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *raised: object) -> None:
        pass


@dataclass(frozen=True, slots=True)
class StopCall(_UnpreparedOutput):
    """A function that stops the servos, such as that of a simulated supply."""

    name: str
    call: Callable[[], None]

    def activate(self) -> None:
        """Call the function."""
        self.call()


@dataclass(frozen=True, slots=True)
class StopCommand(_UnpreparedOutput):
    """A program of the user, started without a shell."""

    words: tuple[str, ...]

    @property
    def name(self) -> str:
        """The command line."""
        return shlex.join(self.words)

    def __enter__(self) -> Self:
        """Check that the program can be started.

        Raises:
            PortError: it does not exist, or is not executable.

        """
        if self.fault is not None:
            raise PortError(self.fault)
        return self

    @property
    def fault(self) -> str | None:
        """Why the program cannot be started on this computer, or None."""
        program = self.words[0]
        if Path(program).is_file() and os.access(program, os.X_OK):
            return None
        what = "is not executable" if Path(program).is_file() else "no such program"
        return f"stop output {self.name}: {what}; name a program that can be started"

    def activate(self) -> None:
        """Run the program in its own session: Ctrl-C in the terminal does not end it.

        Raises:
            OSError: it cannot be started, does not end within ``PATIENCE_S``, or fails.

        """
        try:
            done = subprocess.run(
                self.words,
                stdin=subprocess.DEVNULL,
                timeout=PATIENCE_S,
                check=False,
                start_new_session=True,
            )
        except subprocess.TimeoutExpired:
            raise OSError(f"has not ended after {PATIENCE_S:g} s") from None
        if done.returncode:
            raise OSError(f"exit code {done.returncode}")


class StopLine:
    """A modem line of a serial port, held inactive while the context lasts."""

    def __init__(self, device: str, line: str, *, is_inverted: bool) -> None:
        self.name = f"{'-' if is_inverted else ''}{line}:{device}"
        self._device = device
        self._line = line
        self._is_inverted = is_inverted
        self._port: serial.Serial | None = None

    def __enter__(self) -> Self:
        """Open the port with the line inactive.

        Raises:
            PortError: the port cannot be opened, or lacks the line.

        """
        port = serial.Serial()
        port.port = self._device
        port.rts = self._is_inverted
        port.dtr = self._is_inverted
        try:
            port.open()
            self._port = port
            self._set_output(on=self._is_inverted)
        except (OSError, serial.SerialException) as error:
            port.close()
            raise PortError(
                f"stop output {self.name}: {error}; name a serial port with this line, or a command"
            ) from None
        return self

    def __exit__(self, *raised: object) -> None:
        if self._port is not None:
            self._port.close()
            self._port = None

    def activate(self) -> None:
        """Set the line, or clear an inverted one.

        Raises:
            OSError: the port is gone.

        """
        self._set_output(on=not self._is_inverted)

    def _set_output(self, *, on: bool) -> None:
        if self._port is None:
            raise OSError("the port is closed")
        setattr(self._port, self._line, on)


def parse_stop_output(text: str) -> StopOutput:
    """Stop output of a text: ``rts:PORT``, ``-dtr:PORT``, ``command:/PROGRAM ARGUMENT ...``.

    Raises:
        ValueError: the text has another form.

    """
    if "\0" in text:
        raise ValueError(f"{text!r}: has a NUL character; leave it out")
    kind, separator, rest = text.partition(":")
    line = kind.removeprefix("-")
    if separator and rest and line in _LINES:
        return StopLine(rest, line, is_inverted=kind != line)
    if separator and kind == "command":
        try:
            words = tuple(shlex.split(rest))
        except ValueError as error:
            raise ValueError(f"{text!r}: {error}; close the quotation") from None
        if words and Path(words[0]).is_absolute():
            return StopCommand(words)
        raise ValueError(f"{text!r}: the program needs its absolute path")
    raise ValueError(
        f"{text!r} is not a stop output; use rts:PORT, -rts:PORT, dtr:PORT, -dtr:PORT or "
        "command:/PROGRAM ARGUMENT ..."
    )
