"""Long films in parts: each part is captured alone, so memory holds the pictures of one part.

A part ends after ``PART_FRAMES`` frames, where the body is seen well. Finished parts are kept in a
folder next to the result, and an interrupted capture continues after them.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from snakewalk.config.arrays import DeepImage
from snakewalk.controller.capture.capture import Capture, UnusableFilmError, captured_from
from snakewalk.controller.capture.detections import Detections
from snakewalk.controller.capture.identity import margin_of, margins
from snakewalk.controller.capture.image_file import large_array
from snakewalk.controller.capture.part_folder import FinishedPart, PartFolder
from snakewalk.controller.capture.staged_film import ROUGH
from snakewalk.controller.images.body_detector import Detection
from snakewalk.controller.images.medial_axis import Skeleton, no_skeleton
from snakewalk.controller.track.frame_status import FrameStatus

PART_FRAMES = 1000
"""Frames of a part (ours)."""
FEWEST_FRAMES = 20
"""Frames of a film; in a shorter one no frame is good, because no usual length is known."""
_LONGEST_PART = 1500
_CALM = 5  # good frames before the end of a part
_GIVEN_WEIGHT = 1e9  # weight of a part whose head the user has named
_SUREST = 0.9999
_ARRAYS = ("points_px", "radius_px", "length_px", "expected_px", "distractors")


@dataclass(slots=True)
class FilmParts:
    """One animal of a film, captured part by part."""

    rate_hz: float
    count: int
    """Frames that the film should have."""
    name: str
    head_px: tuple[float, float] | None = None
    fixed: bool = True
    folder: PartFolder | None = None
    """Folder of the finished parts; None: they stay in memory."""
    part_frames: int = PART_FRAMES
    finished: list[FinishedPart] = field(default_factory=list)
    _detections: Detections = field(default_factory=Detections)
    done_frames: int = 0
    """Frames so far."""

    def __post_init__(self) -> None:
        """Count the frames of parts that were finished before."""
        self.done_frames = sum(part.frames for part in self.finished)

    def add(self, frame: DeepImage, detection: Detection, at_s: float = float("nan")) -> None:
        """Add the next frame; ``at_s`` is the time that the film states."""
        self._detections.add(frame, detection)
        self._count_frames(at_s)

    def skip(self, status: FrameStatus) -> None:
        """Add a frame in which the animal is not searched for."""
        self._detections.skip(status)
        self._count_frames(float("nan"))

    def _count_frames(self, at_s: float) -> None:
        self._detections.stated_s.append(at_s)
        self.done_frames += 1
        bodies = self._detections.skeletons
        if len(bodies) < self.part_frames or self.count - self.done_frames < self.part_frames // 2:
            return
        calm = all(body.status is FrameStatus.GOOD for body in bodies[-_CALM:])
        if calm or len(bodies) >= max(_LONGEST_PART, 2 * self.part_frames):
            self._finish()

    def _finish(self) -> None:
        detections = self._detections
        part = replace(self._captured(part=True), time_s=np.array(detections.stated_s))
        number = len(self.finished)
        kept = FinishedPart.of(part) if self.folder is None else self.folder.add(number, part)
        self.finished.append(kept)
        self._detections = Detections()

    def _captured(self, *, part: bool) -> Capture:
        """Capture what was added; the place of the head belongs to the first part with a body."""
        has_bodies = any(finished.used for finished in self.finished)
        return captured_from(
            self._detections,
            self.rate_hz,
            name=self.name,
            head_px=None if has_bodies else self.head_px,
            fixed=self.fixed,
            part=part,
        )

    def done(self) -> Capture:
        """Capture of all frames.

        Raises:
            InputError: fewer than 2 frames can be used, or nothing moves.

        """
        if not self.finished:
            captured = self._captured(part=False)
            return captured if self.done_frames >= FEWEST_FRAMES else captured.roughened(ROUGH)
        if self._detections.skeletons:
            self._finish()
        folder = None if self.folder is None else self.folder.path
        return joined(self.finished, self.rate_hz, self.name, folder)


def joined(
    parts: Sequence[FinishedPart], rate_hz: float, name: str, folder: Path | None = None
) -> Capture:
    """Join consecutive parts of a film; the same end is first in all.

    Args:
        parts: of the film.
        rate_hz: frames a second.
        name: of the film, for faults.
        folder: where large arrays may lie: ``large_array``.

    Raises:
        InputError: fewer than 2 frames are used, or a part is damaged.

    """
    sign = _signs(parts)
    score, by = _head_of(parts, sign)
    if sum(film_part.used for film_part in parts) < 2:
        raise UnusableFilmError(
            name, [no_skeleton(one) for film_part in parts for one in film_part.read().status]
        )
    count = sum(film_part.frames for film_part in parts)
    arrays: dict[str, Any] = {}
    status: list[FrameStatus] = []
    for film_part, s in zip(parts, sign, strict=True):
        part = _reversed_capture(film_part.read()) if s * score < 0.0 else film_part.read()
        for array_name in _ARRAYS:
            values = getattr(part, array_name)
            if not status:
                arrays[array_name] = large_array((count, *values.shape[1:]), folder)
            arrays[array_name][len(status) : len(status) + film_part.frames] = values
        status += part.status
    bodies = map(
        Skeleton, arrays["points_px"], arrays["radius_px"], arrays["length_px"].tolist(), status
    )
    return replace(
        part,
        **arrays,
        status=tuple(status),
        margin=margins(bodies),
        time_s=np.arange(count) / rate_hz,
        head_by=by,
        head_sure=min(1.0, abs(score)),
    )


def _signs(parts: Sequence[FinishedPart]) -> list[int]:
    """-1 for parts that have the other end first than the first part with a body."""
    out = []
    sign = 1
    before: Skeleton | None = None
    for part in parts:
        if part.first is not None and before is not None and margin_of(part.first, before) < 0.0:
            sign = -sign
        before = before if part.last is None else part.last
        out.append(sign)
    return out


def _head_of(parts: Sequence[FinishedPart], sign: Sequence[int]) -> tuple[float, str]:
    """Whether the first end of the first part is the head: the mean log-odds of all parts."""
    weights = [part.used * (part.head_by != "given" or _GIVEN_WEIGHT) for part in parts]
    if not any(weights):
        return 0.0, "taper"
    likelihoods = [
        weight * s * float(np.arctanh(min(part.head_sure, _SUREST)))
        for weight, part, s in zip(weights, parts, sign, strict=True)
    ]
    strongest = int(np.argmax(np.abs(likelihoods)))
    return float(np.tanh(sum(likelihoods) / sum(weights))), parts[strongest].head_by


def _reversed_capture(capture: Capture) -> Capture:
    return replace(
        capture, points_px=capture.points_px[:, ::-1], radius_px=capture.radius_px[:, ::-1]
    )
