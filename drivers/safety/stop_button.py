"""The stop button: a small private file through which another program latches a run's safe link.

A program that moves servos creates the file, locks it and maps it. An unlocked file is not a
button. Pressing it cannot delay the run. A run stops if its file is deleted or truncated, because
nobody could stop it otherwise. The run reads the file, not its map: reading the map of a truncated
file kills a program.
Layout: a byte that is 1 once pressed, and a byte that is 1 once the run has ended. Then come the
name of the operator and the end of the run (length and text each), and a description of the run as
JSON. A text is written before its byte.
"""

import errno
import json
import mmap
import os
import stat
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Self

from snakewalk.config.errors import InputError
from snakewalk.drivers.errors import notes_of
from snakewalk.drivers.port.byte_port import is_url
from snakewalk.drivers.port.port_holders import (
    PROC,
    lockers_of,
    open_files,
)

try:
    import fcntl
except ImportError:  # Windows: a killed program leaves its button until the file is deleted
    fcntl = None  # type: ignore[assignment]

_HAS_LOCKS: bool = fcntl is not None
_BYTES = 4096
_PRESSED_BYTE = 0
_ENDED_BYTE = 1
_REQUESTER = slice(16, 528)
_END = slice(528, 1552)
_RUN = slice(1552, _BYTES)
BUTTON_SUFFIX = ".stop"
_LOOK_EVERY = 16
"""Calls of ``pressed`` until it looks at the file again (ours)."""
_TEMPORARY = "/tmp" if _HAS_LOCKS else os.path.expanduser("~")
_OPEN_FLAGS = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_CLOEXEC", 0)


@dataclass(frozen=True, slots=True)
class StoppableRun:
    """Program and run of a button."""

    process: int
    name: str
    """Name of the run, for people."""
    ports: tuple[str, ...]
    """Names of the run's ports, as ``resolved`` returns them; none in simulation."""
    folder: str | None
    """Absolute path of the folder with the run's log."""


class StopButton:
    """The run's own button; a context manager that removes it.

    Raises:
        InputError: the folder of buttons is not private, a file cannot be made in it, or another
            run of this user is on the same URL, which no system locks.
        OSError: the disk is full.

    """

    def __init__(
        self,
        name: str,
        port: str | Sequence[str] | None = None,
        folder: Path | None = None,
    ) -> None:
        ports = [port] if isinstance(port, str) else port or ()
        devices = tuple(map(resolved, ports))
        where = None if folder is None else str(folder.absolute())
        self.run = StoppableRun(os.getpid(), name, devices, where)
        place = button_folder()
        _refuse_used_urls(devices)
        # locked and filled before it gets its final name; Windows cannot rename an open file
        kind = "" if _HAS_LOCKS else BUTTON_SUFFIX
        try:
            self._file, path = _new_file(place, kind)
            # written, not truncated to its size: on a full disk a sparse map kills the program
            if os.write(self._file, bytes(_BYTES)) < _BYTES:
                raise OSError(errno.ENOSPC, "No space left on device")
        except OSError as error:
            if error.errno in (errno.ENOSPC, errno.EFBIG):
                raise OSError(errno.ENOSPC, error.strerror, str(place)) from None
            raise InputError(_cannot_be_made(place, error)) from None
        if _HAS_LOCKS:
            fcntl.flock(self._file, fcntl.LOCK_EX)
        self._calls = 0
        self._map = mmap.mmap(self._file, _BYTES)
        _write_text(self._map, _RUN, json.dumps(asdict(self.run)))
        self.path = path.with_suffix(BUTTON_SUFFIX)
        """Path of the file, for programs that may press it."""
        if not kind:
            os.replace(path, self.path)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        notes = notes_of(error)
        reasons = [str(error)] if isinstance(error, Exception) else []  # else a signal, or the exit
        self.end("; ".join([*reasons, *notes]) or (str(error) if error is not None else ""))

    def pressed(self) -> str | None:
        """Reason to stop, for ``SafeLink(stop_requested=...)``; None while not pressed."""
        if self._calls % _LOOK_EVERY == 0:
            fault = self._fault()
            if fault is not None:
                return fault
        self._calls += 1
        if not self._reads_pressed():
            return None
        return f"stop requested by {_read_text(self._map, _REQUESTER) or 'an operator'}"

    def _reads_pressed(self) -> bool:
        if not _HAS_LOCKS:  # Windows cannot truncate a mapped file
            return bool(self._map[_PRESSED_BYTE])
        return os.pread(self._file, 1, _PRESSED_BYTE) == b"\1"

    def _fault(self) -> str | None:
        """Fault of the file, or None."""
        info = os.fstat(self._file)
        if info.st_size < _BYTES:
            return f"{self.path}: the stop file was truncated: nobody could stop this run"
        try:
            is_same_file = os.path.samestat(info, os.stat(self.path, follow_symlinks=False))
        except OSError:
            is_same_file = False
        if not is_same_file:
            return f"{self.path}: the stop file was deleted or moved: nobody could stop this run"
        return None

    def report_end(self, how: str) -> None:
        """Report the end to programs that press the button; the first report counts."""
        if os.fstat(self._file).st_size >= _BYTES and not self._map[_ENDED_BYTE]:
            _write_text(self._map, _END, how)
            self._map[_ENDED_BYTE] = 1

    def end(self, how: str) -> None:
        """Remove the button, and report the end to waiting programs; safe to call twice."""
        if self._map.closed:
            return
        if _HAS_LOCKS:
            self.path.unlink(missing_ok=True)
        self.report_end(how)
        self._map.close()
        os.close(self._file)
        if not _HAS_LOCKS:  # Windows cannot delete a file that any program has open
            with suppress(OSError):
                self.path.unlink(missing_ok=True)


