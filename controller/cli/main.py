"""``snakewalk``: runs the command line and says in a line, with an exit code, how it ended."""

import errno
import io
import os
import signal
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from types import FrameType
from typing import IO, Any

from snakewalk.config.errors import InputError
from snakewalk.config.extras import missing_extra
from snakewalk.config.near_names import file_hint
from snakewalk.config.plain_text import plain
from snakewalk.controller.console.imports import make_path_safe, without_collections
from snakewalk.drivers.clock import WallClock
from snakewalk.drivers.compilation import observe_compilation
from snakewalk.drivers.errors import DriverError, PortError, notes_of

_FAILING = {"strict", "surrogateescape"}
"""Error handlers that raise for a character which the encoding lacks."""


def make_streams_safe() -> None:
    """Open closed standard streams as the null device; escape characters that output lacks.

    A closed descriptor is opened before any file, so that a file or port never becomes the standard
    output of this program.
    """
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, _null(mode))
        elif mode == "w" and isinstance(stream, io.TextIOWrapper) and stream.errors in _FAILING:
            with suppress(OSError):  # a stream over a pipe may want to seek
                stream.reconfigure(errors="backslashreplace")


def _null(mode: str) -> IO[Any]:
    """Open the null device at the lowest free descriptor, for child processes too."""
    descriptor = os.open(os.devnull, os.O_RDWR)
    os.set_inheritable(descriptor, True)
    return open(descriptor, mode, encoding="utf-8", errors="backslashreplace", closefd=False)


_NOTICE_S = 3.0
"""Time between two lines of progress (ours)."""


class CompilationNotice:
    """Prints a line at the first compiled loop of a process, and then how many are compiled.

    ``compile_others`` is called at the second loop: a single one is quickly compiled.
    """

    def __init__(
        self, print_line: Callable[[str], None], compile_others: Callable[[], None] | None = None
    ) -> None:
        self._print_line, self._clock = print_line, WallClock()
        self._compile_others = compile_others
        self._count = 0
        self._next_s = 0.0

    def __call__(self, loop: str) -> None:
        """Count ``loop``, a dotted name that is not printed."""
        self._count += 1
        now_s = self._clock.now_s()
        if self._count == 1:
            self._print_line(
                "compiling loops for this computer, once; in advance: snakewalk tools compile"
            )
        elif self._count == 2 and self._compile_others:
            with suppress(RuntimeError):  # else this process compiles them
                self._compile_others()
        elif now_s >= self._next_s:
            self._print_line(f"compiled {self._count} loops")
        else:
            return
        self._next_s = now_s + _NOTICE_S


_ENDING = tuple(
    getattr(signal, name) for name in ("SIGTERM", "SIGHUP", "SIGQUIT") if hasattr(signal, name)
)
"""Signals that would end a program without a word; SIGQUIT is Ctrl-\\."""
_LEFT_OUT = (
    "AVX512F AVX512CD AVX512_KNL AVX512_KNM AVX512_SKX AVX512_CLX AVX512_CNL AVX512_ICL AVX512_SPR "
    "X86_V4"
)
"""Loops for AVX-512 that numpy leaves out on x86-64: their sines and exponentials differ in the
last bit, and so would runs. numpy ignores unknown names."""
_BY_SIGNAL = 128
"""Exit code of a program that a signal has ended: this, and the signal's number."""
_STOP = "snakewalk.controller.bench.emergency_stop"
"""Name of the only command that must not wait for imports."""
_NO_MEMORY = "not enough memory; end other programs, or raise the limit (ulimit -v)"
_TOO_MANY_FILES = "too many open files; raise the limit (ulimit -n 1024)"
_INTERRUPTED = 130
"""Exit code after Ctrl-C, which has been reported."""


def leave_out_avx512() -> None:
    """Disable instructions of numpy, before its import, that change the last bits."""
    os.environ.setdefault("NPY_DISABLE_CPU_FEATURES", _LEFT_OUT)


def main() -> None:
    """Run the command line; bad input ends with exit code 2 and one line per fault."""
    make_streams_safe()
    make_path_safe()
    _prepare_imports()
    _prepare_signals()
    try:
        _check_words(sys.argv[1:])
        _stop_at_once(sys.argv[1:])
        with without_collections():
            from snakewalk.controller.cli.command_line import app  # noqa: PLC0415  an interrupt may come during it

        _tell_of_pipes()
        observe_compilation(
            CompilationNotice(_print_line, _compile_loops if is_run(sys.argv[1:]) else None)
        )
        app(prog_name="snakewalk")
    except SystemExit as stop:
        if isinstance(stop.code, int) and stop.code > _BY_SIGNAL and stop.code != _INTERRUPTED:
            name = signal.Signals(stop.code - _BY_SIGNAL).name
            _print_line(_with_notes(f"ended by {name}", stop))
        raise
    except KeyboardInterrupt as stop:
        _end(_INTERRUPTED, _with_notes("interrupted", stop))
    except Exception as error:
        _end_by(error)


