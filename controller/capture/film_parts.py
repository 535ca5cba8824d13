"""Long films in parts: each part is captured alone, so memory holds the pictures of one part.

A part ends after ``PART_FRAMES`` frames, where the body is seen well. Finished parts are kept in a
folder next to the result, and an interrupted capture continues after them.
"""

import json
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, fields, replace
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import numpy as np

from snakewalk.config.archive import parse_json, read_arrays
from snakewalk.config.arrays import DeepImage, Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.capture.capture import Capture, captured_from
from snakewalk.controller.capture.detections import Detections
from snakewalk.controller.capture.identity import margin_of, margins
from snakewalk.controller.console.result_files import atomic_write
from snakewalk.controller.images.body_detector import Detection
from snakewalk.controller.images.medial_axis import Skeleton
from snakewalk.controller.track.frame_status import FrameStatus

PART_FRAMES: Final = 1000
"""Frames of a part (ours)."""
_LONGEST_PART: Final = 1500
_CALM: Final = 5  # good frames before the end of a part
_EVIDENCE: Final = ("given", "travel", "wave", "taper")
_SETTINGS: Final = "settings.json"


@dataclass(slots=True)
class FilmParts:
    """One animal of a film, captured part by part."""

    rate_hz: float
    count: int
    """Frames that the film should have."""
    name: str
    head_px: tuple[float, float] | None = None
    fixed: bool = True
    folder: "PartFolder | None" = None
    """Where finished parts are kept; None: in memory only."""
    part_frames: int = PART_FRAMES
    finished: list[Capture] = field(default_factory=list)
    _found: Detections = field(default_factory=Detections)
    _done: int = 0

    def __post_init__(self) -> None:
        """Count the frames of parts that were finished before."""
        self._done = sum(len(one.status) for one in self.finished)

    @property
    def done_frames(self) -> int:
        """Frames so far."""
        return self._done

    def add(self, frame: DeepImage, detection: Detection, at_s: float = float("nan")) -> None:
        """Add the next frame; ``at_s`` is the time that the film states."""
        self._found.add(frame, detection)
        self._counted(at_s)

    def skip(self, status: FrameStatus) -> None:
        """Add a frame in which the animal is not searched for."""
        self._found.skip(status)
        self._counted(float("nan"))

    def _counted(self, at_s: float) -> None:
        self._found.stated_s.append(at_s)
        self._done += 1
        bodies = self._found.skeletons
        if len(bodies) < self.part_frames or self.count - self._done < self.part_frames // 2:
            return
        calm = all(one.status is FrameStatus.GOOD for one in bodies[-_CALM:])
        if calm or len(bodies) >= max(_LONGEST_PART, 2 * self.part_frames):
            self._finish()

    def _finish(self) -> None:
        found = self._found
        part = captured_from(
            found, self.rate_hz, name=self.name, head_px=self._head(), fixed=self.fixed, part=True
        )
        part = replace(part, time_s=np.array(found.stated_s))
        if self.folder is not None:
            self.folder.add(len(self.finished), part)
        self.finished.append(part)
        self._found = Detections()

    def _head(self) -> tuple[float, float] | None:
        """The given place of the head, in the first part with a body only."""
        seen = any(one.used.any() for one in self.finished)
        return None if seen else self.head_px

    def done(self) -> tuple[Capture, list[float]]:
        """Capture of all frames, and their times as the film states them.

        Raises:
            InputError: fewer than 2 frames can be used, or nothing moves.

        """
        if not self.finished:
            only = captured_from(
                self._found, self.rate_hz, name=self.name, head_px=self.head_px, fixed=self.fixed
            )
            return only, self._found.stated_s
        if self._found.skeletons:
            self._finish()
        stated_s = np.concatenate([one.time_s for one in self.finished]).tolist()
        return joined(self.finished, self.rate_hz, self.name), stated_s


def joined(parts: Sequence[Capture], rate_hz: float, name: str) -> Capture:
    """Join consecutive parts of a film; the same end is first in all.

    Raises:
        InputError: fewer than 2 frames are used.

    """
    sign = _signs(parts)
    score, by = _head_of(parts, sign)
    turned = [
        _reversed(one) if s * score < 0.0 else one for one, s in zip(parts, sign, strict=True)
    ]
    status = tuple(one for part in turned for one in part.status)
    arrays: dict[str, Any] = {
        each: np.concatenate([getattr(one, each) for one in turned])
        for each in ("points_px", "radius_px", "length_px", "expected_px", "distractors")
    }
    whole = replace(
        turned[0],
        **arrays,
        status=status,
        time_s=np.arange(len(status)) / rate_hz,
        head_by=by,
        head_sure=min(1.0, abs(score)),
    )
    if whole.used.sum() < 2:
        raise InputError(f"{name}: the body is never seen whole; look at --sheet")
    return replace(whole, margin=margins(_skeletons(whole)))