class PressedButton:
    """Another program's button, as a context manager.

    Raises:
        OSError: the file does not exist, or belongs to another user.

    """

    def __init__(self, path: Path) -> None:
        self._path = os.path.realpath(path)
        self._file = os.open(path, os.O_RDWR | _OPEN_FLAGS)
        try:
            info = os.fstat(self._file)
            if not (_is_own_file(info) or os.getuid() == 0) or info.st_size != _BYTES:
                raise PermissionError(
                    f"{path}: is not a stop button of this user; name a run of this user"
                )
            self._map = mmap.mmap(self._file, _BYTES)
            run_facts = _parsed_run(_read_text(self._map, _RUN))
            self.run = StoppableRun(**run_facts | {"ports": tuple(run_facts["ports"])})
            self.since_s = info.st_mtime
            """Time of day at which the button was made, s."""
        except BaseException:
            os.close(self._file)
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *raised: object) -> None:
        self.close()

    def close(self) -> None:
        """Release the button; a pressed button stays pressed."""
        self._map.close()
        os.close(self._file)

    @property
    def is_held(self) -> bool:
        """Whether its program still holds the button."""
        if not _HAS_LOCKS:
            return not self._map[_ENDED_BYTE]
        try:
            # shared: a second reader does not look like the holder
            fcntl.flock(self._file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
        fcntl.flock(self._file, fcntl.LOCK_UN)
        return False

    @property
    def process(self) -> int | None:
        """Its program as this container numbers it; None if it is hidden or has ended."""
        number = str(self.run.process)  # the number in the program's own container
        has_no_proc = not os.path.exists(PROC)
        if has_no_proc or self._path in open_files(number):
            return self.run.process
        return next(map(int, lockers_of(self._path)), None)

    @property
    def end(self) -> str | None:
        """How the run ended; None before."""
        return _read_text(self._map, _END) if self._map[_ENDED_BYTE] else None

    def press(self, sender: str) -> None:
        """Make the run's safe link switch torque off and latch, at its next read or write."""
        _write_text(self._map, _REQUESTER, sender)
        self._map[_PRESSED_BYTE] = 1


def resolved(port: str) -> str:
    """Canonical name of a port: the real path of a device; a URL unchanged."""
    return port if is_url(port) else os.path.realpath(port)


def button_folder() -> Path:
    """Return the folder for a new button; create it if necessary.

    Raises:
        InputError: no folder of ``button_folders`` is private, or can be made.

    """
    faults = []
    for folder in button_folders():
        try:
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            if _is_private(folder):
                return folder
        except OSError as error:
            faults.append(_cannot_be_made(folder, error))
        else:
            faults.append(
                f"{folder}: must be a folder of this user, which nobody else may write to; stop "
                "buttons are in it (XDG_RUNTIME_DIR says where)"
            )
    raise InputError(faults)


def button_folders() -> list[Path]:
    """Return the folders in which buttons of this user may be, the preferred one first.

    A login, a cron job and a service have different environments, so a stop looks in all of them.
    The last one, in the user's home, is for the case that another user has made the one before.
    """
    runtime = os.environ.get("XDG_RUNTIME_DIR") or f"/run/user/{_user()}"
    folders = [Path(runtime) / "snakewalk"] if os.path.isdir(runtime) else []
    folders.append(Path(os.environ.get("TMPDIR") or _TEMPORARY) / f"snakewalk-{_user()}")
    with suppress(RuntimeError):  # a user without a home
        folders.append(Path.home() / ".cache" / "snakewalk" / "stop")
    return folders


def stoppable_runs() -> Iterator[PressedButton]:
    """Yield the open buttons of this user's running programs, newest first.

    Files of killed programs are deleted.
    """
    buttons = []
    for folder in button_folders():
        if not _is_private(folder):
            continue
        for path in folder.glob(f"*{BUTTON_SUFFIX}"):
            with suppress(OSError, ValueError, TypeError, KeyError):  # just removed, or no button
                button = PressedButton(path)
                if button.is_held:
                    buttons.append(button)
                else:
                    path.unlink(missing_ok=True)
                    button.close()
    yield from sorted(buttons, key=lambda button: button.since_s, reverse=True)


def _is_private(folder: Path) -> bool:
    """Whether a folder exists, and only this user may write to it."""
    try:
        info = folder.lstat()
    except OSError:
        return False
    others_write = _HAS_LOCKS and info.st_mode & 0o022
    return stat.S_ISDIR(info.st_mode) and _is_own_file(info) and not others_write


def _new_file(folder: Path, suffix: str) -> tuple[int, Path]:
    """Create a file with a new name that only this user may open."""
    path = folder / f"{os.getpid()}-{os.urandom(4).hex()}{suffix}"
    return os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL | _OPEN_FLAGS, 0o600), path


