"""Messages of a command: on standard error by level, and in a log file.

They use the logger ``snakewalk``: ``debug`` is a step, ``info`` a decision of a run, ``warning``
something that a user should know, ``error`` a fault. Warnings of libraries are ``debug``. Without
:func:`messages` nothing is shown, as for any library.
"""

import logging
import platform
import shlex
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

from snakewalk.config.errors import InputError
from snakewalk.config.plain_text import plain
from snakewalk.drivers.errors import notes_of
from snakewalk.drivers.fallbacks import fallbacks_in_use

if TYPE_CHECKING:
    from rich.console import Console

LOGGER = logging.getLogger("snakewalk")
LOGGER.addHandler(logging.NullHandler())
# it reports a home folder that is not writable, in two lines of its own
logging.getLogger("matplotlib").setLevel(logging.ERROR)
_KEPT_LINES = 10_000
"""Messages that are kept to restore a deleted file (ours)."""
FAULT = "fault"
"""Attribute of a record whose text is printed by the caller that ends the command."""


def stderr_console() -> "Console":
    """Standard error for bars; silent if ``info`` is not shown."""
    from snakewalk.controller.console.plain_console import PlainConsole  # noqa: PLC0415  a program starts without it

    screens = [handler for handler in LOGGER.handlers if isinstance(handler, _Screen)]
    return PlainConsole(
        stderr=True, emoji=False, quiet=any(screen.level > logging.INFO for screen in screens)
    )


class _Screen(logging.Handler):
    """Current standard error; a progress bar redirects it."""

    def emit(self, record: logging.LogRecord) -> None:
        if not getattr(record, FAULT, False):
            start = "snakewalk: " if record.levelno >= logging.WARNING else ""
            print(f"{start}{plain(record.getMessage())}", file=sys.stderr, flush=True)


class _KeptFile(logging.FileHandler):
    """The file of ``--log-file``; reports a fault of disk or folder once.

    If the file or its folder is deleted, it is restored with all messages so far.
    """

    def __init__(self, file: Path) -> None:
        super().__init__(file, encoding="utf-8")
        self._option = f"--log-file {file}"
        self._lines: list[str] = []
        self._has_failed = False

    def emit(self, record: logging.LogRecord) -> None:
        if self._has_failed:
            return
        if len(self._lines) < _KEPT_LINES:
            self._lines.append(self.format(record))
        try:
            if not Path(self.baseFilename).exists():
                self._restore()
            else:
                super().emit(record)
        except OSError as error:
            self._report(error)

    def handleError(self, record: logging.LogRecord) -> None:  # noqa: N802  logging's name
        error = sys.exc_info()[1]
        if isinstance(error, OSError):
            self._report(error)
        else:
            super().handleError(record)

    def close(self) -> None:
        try:
            super().close()
        except OSError as error:
            self._report(error)

    def _restore(self) -> None:
        if self.stream is not None:
            self.stream.close()
        Path(self.baseFilename).parent.mkdir(parents=True, exist_ok=True)
        self.stream = self._open()
        self.stream.write("".join(f"{line}\n" for line in self._lines))
        self.flush()
        _print_warning(
            f"{self._option}: was deleted meanwhile; it is written again, with "
            f"{len(self._lines)} messages so far"
        )

    def _report(self, error: OSError) -> None:
        if self._has_failed:
            return
        self._has_failed = True
        _print_warning(
            f"{self._option}: {error.strerror or error}; it ends here, further messages are on "
            "standard error only"
        )


def _print_warning(text: str) -> None:
    print(f"snakewalk: {plain(text)}", file=sys.stderr, flush=True)


class _OneLine(logging.Formatter):
    def formatMessage(self, record: logging.LogRecord) -> str:  # noqa: N802  logging's name
        return plain(super().formatMessage(record))


@contextmanager
def messages(level: str, file: Path | None = None) -> Iterator[None]:
    """Show messages from ``level``, and append all of them to ``file``.

    Raises:
        InputError: the file cannot be written.

    """
    handlers: list[logging.Handler] = [_Screen(level.upper())]
    if file is not None:
        try:
            kept = _KeptFile(file)
        except OSError as error:
            raise InputError(f"--log-file {file}: {error.strerror or error}") from None
        kept.setFormatter(_OneLine("%(asctime)s %(levelname)-7s %(message)s"))
        handlers.append(kept)
    LOGGER.setLevel(logging.DEBUG)
    LOGGER.propagate = False
    for handler in handlers:
        LOGGER.addHandler(handler)
    shown = warnings.showwarning
    warnings.showwarning = _library_warning
    try:
        words = shlex.join(["snakewalk", *sys.argv[1:]])
        LOGGER.debug(
            "%s; version %s, Python %s, %s",
            words,
            version("snakewalk"),
            platform.python_version(),
            platform.platform(),
        )
        for text in fallbacks_in_use():  # reported at the import of modules, before this
            LOGGER.warning(text)
        yield
        LOGGER.debug("done")
    except BaseException as error:
        _report_end(error)
        raise
    finally:
        warnings.showwarning = shown
        for handler in handlers:
            LOGGER.removeHandler(handler)
            handler.close()
        LOGGER.propagate = True


def _report_end(error: BaseException) -> None:
    elsewhere = {FAULT: True}
    if isinstance(error, InputError):
        for line in error.faults:
            LOGGER.error("%s", line, extra=elsewhere)
    elif isinstance(error, SystemExit):
        LOGGER.debug("ended with exit code %s", error.code)
    elif isinstance(error, KeyboardInterrupt):
        LOGGER.error("; ".join(["interrupted", *notes_of(error)]), extra=elsewhere)
    else:
        LOGGER.error("%s", error, extra=elsewhere, exc_info=error)


def _library_warning(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: TextIO | None = None,
    line: str | None = None,
) -> None:
    """Log a library's warning as ``debug``."""
    del file, line
    LOGGER.debug("%s:%d: %s: %s", Path(filename).name, lineno, category.__name__, message)
