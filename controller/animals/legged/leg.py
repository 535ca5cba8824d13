"""A leg of two segments from hip to foot, with its knee where the animal's points."""

import numpy as np

from snakewalk.config.arrays import Floats


def knees_m(
    hip_m: Floats, foot_m: Floats, upper_m: Floats, lower_m: Floats, towards: Floats
) -> tuple[Floats, Floats]:
    """Knees (..., 3), and the ends of the legs, which are the feet wherever a leg reaches.

    Args:
        hip_m: (..., 3)
        foot_m: (..., 3)
        upper_m: (...) lengths from hip to knee.
        lower_m: (...) lengths from knee to foot.
        towards: (..., 3) directions to which knees point, not along their legs.

    A leg that is too short is stretched towards its foot; one that cannot fold enough is folded.

    """
    way = foot_m - hip_m
    far = np.linalg.norm(way, axis=-1, keepdims=True)
    ahead = way / np.maximum(far, 1e-12)
    upper, lower = np.asarray(upper_m)[..., None], np.asarray(lower_m)[..., None]
    reach = np.clip(far, np.abs(upper - lower) + 1e-12, upper + lower)
    out = towards - (towards * ahead).sum(axis=-1, keepdims=True) * ahead
    out /= np.maximum(np.linalg.norm(out, axis=-1, keepdims=True), 1e-12)
    cosine = (upper**2 + reach**2 - lower**2) / (2.0 * upper * reach)
    cosine = np.clip(cosine, -1.0, 1.0)
    knee = hip_m + upper * (cosine * ahead + np.sqrt(1.0 - cosine**2) * out)
    return knee, hip_m + reach * ahead
