"""Visible lengths of faint tails, steadied by the frames before and after.

A faint tail ends where noise hides it, so its visible length changes from frame to frame by more
than the error of its line.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.ndimage import median_filter

from snakewalk.config.arrays import Floats
from snakewalk.controller.images.faint_tail import TailTip
from snakewalk.controller.images.medial_axis import Skeleton, in_equal_chords

_FRAMES = 9  # whose usual length counts; a beating tail is blurred for less than that
_OWN_SHARE = 0.5  # of the frame's own length in the steadied one (from one film of a larva)
_OUTLIER = 3.0  # standard deviations: the frame shows less of its tail, or more than a tail
_END_STATIONS = 5  # the direction in which a line is lengthened


def with_steady_tails(
    bodies: Sequence[Skeleton], tips: Mapping[int, TailTip]
) -> tuple[list[Skeleton], dict[int, float]]:
    """Return the bodies with steadied tails, and the expected error of each tip, px.

    Args:
        bodies: (T) head first.
        tips: by frame with a followed tail. The spread of lengths is that of single frames.

    """
    out = list(bodies)
    numbers = [k for k in tips if out[k].status.has_points]
    if not numbers:
        return out, {}
    own_px = np.array([out[k].length_px for k in numbers])
    change_px = _towards_usual_px(own_px)
    single_px = own_px - [tips[k].lengthening_px for k in numbers]
    spread_px = 1.4826 * float(np.median(np.abs(_towards_usual_px(single_px))))
    error_px = float(np.hypot(np.median([tips[k].error_px for k in numbers]), spread_px))
    errors: dict[int, float] = {}
    for k, change in zip(numbers, change_px.tolist(), strict=True):
        out[k] = _changed_length(out[k], change)
        errors[k] = float(np.hypot(error_px, change * (abs(change) > _OUTLIER * spread_px)))
    return out, errors


def _towards_usual_px(length_px: Floats) -> Floats:
    """(T,) change of each length (T,) towards those of the frames before and after."""
    usual_px = median_filter(length_px, _FRAMES, mode="nearest")
    return np.asarray((1.0 - _OWN_SHARE) * (usual_px - length_px))


def _changed_length(body: Skeleton, change_px: float) -> Skeleton:
    """The body with a tail that is longer by ``change_px``, straight on, or cut."""
    points = body.points_px
    kept = points[: 1 + int(len(points) * min(1.0, 1.0 + change_px / body.length_px))]
    ahead = points[-1] - points[-1 - _END_STATIONS]
    tip = points[-1] + max(change_px, 0.0) * ahead / np.hypot(*ahead)
    changed = in_equal_chords(np.vstack([kept, tip][: 1 + (change_px > 0.0)]), body.radius_px)
    return body if changed is None else changed
