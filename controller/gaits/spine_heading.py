"""Headings of the links of a chain along a moving spine, in a compiled loop."""

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.drivers.compiling import compiled


@compiled(
    "void(float64[::1], float64[:, ::1], float64[::1], float64[::1], float64[::1], float64[:, ::1])"
)
def write_headings(
    u: Floats, shapes: Floats, cosine: Floats, sine: Floats, shares: Floats, headings: Floats
) -> None:
    """Write headings (T, n), towards the head, of the chords between ``shares``."""
    run = np.zeros(len(u))
    side = np.empty(len(u))
    for t in range(len(cosine)):
        for i in range(len(u)):
            side[i] = shapes[0, i] * cosine[t] + shapes[1, i] * sine[t]
        for i in range(1, len(u)):
            du, dy = u[i] - u[i - 1], side[i] - side[i - 1]
            run[i] = run[i - 1] + np.sqrt(du * du + dy * dy)
        i = 0
        back = u[0]
        left = side[0]
        for k in range(len(shares)):
            target_m = shares[k] * run[-1]
            while i < len(u) - 2 and run[i + 1] < target_m:
                i += 1
            part = (target_m - run[i]) / (run[i + 1] - run[i])
            coordinate = u[i] + part * (u[i + 1] - u[i])
            aside = side[i] + part * (side[i + 1] - side[i])
            if k > 0:
                headings[t, k - 1] = np.arctan2(left - aside, coordinate - back)
            back = coordinate
            left = aside