def _skeletons(captured: Capture) -> list[Skeleton]:
    each = (captured.points_px, captured.radius_px, captured.length_px.tolist(), captured.status)
    return [Skeleton(*one) for one in zip(*each, strict=True)]


def _end(captured: Capture, *, last: bool) -> Skeleton:
    k = np.flatnonzero(captured.used)[-1 if last else 0]
    length = float(captured.length_px[k])
    return Skeleton(captured.points_px[k], captured.radius_px[k], length, captured.status[k])


def _signs(parts: Sequence[Capture]) -> list[int]:
    """-1 for parts that have the other end first than the first part with a body."""
    out = [1] * len(parts)
    seen = [k for k, one in enumerate(parts) if one.used.any()]
    for old, new in pairwise(seen):
        margin = margin_of(_end(parts[new], last=False), _end(parts[old], last=True))
        out[new] = -out[old] if margin < 0.0 else out[old]
    return out


def _head_of(parts: Sequence[Capture], sign: Sequence[int]) -> tuple[float, str]:
    """Whether the first end of the first part is the head: the best evidence of all parts."""
    for kind in _EVIDENCE:
        some = [
            (s * one.head_sure, int(one.used.sum()))
            for one, s in zip(parts, sign, strict=True)
            if one.head_by == kind and one.used.any()
        ]
        total = sum(count for _, count in some)
        if total:
            return sum(score * count for score, count in some) / total, kind
    return 0.0, _EVIDENCE[-1]


def _reversed(one: Capture) -> Capture:
    return replace(
        one, points_px=one.points_px[:, ::-1].copy(), radius_px=one.radius_px[:, ::-1].copy()
    )


@dataclass(frozen=True, slots=True)
class PartFolder:
    """Finished parts of an interrupted capture."""

    path: Path
    settings: dict[str, Any]
    """The film and the options on which the parts depend."""
    parent: "PartFolder | None" = None
    """The folder of a film of several animals, each of which has a folder there."""

    def start(self, *, resume: bool, force: bool) -> list[Capture]:
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
            before = parse_json((self.path / _SETTINGS).read_text(encoding="utf-8"))
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

    def parts(self) -> list[Capture]:
        """Return the finished parts.

        Raises:
            InputError: a part is damaged.

        """
        return [_read_part(file) for file in sorted(self.path.glob("*.npz"))]

    def add(self, number: int, part: Capture) -> None:
        """Keep a finished part."""
        if number == 0:
            self._begin()
        values = {one.name: getattr(part, one.name) for one in fields(part)}
        values["status"] = np.array([str(one) for one in part.status])
        with atomic_write(self.path / f"{number:05d}.npz") as file, file.open("wb") as stream:
            np.savez(stream, **values)

    def _begin(self) -> None:
        """Create the folder."""
        if self.parent is not None:
            self.parent._begin()
        self.path.mkdir(exist_ok=True)
        with atomic_write(self.path / _SETTINGS) as file:
            file.write_text(json.dumps(self.settings), encoding="utf-8")

    def of_animal(self, number: int) -> "PartFolder":
        """Return the folder of one of several animals."""
        return PartFolder(self.path / f"animal-{number}", self.settings, self)

    @contextmanager
    def kept_if_interrupted(self) -> Iterator[None]:
        """Add to an interruption how to continue."""
        try:
            yield
        except KeyboardInterrupt as stop:
            if self.path.is_dir():
                stop.add_note(f"{self.path}: holds the frames so far; continue by --resume")
            raise

    def clear(self) -> None:
        """Delete the parts."""
        if self.path.is_dir():
            shutil.rmtree(self.path)


def _read_part(file: Path) -> Capture:
    try:
        held, _ = read_arrays(file)
        arrays: dict[str, Floats] = {
            one.name: np.asarray(held[one.name], dtype=float)
            for one in fields(Capture)
            if one.type in {Floats, "Floats"}
        }
        return Capture(
            **arrays,
            status=tuple(FrameStatus(str(one)) for one in held["status"]),
            rate_hz=float(held["rate_hz"]),
            head_by=str(held["head_by"]),
            head_sure=float(held["head_sure"]),
            places_recorded=bool(held["places_recorded"]),
        )
    except (OSError, ValueError, KeyError):
        raise InputError(f"{file}: is damaged; start again with --force") from None