def _prepare_imports() -> None:
    """Set what numba, MuJoCo and numpy read when they are imported."""
    # numba reads .numba_config.yaml of the working folder; this keeps it from loading code there
    os.environ.setdefault("NUMBA_CACHE_DIR", "")
    # Pictures are drawn without a screen, by a context of our own; MuJoCo's import fails on a
    # choice that is not installed.
    os.environ["MUJOCO_GL"] = "disable"
    leave_out_avx512()


def _prepare_signals() -> None:
    """Let each signal that ends the program end every context properly."""
    # a script makes its background programs ignore ^C and SIGQUIT, and a run has to stop all the
    # same; nohup ignores SIGHUP on purpose
    for number in _ENDING:
        ignored = signal.getsignal(number) is signal.SIG_IGN
        if signal.getsignal(number) is signal.SIG_DFL or (ignored and number.name != "SIGHUP"):
            signal.signal(number, _unwind)
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def _end_by(error: Exception) -> None:
    """Report an error in words of the user; an error that no user can cause is raised again."""
    notes = notes_of(error)  # of a run: state of torque and log
    begun = 1 if notes else 2
    match error:
        case PortError(faults=faults):
            _end(begun, "; ".join(faults), *notes)
        case InputError(faults=faults):
            _end(2, *faults[:-1], f"{faults[-1]}{_near(error)}")
        case DriverError():
            _end(1, _with_notes(str(error), error))
        case ModuleNotFoundError() if (needed := missing_extra(error)) is not None:
            _end(2, needed)
        case OSError(errno=errno.EMFILE):
            _end(1, _with_notes(_TOO_MANY_FILES, error))
        case OSError(errno=errno.ENOSPC):
            place = error.filename or "standard output"
            _end(1, _with_notes(f"{place}: {error.strerror}; free space", error))
        case OSError():
            place = f"{Path(str(error.filename))}: " if error.filename else ""
            _end(begun, _with_notes(f"{place}{error.strerror or error}{_near(error)}", error))
        case MemoryError() | ImportError() if _is_out_of_memory(error):
            _end(begun, _with_notes(_NO_MEMORY, error))
        case _:
            raise error


def _near(error: Exception) -> str:
    """Hint on the missing file that is the error, or its cause."""
    for cause in (error, error.__context__):
        if isinstance(cause, FileNotFoundError) and cause.filename:
            return file_hint(Path(cause.filename))
    return ""


def _stop_at_once(words: list[str]) -> None:
    """End after ``snakewalk stop`` without importing the command line; return for other words."""
    if words[:1] == ["stop"] and find_spec(_STOP) is not None:
        code = import_module(_STOP).stop_now(words[1:])
        if code is not None:
            raise SystemExit(code)


def is_run(words: list[str]) -> bool:
    """Whether a command needs nearly all loops."""
    return "run" in words[:2]


def _compile_loops() -> None:
    import_module("snakewalk.controller.bench.loop_compiler").compile_with_progress(runs=True)


def _unwind(number: int, frame: FrameType | None) -> None:
    """Turn a signal into an exception, so that every context ends properly."""
    raise SystemExit(_BY_SIGNAL + number)


def _is_out_of_memory(error: BaseException | None) -> bool:
    """Whether an error, or its cause, is a lack of memory; the loader reports it as text."""
    while error is not None:
        if isinstance(error, MemoryError) or "failed to map segment" in str(error):
            return True
        error = error.__cause__ or error.__context__
    return False


def _check_words(words: list[str]) -> None:
    """Reject names that are not text: libraries below crash on them.

    Raises:
        InputError: the bytes of a word are not UTF-8, or not of the locale's encoding.

    """
    for word in words:
        try:
            word.encode()
        except UnicodeEncodeError:
            data = word.encode(errors="surrogateescape")
            shown = data.decode(errors="backslashreplace")
            fault = "this name is not UTF-8; rename the file"
            if sys.getfilesystemencoding() != "utf-8" and shown.encode() == data:
                fault = "this locale cannot represent the name; set PYTHONUTF8=1"
            raise InputError(f"{shown}: {fault}") from None


@cache
def _tell_of_pipes() -> None:
    """Report every opening of a named pipe: it waits until another program also opens it."""
    sys.addaudithook(_tell_of_pipe)


def _tell_of_pipe(event: str, details: tuple[object, ...]) -> None:
    """Audit hook: say that the file about to be opened is a named pipe."""
    if event != "open":
        return
    path, _, flags = details
    if (
        not isinstance(path, str)
        or not isinstance(flags, int)
        or path.startswith(("/dev/", "/proc/"))
    ):
        return  # a descriptor, or one of the shell's
    if flags & getattr(os, "O_NONBLOCK", 0) or not Path(path).is_fifo():
        return
    to = "reads from" if flags & os.O_WRONLY else "writes to"
    _print_line(f"{path}: a named pipe: waits for a program that {to} it; ^C ends")


def _with_notes(text: str, error: BaseException) -> str:
    """Return the reason for the end, with a run's notes on torque and log."""
    return "; ".join([text, *notes_of(error)])


def _end(code: int, *lines: str) -> None:
    for line in lines:
        _print_line(line)
    raise SystemExit(code) from None


def _print_line(line: str) -> None:
    print(f"snakewalk: {plain(line)}", file=sys.stderr)
