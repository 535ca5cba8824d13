"""Finished parts of a long film: in a folder next to the result, or in memory."""

import json
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from snakewalk.config.archive import MOST_JSON_BYTES, parse_json, read_bytes
from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.capture.capture import (
    Capture,
    CaptureFile,
    load_capture,
    save_capture,
)
from snakewalk.controller.console.result_files import atomic_write, write_result
from snakewalk.controller.images.medial_axis import Skeleton

_SETTINGS = "settings.json"


@dataclass(frozen=True, slots=True)
class FinishedPart:
    """Summary of a finished part of a film, kept in memory."""

    frames: int
    used: int
    """Frames with points."""
    head_by: str
    head_sure: float
    first: Skeleton | None
    """First body; None in a part without a body."""
    last: Skeleton | None
    time_s: Floats
    """(T,) times of the frames, as the film states them."""
    content: Capture | Path
    """Content of the part, or its file."""

    @classmethod
    def of(cls, part: Capture, file: Path | None = None) -> "FinishedPart":
        """Summarise a part; without a file, its content stays in memory."""
        numbers = np.flatnonzero(part.used).tolist()
        ends = [part.skeleton(k) for k in (numbers[0], numbers[-1])] if numbers else [None, None]
        return cls(
            len(part.status),
            len(numbers),
            part.head_by,
            part.head_sure,
            ends[0],
            ends[1],
            part.time_s,
            part if file is None else file,
        )

    def read(self) -> Capture:
        """Return the part.

        Raises:
            InputError: its file is damaged.

        """
        return self.content if isinstance(self.content, Capture) else _read_part(self.content)


@dataclass(frozen=True, slots=True)
class PartFolder:
    """Finished parts of an interrupted capture."""

    path: Path
    settings: dict[str, Any]
    """Film and options on which the parts depend."""
    parent: "PartFolder | None" = None
    """Folder of a film of several animals, which contains a folder for each animal."""

    def start(self, *, resume: bool, force: bool) -> list[FinishedPart]:
        """Return the finished parts; none of a new capture.

        Raises:
            InputError: the folder holds parts and neither ``resume`` nor ``force`` is given; or
                there is nothing to continue, or it belongs to another capture.

        """
        if not resume:
            if self.path.exists() and not force:
                raise InputError(
                    f"{self.path}: holds an interrupted capture; continue it with --resume, or "
                    "start again with --force"
                )
            self.clear()
            return []
        try:
            before = parse_json(read_bytes(self.path / _SETTINGS, MOST_JSON_BYTES))
        except FileNotFoundError:
            raise InputError(
                f"{self.path}: no such folder, so there is nothing to continue; leave --resume out"
            ) from None
        except ValueError:
            raise InputError(f"{self.path}: is damaged; start again with --force") from None
        other = [key for key, value in self.settings.items() if before.get(key) != value]
        if other:
            raise InputError(
                f"{self.path}: its capture has other values of {', '.join(other)}; give the same, "
                "or start again with --force"
            )
        return self.parts()

    def parts(self) -> list[FinishedPart]:
        """Return the finished parts.

        Raises:
            InputError: a part is damaged.

        """
        files = sorted(self.path.glob("*.npz"))
        return [FinishedPart.of(_read_part(file), file) for file in files]

    def add(self, number: int, part: Capture) -> FinishedPart:
        """Keep a finished part."""
        if number == 0:
            self._begin()
        path = self.path / f"{number:05d}.npz"
        with atomic_write(path) as file:
            save_capture(file, CaptureFile(part, name=""))
        return FinishedPart.of(part, path)

    def _begin(self) -> None:
        """Create the folder."""
        if self.parent is not None:
            self.parent._begin()
        self.path.mkdir(exist_ok=True)
        write_result(self.path / _SETTINGS, json.dumps(self.settings))

    def of_animal(self, number: int) -> "PartFolder":
        """Return the folder of one of several animals."""
        return PartFolder(self.path / f"animal-{number}", self.settings, self)

    @contextmanager
    def kept_if_interrupted(self) -> Iterator[None]:
        """Add to an interruption how to continue."""
        try:
            yield
        except (KeyboardInterrupt, SystemExit) as stop:
            if self.path.is_dir():
                stop.add_note(f"{self.path}: holds the frames so far; continue by --resume")
            raise

    def clear(self) -> None:
        """Delete the parts."""
        if self.path.is_dir():
            shutil.rmtree(self.path)


def _read_part(file: Path) -> Capture:
    try:
        return load_capture(file).captured
    except InputError:
        raise InputError(f"{file}: is damaged; start again with --force") from None
