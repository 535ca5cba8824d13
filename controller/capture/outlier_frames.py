"""Frames whose body is unlike that of the film's other frames: it lies on itself, or on another.

A coil that leaves no hole and a small animal that touches the body have no side branch. But they
make the body shorter, longer, locally thicker, or change its area, beside what frames usually do.
"""

from collections.abc import Sequence

import numpy as np
from scipy.ndimage import uniform_filter1d

from snakewalk.config.arrays import Floats
from snakewalk.controller.capture.frame_status import FrameStatus
from snakewalk.controller.capture.image.medial_axis import Skeleton, no_skeleton

_SPREADS = 6.0  # usual deviations, taken from the middle half of the frames
_LENGTH = 0.06  # of the usual: least deviation that is told
_AREA = 0.08
_THICK = 0.3
_LEAST_PX = 0.3
_STRETCH = 7  # of 101 points over which thickness is averaged
_TIPS = 6  # points at each end whose thickness is not compared
_FEWEST = 5  # frames that make a usual body


def mark_outliers(skeletons: Sequence[Skeleton], area_px: Floats) -> list[Skeleton]:
    """Drop bodies that are unlike the film's: nothing is guessed of them.

    Args:
        skeletons: (T) the same end first in all.
        area_px: (T,) of the silhouettes.

    """
    out = list(skeletons)
    good = [k for k, one in enumerate(out) if one.status is FrameStatus.GOOD]
    if len(good) < _FEWEST:
        return out
    length = _beside(np.array([out[k].length_px for k in good]), _LENGTH)
    area = _beside(area_px[good], _AREA)
    radius = uniform_filter1d(np.stack([out[k].radius_px for k in good]), _STRETCH, axis=1)
    radius = radius[:, _TIPS:-_TIPS]
    usual = np.maximum(np.median(radius, axis=0), _LEAST_PX)
    ratio = radius / usual - 1.0
    spread = 1.4826 * np.median(np.abs(ratio), axis=0)
    thick = (ratio / np.maximum(_THICK, _SPREADS * spread)).max(axis=1)
    for n, k in enumerate(good):
        if thick[n] > 1.0 or length[n] < -1.0 or area[n] < -1.0:
            out[k] = no_skeleton(FrameStatus.SHORT)
        elif length[n] > 1.0 or area[n] > 1.0:
            out[k] = no_skeleton(FrameStatus.LARGER)
    return out


def _beside(values: Floats, least: float) -> Floats:
    """How far each is from the usual, 1 where it is told."""
    off = values / np.median(values) - 1.0
    return np.asarray(off / max(least, _SPREADS * 1.4826 * float(np.median(np.abs(off)))))
