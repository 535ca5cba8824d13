"""Keypoints of pose trackers: points with a low score are missing, rows count downwards."""

from pathlib import Path

import numpy as np

from snakewalk.config.arrays import Floats, Ints
from snakewalk.config.errors import InputError
from snakewalk.controller.capture.track import Track, track_from_points

KEYPOINT_RATE_HZ = 30.0
"""Default: neither SLEAP's nor DeepLabCut's files hold a frame rate."""


def track_from_keypoints(
    file: Path,
    pixels: Floats,
    scores: Floats | None,
    *,
    rate_hz: float | None,
    least_score: float,
    frame: Ints | None = None,
) -> Track:
    """Make a track of keypoints in the order of the file, head first.

    Args:
        file: for faults and the name.
        pixels: (T, K, 2), columns to the right and rows downwards; NaN where nothing was seen.
        scores: (T, K) how sure the tracker was, 0..1; None where the file holds no scores.
        rate_hz: frames a second; None takes ``KEYPOINT_RATE_HZ`` and marks the rate as assumed.
        least_score: keypoints below it count as missing, and their frames are left out.
        frame: (T,) frame numbers; default 0, 1, 2...

    Raises:
        InputError: no scores to compare with, or too little is left.

    """
    if scores is None and least_score > 0.0:
        raise InputError(f"{file}: holds no scores to compare with a least score of {least_score}")
    if scores is not None:
        unsure = scores < least_score  # NaN is no score: points set by hand have none
        if least_score > 0.0 and unsure.any(axis=1).sum() > len(unsure) - 2:
            worst = np.nanmedian(scores, axis=0)
            raise InputError(
                f"{file}: in {int(unsure.any(axis=1).sum())} of {len(unsure)} frames a keypoint "
                f"scores less than {least_score:g} (keypoint {int(np.argmin(worst)) + 1}, the "
                f"least sure, {worst.min():.2f} in the median); lower the least score, or export "
                "fewer keypoints"
            )
        pixels = np.where(unsure[..., None], np.nan, pixels)
    return track_from_points(
        file.stem,
        pixels * [1.0, -1.0],
        KEYPOINT_RATE_HZ if rate_hz is None else rate_hz,
        frame=frame,
        rate_assumed=rate_hz is None,
    )
