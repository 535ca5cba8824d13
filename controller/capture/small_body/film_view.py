"""A frame on the working grid of a film: what is fitted of it, and where the fit starts."""

from dataclasses import dataclass

import cv2
import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.capture.small_body.crop import Crop, Workspace
from snakewalk.controller.capture.small_body.ribbon import BENDS, bend_basis

_REACH = 6.0  # working pixels beside the body that are fitted


@dataclass(frozen=True, slots=True)
class View:
    """The neighbourhood of one body."""

    picture: Floats
    """(h, w) contrast, above 0 where the body is."""
    use: Floats
    """(h, w) 1 near the body."""
    first: tuple[int, int]
    """x, y of the first pixel on the working grid."""
    start: Floats
    """(FRAME,) a first guess; places relative to the first pixel."""

    @classmethod
    def of(cls, seen: Crop, points_px: Floats, radius_px: float, space: Workspace) -> "View":
        """View a frame whose body lies about along ``points_px`` (P, 2)."""
        picture, first = space.contrast(seen)
        line = space.from_px(points_px) - first
        paper = np.full(picture.shape, 255, dtype=np.uint8)
        drawn = np.rint(line * 16.0).astype(np.int32)
        cv2.polylines(paper, [drawn], False, 0, 1, cv2.LINE_8, 4)
        reach = _REACH + 1.5 * radius_px * space.scale
        use = np.asarray(cv2.distanceTransform(paper, cv2.DIST_L2, 5)) <= reach
        rows, columns = np.flatnonzero(use.any(axis=1)), np.flatnonzero(use.any(axis=0))
        window = (slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1))
        corner = np.array([columns[0], rows[0]])
        # blur dims a thin body: its own contrast is between what is seen and that of black
        peak = max(float(np.percentile(picture[use], 95.0)), 4.0)
        contrast = float(np.sqrt(peak * max(peak, float(np.median(seen.ground)))))
        middle = 0.5 * (line[1:] + line[:-1]).mean(axis=0) - corner
        return cls(
            np.ascontiguousarray(picture[window]),
            use[window].astype(float),
            (first[0] + int(corner[0]), first[1] + int(corner[1])),
            np.concatenate([middle, bends_of(line), [contrast], np.zeros(3)]),
        )


def bends_of(line: Floats) -> Floats:
    """(BENDS,) of a line (P, 2), head first, of equal steps."""
    step = -np.diff(line, axis=0)
    angle = np.unwrap(np.arctan2(step[:, 1], step[:, 0]))
    at = (np.arange(len(angle)) + 0.5) / len(angle)
    return np.asarray(np.linalg.lstsq(bend_basis(at), angle, rcond=None)[0])


def turned_round(frame: Floats) -> Floats:
    """The same place with the other end first."""
    other = frame.copy()
    other[2 : 2 + BENDS] = frame[2 : 2 + BENDS][::-1] + np.pi
    return other
