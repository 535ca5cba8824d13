"""The form of a line: bends and loops that are impossible at its width."""

import numpy as np
from scipy.ndimage import gaussian_filter1d

from snakewalk.config.arrays import Floats, Ints
from snakewalk.controller.images.medial_axis import Skeleton
from snakewalk.controller.track.frame_status import FrameStatus

_SMOOTH = 1.5  # chords
_TIGHTEST = 2.3  # rad over one width of the body; at half a width of radius it is 2
_SMALL_LOOP = 3.0  # widths along the body: a loop around nothing has pi of them


def possible_form(body: Skeleton) -> bool:
    """Whether no bend is tighter than half a width, and no loop smaller than the width.

    A body that is not known to lie on itself has no loop at all.
    """
    points = body.points_px
    wide = 2.0 * float(np.median(body.radius_px))
    step = np.diff(points, axis=0)
    chord = float(np.hypot(*step.T).mean())
    angle = gaussian_filter1d(np.unwrap(np.arctan2(step[:, 1], step[:, 0])), _SMOOTH)
    apart = max(1, round(wide / chord))
    if apart < len(angle):
        turn = np.abs(angle[apart:] - angle[:-apart])
        if float(turn.max()) > _TIGHTEST * max(1.0, apart * chord / wide):
            return False
    loops = crossings(points)
    if not len(loops):
        return True
    if body.status is not FrameStatus.COIL:
        return False
    return bool((np.abs(loops[:, 1] - loops[:, 0]) * chord >= _SMALL_LOOP * wide).all())


def crossings(points: Floats) -> Ints:
    """(K, 2) numbers of the chords of a line (P, 2) that cross each other."""
    step = np.diff(points, axis=0)
    first = points[:-1]
    apart = first[None] - first[:, None]
    across = step[:, None, 0] * step[None, :, 1] - step[:, None, 1] * step[None, :, 0]
    safe = np.where(np.abs(across) < 1e-12, np.inf, across)
    one = (apart[..., 0] * step[None, :, 1] - apart[..., 1] * step[None, :, 0]) / safe
    other = (apart[..., 0] * step[:, None, 1] - apart[..., 1] * step[:, None, 0]) / safe
    number = np.arange(len(step))
    far = number[None] - number[:, None] > 1
    hit = far & (one > 0.0) & (one < 1.0) & (other > 0.0) & (other < 1.0)
    return np.asarray(np.argwhere(hit), dtype=np.int64)
