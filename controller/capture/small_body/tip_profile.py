"""End of a body by its contrast summed across it, and the error of a tip.

The sum is the width times the contrast, whatever the blur. A pointed tail falls below half of the
contrast, or below the noise, before it ends. The profile is continued in a straight line to 0.
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

_HIGH, _LOW_LEVEL = 0.3, 0.06  # of the usual sum: between these the profile falls towards 0
_HIGHEST_LOW_LEVEL = 0.2
_NOISE = 3.0  # standard deviations of the profile beyond the body
_FINEST_PX = 0.5
_STEPS = 20  # step along the profile: this, or a part of the width if larger
_INSIDE_WIDTHS = 1.5
_BEYOND_WIDTHS = 3.0  # widths of the profile inside the tip, and beyond it
_LEAST_BEYOND_PX = 10.0
_ACROSS_WIDTHS = 0.9
_ACROSS_MARGIN_PX = 2.5  # widths and px on each side that are summed
_RIM = 0.75  # of the reach on each side: beyond is ground
_CALM = 95.0  # percentile of the ground: higher values are signal
_MIDDLE_PART = (0.3, 0.6)  # of the length: where the sum is the usual one
_ROUND_PX = 1.5
_BY_BLUR = 2.0
_LEAST_ROUND_PX = 3.0  # so far a round tip's profile goes beyond it
_LEAST_BLUR_PX = 0.7
_MOST_DOUBT_PX = 2.0
_INNER_POINT = 4  # chords from a tip: its direction
_SIGMA_SHARE = 0.7  # standard deviation of a tip, of its distance from the end of its profile
# (constants measured on rendered films)
NO_ENDS = np.full((2, 3), np.nan)
"""Ends of a frame without a body."""


def profile_ends(line: Floats, radius_px: Floats, level: Singles, blur_px: float) -> Floats:
    """(2, 3) x, y of the end of a body's profile at its first and last point, and the doubt.

    The doubt, px, is the unseen part of the profile, less that of a round tip.

    Args:
        line: (P, 2) the body in pixels of ``level``.
        radius_px: (P,) half its width.
        level: (h, w) contrast, above 0 where the body is.
        blur_px: standard deviation of the picture's blur.

    """
    wide = max(2.0 * float(np.median(radius_px)), 1.5)
    step = max(_FINEST_PX, wide / _STEPS)
    even = even_line(line, arc_lengths(line), step)
    first, last = (round(v * len(even)) for v in _MIDDLE_PART)
    usual = 0.0
    if last - first > 2:
        usual = float(np.median(_sums(even[first:last], level, wide, step)))
    if usual <= 0.0:
        return NO_ENDS.copy()
    round_px = max(_LEAST_ROUND_PX, _ROUND_PX + _BY_BLUR * max(blur_px, _LEAST_BLUR_PX))
    ends = [_end(line_end, level, wide, step, usual, round_px) for line_end in (even[::-1], even)]
    return np.stack(ends)


def beyond_tips_px(points_px: Floats, ends_px: Floats) -> Floats:
    """(2, 2) for each tip of a body (P, 2): distance of the profile's end beyond it, and the doubt.

    The distance is below 0 if the profile ends before the tip. The ends (2, 3) may be in the other
    order.
    """
    tips = points_px[[0, -1]]
    ahead = tips - points_px[[_INNER_POINT, -1 - _INNER_POINT]]
    ahead = ahead / np.maximum(np.hypot(*ahead.T), 1e-9)[:, None]
    end_pairs = (ends_px, ends_px[::-1])
    near = min(end_pairs, key=lambda path: float(np.hypot(*(path[:, :2] - tips).T).sum()))
    return np.column_stack([((near[:, :2] - tips) * ahead).sum(axis=1), near[:, 2]])


def tips_error_px(beyond_px: Floats) -> float:
    """Expected mean error of the points of a body, from ``beyond_tips_px`` (2, 2)."""
    return 0.5 * _SIGMA_SHARE * float(np.linalg.norm(beyond_px))


def _end(
    line: Floats,
    level: Singles,
    wide: float,
    step: float,
    usual: float,
    round_px: float,
) -> Floats:
    """Zero of the profile of a line of equal steps, less a round tip, and the doubt."""
    back = min(max(2, round(max(0.5 * wide, 3.0) / step)), len(line) - 1)
    ahead = end_direction(line, back)
    reach = min(
        max(_BEYOND_WIDTHS * wide, _LEAST_BEYOND_PX), 0.25 * step * len(line) + _LEAST_BEYOND_PX
    )
    beyond = np.arange(1, round(reach / step) + 1)[:, None] * step * ahead
    end = min(round(_INSIDE_WIDTHS * wide / step), len(line) - 1)
    path = np.vstack([line[-1 - end :], line[-1] + beyond])
    profile = gaussian_filter1d(_sums(path, level, wide, step) / usual, 1.0 / step)
    lag = max(1, round(2.0 / step))
    rest = profile[end + len(beyond) // 3 :]
    noise = 1.4826 * float(np.median(np.abs(rest[lag:] - rest[:-lag]))) / np.sqrt(2.0)
    low = float(np.clip(_NOISE * noise, _LOW_LEVEL, _HIGHEST_LOW_LEVEL))
    from_px, to_px = (_crossing(profile, share) * step for share in (_HIGH, low))
    hidden_px = (to_px - from_px) * low / (_HIGH - low)
    far_px = to_px - end * step + hidden_px - round_px
    doubt_px = np.clip(
        hidden_px - round_px * _LOW_LEVEL / (_HIGH - _LOW_LEVEL), 0.0, _MOST_DOUBT_PX
    )
    return np.append(line[-1] + far_px * ahead, doubt_px)


def _crossing(profile: Floats, share: float) -> float:
    """Where the profile first falls below a share."""
    below = np.flatnonzero(profile < share)
    if not below.size:
        return len(profile) - 1.0
    k = int(below[0])
    return 0.0 if k == 0 else k - (share - profile[k]) / float(profile[k - 1] - profile[k])


def _sums(path: Floats, level: Singles, wide: float, step: float) -> Floats:
    """(P,) contrast summed across the path, less that of the ground on both sides."""
    reach = _ACROSS_WIDTHS * wide + _ACROSS_MARGIN_PX
    across = np.arange(-reach, reach + 0.5 * step, step)
    levels = seen_across(path, level, across)
    rim = levels[:, np.abs(across) > _RIM * reach]
    # contrast below 0 is cut off, so the median of the noise is below its mean
    ground = np.minimum(rim, np.percentile(rim, _CALM)).mean()
    return np.asarray((levels - ground).sum(axis=1) * step, dtype=float)
