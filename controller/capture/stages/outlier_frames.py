"""Outlier frames: their body differs from the others, as it touches itself or another animal.

A coil without a hole, or a small animal that touches the body, has no side branch. But it makes the
body shorter, longer or locally thicker than in most frames, or changes its area.
"""

from collections.abc import Container, Sequence
from dataclasses import replace

import numpy as np
from scipy.ndimage import uniform_filter1d

from snakewalk.config.arrays import Floats
from snakewalk.controller.capture.identity import align_ends
from snakewalk.controller.capture.staged_film import StagedFilm
from snakewalk.controller.images.medial_axis import Skeleton, no_skeleton
from snakewalk.controller.track.frame_status import FrameStatus

_SPREADS = 6.0  # standard deviations, estimated from the median deviation
_LENGTH = 0.06  # of the median: smaller deviations are ignored
_AREA = 0.08
_THICK = 0.3
_LEAST_RADIUS_PX = 0.3
_STRETCH = 7  # of 101 points over which thickness is averaged
_TIPS = 6  # points at each end whose thickness is not compared
_FAINT = 0.25  # of the usual contrast: below, compression and noise of an empty frame
_TAILED = 4.0  # times these limits: a beating tail is blurred and may be hidden by noise (ours)
_FEWEST = 5  # least number of frames to find outliers


class Compare:
    """Stage that compares the frames: the same end first in all, and outliers marked."""

    def run(self, film: StagedFilm) -> StagedFilm:
        """Return the film with aligned ends; outliers have a status instead of points."""
        marked = mark_empty(film.skeletons, np.array(film.detections.contrast))
        detections = film.detections
        checked = mark_outliers(align_ends(marked), np.array(detections.area_px), detections.tips)
        return replace(film, skeletons=align_ends(checked))


def mark_empty(skeletons: Sequence[Skeleton], contrast: Floats) -> list[Skeleton]:
    """Give frames far fainter than the film's animal the status ``NOTHING``.

    Blocks of a compressed frame without an animal would otherwise be several animals.

    Args:
        skeletons: (T)
        contrast: (T,) of the clearest region in each frame.

    """
    good = [k for k, skeleton in enumerate(skeletons) if skeleton.status is FrameStatus.GOOD]
    least = _FAINT * float(np.median(contrast[good])) if len(good) >= _FEWEST else 0.0
    several = {FrameStatus.SEVERAL, FrameStatus.BLOB}
    return [
        no_skeleton(FrameStatus.NOTHING)
        if skeleton.status in several and level < least
        else skeleton
        for skeleton, level in zip(skeletons, contrast.tolist(), strict=True)
    ]


def mark_outliers(
    skeletons: Sequence[Skeleton], area_px: Floats, tailed: Container[int] = ()
) -> list[Skeleton]:
    """Drop the skeletons of bodies that differ from the film's; their status gives the difference.

    Args:
        skeletons: (T) the same end first in all.
        area_px: (T,) of the silhouettes.
        tailed: frames with a faint tail, whose visible length varies.

    """
    out = list(skeletons)
    good = [k for k, skeleton in enumerate(out) if skeleton.status is FrameStatus.GOOD]
    if len(good) < _FEWEST:
        return out
    length = _deviation(np.array([out[k].length_px for k in good]), _LENGTH)
    area = _deviation(area_px[good], _AREA)
    radius = uniform_filter1d(np.stack([out[k].radius_px for k in good]), _STRETCH, axis=1)
    radius = radius[:, _TIPS:-_TIPS]
    median = np.maximum(np.median(radius, axis=0), _LEAST_RADIUS_PX)
    spread = 1.4826 * np.median(np.abs(radius / median - 1.0), axis=0)
    most = np.maximum(_THICK, _SPREADS * spread)
    # after a coil the other end may be first, which makes no body thick
    orders = [
        ((radius_order / median - 1.0) / most).max(axis=1)
        for radius_order in (radius, radius[:, ::-1])
    ]
    thick = np.minimum(*orders)
    for n, k in enumerate(good):
        most_off = _TAILED if k in tailed else 1.0
        if max(thick[n], -length[n], -area[n]) > most_off:
            out[k] = no_skeleton(FrameStatus.SHORT)
        elif max(length[n], area[n]) > most_off:
            out[k] = no_skeleton(FrameStatus.LARGER)
    return out


def _deviation(values: Floats, least: float) -> Floats:
    """Deviation from the median; an outlier is beyond 1 or -1."""
    off = values / np.median(values) - 1.0
    return off / max(least, _SPREADS * 1.4826 * float(np.median(np.abs(off))))
