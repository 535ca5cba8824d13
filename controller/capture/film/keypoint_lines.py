"""Keypoints of another program, such as SLEAP or DeepLabCut, as the bodies of a film.

The outline in the picture confirms a line: their distance is its expected error.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.reading import with_stored
from snakewalk.controller.capture.identity import margin_of
from snakewalk.controller.images.body_detector import Detection
from snakewalk.controller.images.medial_axis import (
    SEGMENTS,
    Skeleton,
    in_equal_chords,
    no_skeleton,
)
from snakewalk.controller.track.choice import ALL
from snakewalk.controller.track.frame_status import FrameStatus
from snakewalk.controller.track.readers.load import load_keypoints
from snakewalk.controller.track.resample import equal_arc_length

_UNCONFIRMED = 0.02  # of the length: error of a line without an outline to compare with (ours)
_SAME_BODY = 0.1  # of the length: an outline farther away is that of something else (ours)
_RADIUS = 1.0 / 30.0  # of the length, until an outline shows the widths (ours)


@dataclass(slots=True)
class KeypointLines:
    """Lines through the keypoints of an animal."""

    bodies: dict[int, Skeleton]
    """By frame."""
    radius_px: Floats
    """(101,) of the last outline."""

    @classmethod
    def of(cls, file: Path, origin_px: tuple[float, float]) -> "KeypointLines":
        """Read a file of keypoints of the complete pictures, with the answers stored for it.

        Raises:
            InputError: as ``load_keypoints``, or no frame has a line.

        """
        choice, _ = with_stored(file, ALL)
        keypoints = load_keypoints(file, choice)
        places, _ = keypoints.midline(choice)
        numbers = np.arange(len(places)) if keypoints.frame is None else keypoints.frame
        bodies = {}
        for number, points in zip(numbers.tolist(), places * [1.0, -1.0] - origin_px, strict=True):
            try:
                line = equal_arc_length(points)
            except ValueError:  # missing points, or several in one place
                continue
            body = in_equal_chords(line, np.zeros(SEGMENTS + 1))
            if body is not None:
                bodies[number] = body
        if not bodies:
            raise InputError(
                f"{file}: no frame has a line through its keypoints; list those that are seen as "
                f"`keypoints = [...]` in {file.name}.reading.toml, or leave --keypoints out"
            )
        length_px = float(np.median([body.length_px for body in bodies.values()]))
        return cls(bodies, np.full(SEGMENTS + 1, _RADIUS * length_px))

    def placed(self, detection: Detection, number: int) -> Detection:
        """Return the detection of a frame with the line through its keypoints."""
        body = self.bodies.get(number)
        if body is None:
            return replace(detection, skeleton=no_skeleton(FrameStatus.MISSING))
        error_px = _UNCONFIRMED * body.length_px
        outline = detection.skeleton
        if outline.status is FrameStatus.GOOD:
            if margin_of(outline, body) < 0.0:
                outline = outline.reversed()
            error_px = float(np.hypot(*(outline.points_px - body.points_px).T).mean())
            if error_px < _SAME_BODY * body.length_px:
                self.radius_px = outline.radius_px
        line = replace(body, radius_px=self.radius_px)
        return replace(detection, skeleton=line, line_error_px=error_px)
