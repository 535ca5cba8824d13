"""Error of a body by its own frame alone: no value of the other frames of its film counts.

The contrast along the line ends at the tips of the body, and a body that fades is thinner at half
of its contrast. Bends and loops are judged by ``film_check.possible_form``.
"""

import numpy as np

from snakewalk.controller.capture.verification.profiles import BodyProfile

_SURE_PX = 1.0  # a smaller distance of a tip from the end of its contrast is its form
_UNSEEN_PX = 2.0  # distance of an end of the contrast that is not found
_SHARE = 0.25  # of both distances together: error of a point, the mean along the body
_FRONT, _REAR = slice(10, 35), slice(65, 90)
_EVEN = 0.2  # share of the contrast that may be lost from one to the other
_FADING = 0.033  # of the length and the share above that: error of a point
# (constants measured on a real film with published midlines and 40 rendered films)


def judged_error_px(profile: BodyProfile, length_px: float) -> float:
    """Mean error of the points of a body that its frame shows; added to that of its fit."""
    away = np.abs(np.nan_to_num(profile.beyond_px, nan=_UNSEEN_PX))
    tips = _SHARE * float(np.linalg.norm(np.maximum(away - _SURE_PX, 0.0)))
    contrast = profile.sides @ profile.direction
    parts = [contrast[:, part][np.isfinite(contrast[:, part])] for part in (_FRONT, _REAR)]
    faded = 0.0
    if all(map(len, parts)):
        low, high = sorted(float(np.median(part)) for part in parts)
        faded = max(1.0 - low / max(high, 1e-9) - _EVEN, 0.0)
    return float(np.hypot(tips, _FADING * faded * length_px))
