"""Finished parts of a long film: in a folder next to the result, or in memory."""

import json
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from snakewalk.config.archive import MOST_JSON_BYTES, parse_json, read_arrays, read_bytes
from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.capture.capture import Capture
from snakewalk.controller.console.result_files import atomic_write, write_result
from snakewalk.controller.images.medial_axis import Skeleton
from snakewalk.controller.track.frame_status import FrameStatus

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
        ends = [_skeleton(part, k) for k in (numbers[0], numbers[-1])] if numbers else [None, None]
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


def _skeleton(part: Capture, k: int) -> Skeleton:
    """Return the body of a frame, independent of the part's arrays."""
    points = part.points_px[k].copy()
    radius = part.radius_px[k].copy()
    return Skeleton(points, radius, float(part.length_px[k]), part.status[k])


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
        values = {field.name: getattr(part, field.name) for field in fields(part)}
        values["status"] = np.array([str(frame_status) for frame_status in part.status])
        path = self.path / f"{number:05d}.npz"
        with atomic_write(path) as file, file.open("wb") as stream:
            np.savez(stream, **values)
        return FinishedPart.of(part, path)

    @property
    def large_files(self) -> Path:
        """The folder of the result: its disk holds large arrays while they are computed."""
        return self.path.parent if self.parent is None else self.parent.large_files

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
        part_arrays, _ = read_arrays(file)
        arrays: dict[str, Floats] = {
            field.name: np.asarray(part_arrays[field.name], dtype=float)
            for field in fields(Capture)
            if field.type in {Floats, "Floats"}
        }
        return Capture(
            **arrays,
            status=tuple(FrameStatus(str(verdict)) for verdict in part_arrays["status"]),
            rate_hz=float(part_arrays["rate_hz"]),
            head_by=str(part_arrays["head_by"]),
            head_sure=float(part_arrays["head_sure"]),
            places_recorded=bool(part_arrays["places_recorded"]),
        )
    except (OSError, ValueError, KeyError):
        raise InputError(f"{file}: is damaged; start again with --force") from None
