"""A person's corrections of a captured recording: heads flipped, frames left out or redrawn.

The page of ``snakewalk animal capture --review`` writes them as JSON; ``apply_corrections`` applies
them. The file names its track by a fingerprint.
"""

from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
from pydantic import Field

from snakewalk.config.archive import read_json_object
from snakewalk.config.arrays import Floats
from snakewalk.config.base import Strict
from snakewalk.config.errors import InputError
from snakewalk.config.loader import checked
from snakewalk.controller.capture.capture import CaptureFile
from snakewalk.controller.capture.staged_film import arrays_of
from snakewalk.controller.images.medial_axis import SEGMENTS, Skeleton, in_equal_chords, no_skeleton
from snakewalk.controller.track.frame_status import FrameStatus

_LONGEST_LINE = 4.0
"""Longest line, as a multiple of the film's usual length (ours)."""


class RedrawnFrame(Strict):
    """One frame whose points a person has drawn."""

    frame: int = Field(ge=0, description="number of the frame")
    points_px: tuple[tuple[float, float], ...] = Field(
        min_length=4,
        max_length=10_000,
        description="points along the midline in pixels, head first",
    )
    """Points in the picture as x, y, head first, y downwards."""


class Corrections(Strict):
    """Corrections by the user; frames count from 0."""

    track: str = Field(description="file of the track that is corrected")
    """Fingerprint of the reviewed track (``CaptureFile.fingerprint``)."""
    frames: int = Field(ge=1, description="number of frames of the track")
    """Number of frames of that track."""
    flipped: tuple[int, ...] = Field((), description="frames in which head and tail are exchanged")
    """Frames whose head is at the other end."""
    left_out: tuple[int, ...] = Field((), description="frames that are not used")
    """Unused frames."""
    redrawn: tuple[RedrawnFrame, ...] = Field(
        (), description="frames whose points a person has drawn"
    )
    """Frames with points of their own, head first even if ``flipped``."""


def read_corrections(path: Path) -> Corrections:
    """Read a file that the page of a review has saved.

    Raises:
        InputError: the file is missing or invalid.

    """
    data = read_json_object(path, "the corrections that a review page saves, a JSON object")
    return checked(Corrections, data, str(path))


def _check_frames(corrections: Corrections, count: int, name: str) -> None:
    redrawn = [redrawn_body.frame for redrawn_body in corrections.redrawn]
    lists = {"flipped": corrections.flipped, "left_out": corrections.left_out, "redrawn": redrawn}
    for key, frames in lists.items():
        beyond = [k for k in frames if not 0 <= k < count]
        if beyond:
            raise InputError(
                f"{name}: frame {min(beyond)} is not there: the track has {count}, from 0; "
                "delete it"
            )
        twice = [k for k, times in Counter(frames).items() if times > 1]
        if twice:
            raise InputError(f"{name}: {key}: frame {twice[0]} is listed twice; delete one")


def apply_corrections(file: CaptureFile, corrections: Corrections, name: str) -> CaptureFile:
    """Return the recording with corrections; frames left out override all others.

    Args:
        file: as it was captured.
        corrections: of this recording.
        name: of the corrections, for errors.

    Raises:
        InputError: corrections of another track or applied already; a missing frame; a line that
            cannot be a body; fewer than two frames left.

    """
    captured = file.captured
    count = len(captured.status)
    if corrections.track != file.fingerprint or corrections.frames != count:
        raise InputError(
            f"{name}: these corrections belong to another track than {file.name}, or were applied "
            "to it already; give the track of which the page was made"
        )
    _check_frames(corrections, count, name)
    drawn = {redrawn.frame: redrawn for redrawn in corrections.redrawn}
    usual_px = float(np.nanmedian(captured.length_px))
    usual_radius = np.nanmedian(captured.radius_px, axis=0)
    flipped = set(corrections.flipped)
    left_out = set(corrections.left_out)
    expected = captured.expected_px.copy()
    skeletons: list[Skeleton] = []
    for k in range(count):
        before = captured.skeleton(k)
        if k in left_out:
            after = no_skeleton(FrameStatus.LEFT_OUT)
        elif k in drawn:
            after = _redrawn(f"{name}: frame {k}", drawn[k], usual_px, usual_radius)
        else:
            after = before.reversed() if k in flipped else before
        if k in left_out or k in drawn:
            expected[k] = np.nan
        skeletons.append(after)
    arrays = arrays_of(skeletons)
    if np.isfinite(arrays["length_px"]).sum() < 2:
        raise InputError(f"{name}: fewer than 2 frames with points stay; leave fewer out")
    corrected = replace(
        captured,
        **arrays,
        expected_px=expected,
        head_by="given" if flipped else captured.head_by,
        head_sure=1.0 if flipped else captured.head_sure,
    )
    source_text = (
        f"; corrected by a person: {len(flipped)} frames flipped, {len(left_out)} left out, "
        f"{len(drawn)} redrawn"
    )
    return replace(file, captured=corrected, source=file.source + source_text)


def _redrawn(where: str, drawn: RedrawnFrame, usual_px: float, radius_px: Floats) -> Skeleton:
    """The drawn line at equal chords, with the usual thickness."""
    line = np.array(drawn.points_px, dtype=float)
    length = float(np.hypot(*np.diff(line, axis=0).T).sum())
    if not 1.0 < length < _LONGEST_LINE * usual_px:
        raise InputError(
            f"{where}: the line is {length:.1f} px long, the body usually {usual_px:.1f} px; "
            "redraw it"
        )
    body = in_equal_chords(line, radius_px)
    if body is None:
        raise InputError(
            f"{where}: the line cannot be divided into {SEGMENTS} equal chords; it is folded upon "
            "itself; redraw it"
        )
    return replace(body, status=FrameStatus.BY_HAND)