def _parsed_run(text: str) -> dict[str, Any]:
    """Parse the description of a run.

    Raises:
        ValueError: it is damaged.

    """
    try:
        facts = json.loads(text)
    except RecursionError:
        raise ValueError("too many brackets") from None
    if not isinstance(facts, dict):
        raise ValueError("no description of a run")
    return facts


def _refuse_used_urls(ports: Iterable[str]) -> None:
    urls = {port for port in ports if is_url(port)}
    for button in stoppable_runs() if urls else ():
        with button:
            for url in urls & set(button.run.ports):
                raise InputError(
                    f"{url}: the run {button.run.name} (process {button.run.process}) is on it; "
                    f"stop it by: snakewalk stop --port {url}"
                )


def _cannot_be_made(place: Path, error: OSError) -> str:
    return (
        f"{place}: stop buttons cannot be made: {error.strerror}; name another folder by "
        "XDG_RUNTIME_DIR"
    )


def _is_own_file(info: os.stat_result) -> bool:
    """Whether a file is this user's; on Windows its folder decides."""
    return not _HAS_LOCKS or info.st_uid == os.getuid()


def _user() -> str:
    return str(os.getuid()) if _HAS_LOCKS else os.environ.get("USERNAME", "user")


def _write_text(place: mmap.mmap, where: slice, text: str) -> None:
    room = where.stop - where.start - 2
    data = text.encode()[:room].decode(errors="ignore").encode()
    place[where.start : where.start + 2 + len(data)] = len(data).to_bytes(2, "little") + data


def _read_text(place: mmap.mmap, where: slice) -> str:
    length = min(int.from_bytes(place[where.start : where.start + 2], "little"), where.stop)
    return place[where.start + 2 : where.start + 2 + length].decode(errors="replace")
