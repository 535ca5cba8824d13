"""Tips that taper below the blur of the picture; half the contrast ends them too early.

The contrast summed across the body is its width times its contrast, at any blur. The tip is where
this profile, extrapolated, reaches 0.
"""

import numpy as np
from scipy.ndimage import gaussian_filter1d

from snakewalk.config.arrays import Floats, Singles
from snakewalk.controller.images.cross_profile import (
    end_direction,
    even_line,
    seen_across,
)
from snakewalk.controller.kinematics.arc_length import arc_lengths

_STEP_PX = 0.5
_LOW_LEVEL, _HIGH = 0.06, 0.12  # of the usual width: this part of the profile is extrapolated
_BEFORE_WIDTHS = 2.0  # widths before the known end at which the profile starts
_BLUR_PX = 2.0  # of filters and image: a blunt end's profile extends this far
_BEYOND_WIDTHS = 2.5  # widths beyond the known end, at most
_ACROSS_WIDTHS = 0.9  # widths on each side that are summed
_RIM = 0.7  # widths to the side beyond which there is ground
_DIRECTION_WIDTHS = 0.5  # widths over which the direction at the end is measured
_BLUNT = 0.18  # of the usual width: a wider known end is not pointed
_LONGEST_WIDTHS = 0.6  # widths: a longer extension is a trail
_SLOWER = 1.0  # limit of the extension, over that expected from the taper
_GROUND = 1.2  # widths beyond the end where the ground starts
_SLOW_FALL_PX = 1.7  # between both shares: a blunt end's profile falls faster
_WORTH = 0.15  # widths: a shorter extension is ignored
_MIDDLE_PART = (0.3, 0.6)  # of the length: range of the usual width


def to_pointed_tips(line: Floats, level: Singles, wide: float, scale: float) -> Floats:
    """Return the line (P, 2), extended to the tips of ends that taper.

    Args:
        line: x, y in pixels of ``level``, between the tips at half the contrast.
        level: (h, w) contrast of one body.
        wide: width of the body, pixels of ``level``.
        scale: pixels of ``level`` per pixel of the image.

    """
    arc = arc_lengths(line)
    if arc[-1] < 4.0 * wide:
        return line
    even = even_line(line, arc, _STEP_PX)
    for _ in range(2):
        even = _lengthened_line(even, level, wide, scale)[::-1]
    return np.asarray(even)


def _lengthened_line(line: Floats, level: Singles, wide: float, scale: float) -> Floats:
    """Extend the last end of a line of equal steps to the tip."""
    count = len(line)
    back = max(2, round(_DIRECTION_WIDTHS * wide / _STEP_PX))
    ahead = end_direction(line, back)
    beyond = np.arange(1, round(_BEYOND_WIDTHS * wide / _STEP_PX) + 1)[:, None] * _STEP_PX * ahead
    usual = float(
        np.median(_sums(line, level, wide)[slice(*(round(v * count) for v in _MIDDLE_PART))])
    )
    end = min(round(_BEFORE_WIDTHS * wide / _STEP_PX), count - back)
    path = np.vstack([line[-end:], line[-1] + beyond])
    sums = gaussian_filter1d(_sums(path, level, wide), 1.0 / _STEP_PX, mode="nearest") / usual
    high, low = (_crossing(sums, share) for share in (_HIGH, _LOW_LEVEL))
    if usual <= 0.0 or high is None or low is None or sums[end] > _BLUNT:
        return line
    if (low - high) * _STEP_PX < _SLOW_FALL_PX * scale:
        return line
    tip = low + (low - high) * _LOW_LEVEL / (_HIGH - _LOW_LEVEL) - _BLUR_PX * scale / _STEP_PX
    longer = round(tip - end)
    ground = sums[end + round(_GROUND * wide / _STEP_PX) :]
    taper = float(sums[end - round(wide / _STEP_PX)] - sums[end]) / wide
    most = round(_SLOWER * float(sums[end]) / max(taper, 1e-9) / _STEP_PX)
    if (
        not _WORTH * wide < longer * _STEP_PX < _LONGEST_WIDTHS * wide
        or np.abs(ground).max() > _LOW_LEVEL / 2.0
    ):
        return line
    longer = min(longer, most)
    return np.vstack([line, line[-1] + beyond[:longer]])


def _crossing(sums: Floats, share: float) -> float | None:
    """Position from which the profile stays below a share, or None."""
    above = np.flatnonzero(sums >= share)
    if not above.size or above[-1] + 1 >= len(sums):
        return None
    last = int(above[-1])
    return last + float((sums[last] - share) / (sums[last] - sums[last + 1]))


def _sums(path: Floats, level: Singles, wide: float) -> Floats:
    """(P,) contrast summed across the path, less that of the ground on both sides."""
    reach = round(_ACROSS_WIDTHS * wide)
    across = np.arange(-reach, reach + 1.0)
    levels = seen_across(path, level, across)
    ground = np.median(levels[:, np.abs(across) > _RIM * wide])
    return np.asarray((levels - ground).sum(axis=1), dtype=float)
