"""Programs that have a serial device open, found by the device itself."""

import os
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from typing import Final

_OWN: Final = "snakewalk"
"""Name of the program."""
_MASTERS: Final = ("/dev/ptmx", "/dev/pts/ptmx")
"""Other ends of pseudo-terminals."""


@dataclass(frozen=True, slots=True)
class PortHolder:
    """A program that has a port open."""

    process: int
    program: str
    """Name: snakewalk with its command line, Python with its script or module."""
    files: tuple[str, ...]
    """Paths of its open files."""

    @property
    def is_ours(self) -> bool:
        """Whether it is a snakewalk command."""
        return self.program.startswith(f"{_OWN} ")

    @property
    def has_other_end(self) -> bool:
        """Whether it has other ends of pseudo-terminals: a served bus, not a user of the port."""
        return any(master in self.files for master in _MASTERS)


def holders_of(device: str) -> list[PortHolder]:
    """Return the programs that have a device open; those of other users are hidden."""
    path = os.path.realpath(device)
    found = []
    for process in sorted(filter(str.isdigit, _listed("/proc")), key=int):
        files = tuple(_open_files(process))
        if path in files:
            with suppress(OSError):  # just ended
                found.append(PortHolder(int(process), _program(process), files))
    return found


def _listed(folder: str) -> list[str]:
    try:
        return os.listdir(folder)
    except OSError:  # another user's, or just ended; or not Linux
        return []


def _open_files(process: str) -> Iterator[str]:
    folder = f"/proc/{process}/fd"
    for each in _listed(folder):
        with suppress(OSError):  # closed just now, like the listing's own
            yield os.readlink(f"{folder}/{each}")


def _program(process: str) -> str:
    with open(f"/proc/{process}/cmdline", encoding="utf-8", errors="replace") as file:
        words = file.read().rstrip("\0").split("\0")
    names = [os.path.basename(word) for word in words[:2]]
    if _OWN in names:
        return " ".join([_OWN, *words[names.index(_OWN) + 1 :]])
    with open(f"/proc/{process}/comm", encoding="utf-8", errors="replace") as file:
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
