"""Programs that have a serial device open, found by the device itself."""

import os
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass

try:
    import pwd
except ImportError:  # Windows has no /proc either
    pwd = None  # type: ignore[assignment]

PROC = "/proc"
"""Folder with the processes and locks of all users on Linux."""
_PROGRAM_NAME = "snakewalk"
"""Name of this program."""
_MASTERS = ("/dev/ptmx", "/dev/pts/ptmx")
"""Devices of the other ends of pseudo-terminals."""


@dataclass(frozen=True, slots=True)
class PortHolder:
    """A program that has a port open."""

    process: int
    program: str
    """Name: snakewalk with its command line, Python with its script or module."""
    user: str
    """Name of the user of the program."""
    files: tuple[str, ...]
    """Paths of the program's open files; none if they are hidden, as other users' files are."""

    def __str__(self) -> str:
        """Return program, process and, if it is another one, the user."""
        other = "" if self.user == _user_name(os.getuid()) else f" of user {self.user}"
        return f"{self.program} (process {self.process}{other})"

    @property
    def is_snakewalk(self) -> bool:
        """Whether the program is a snakewalk command."""
        return self.program.startswith(f"{_PROGRAM_NAME} ")

    @property
    def has_other_end(self) -> bool:
        """Whether it has other ends of pseudo-terminals: a served bus, not a user of the port."""
        return any(master in self.files for master in _MASTERS)


def holders_of(device: str) -> list[PortHolder]:
    """Return the programs that have a device open.

    Open files of another user's programs are hidden; those that lock the device are found by the
    lock. Programs of another container, and outside of this one, are hidden.
    """
    path = os.path.realpath(device)
    lockers = lockers_of(path)
    holders = []
    for process in sorted(filter(str.isdigit, _entries(PROC)), key=int):
        files = tuple(open_files(process))
        if path in files or process in lockers:
            with suppress(OSError):  # just ended
                user = _user_name(os.stat(f"{PROC}/{process}").st_uid)
                holders.append(PortHolder(int(process), _program(process), user, files))
    return holders


def lockers_of(path: str) -> set[str]:
    """Return the processes that lock a file; every user may see them."""
    with suppress(OSError):
        info = os.stat(path)
        major = os.major(info.st_dev)
        name = f"{major:02x}:{os.minor(info.st_dev):02x}:{info.st_ino}"
        with open(f"{PROC}/locks", encoding="ascii") as file:
            locks = [line.split() for line in file]
        return {lock[-4] for lock in locks if lock[-3] == name}
    return set()


def _user_name(user: int) -> str:
    with suppress(KeyError):
        return pwd.getpwuid(user).pw_name
    return str(user)


def _entries(folder: str) -> list[str]:
    try:
        return os.listdir(folder)
    except OSError:  # another user's, or just ended; or not Linux
        return []


def open_files(process: str) -> Iterator[str]:
    """Yield the paths of a process's open files; none if it is hidden."""
    folder = f"{PROC}/{process}/fd"
    for entry in _entries(folder):
        with suppress(OSError):  # closed just now, like the listing's own
            yield os.readlink(f"{folder}/{entry}")


def _program(process: str) -> str:
    with open(f"{PROC}/{process}/cmdline", encoding="utf-8", errors="replace") as file:
        words = file.read().rstrip("\0").split("\0")
    names = [os.path.basename(word) for word in words[:2]]
    if _PROGRAM_NAME in names:
        return " ".join([_PROGRAM_NAME, *words[names.index(_PROGRAM_NAME) + 1 :]])
    with open(f"{PROC}/{process}/comm", encoding="utf-8", errors="replace") as file:
        name = file.read().strip()
    return " ".join([name, *_script(words[1:])]) if name.startswith("python") else name


def _script(words: list[str]) -> list[str]:
    rest = iter(words)
    for word in rest:
        if word == "-m":
            return [word, *list(rest)[:1]]
        if not word.startswith("-"):
            return [os.path.basename(word)]
        if word == "-c":
            break
        if word in ("-W", "-X"):  # the next word is its value
            next(rest, None)
    return []
