"""Algorithm 2 of [PT]: a walk of shapes after waypoints, ended as printed and as corrected."""

from collections.abc import Callable

import numpy as np

from snakewalk.config.run import WalkConfig
from snakewalk.controller.walk.walker import Walker

POINTS, SEGMENT_M, NEAR_M = 100, 0.01, 0.3
WAYPOINTS_M = np.array([[2.0, 0.0], [3.0, 1.5], [1.5, 2.5], [0.0, 2.0]])
LAST_FRAME = 3000


def synthesis(until: Callable[[int], bool]) -> tuple[int, int]:
    """Frames done, and waypoints passed, by the time that ``until(n)`` ends the loop."""
    rng = np.random.default_rng(2)
    s = np.linspace(0.0, 1.0, POINTS)
    phase = rng.uniform(0.0, 2.0 * np.pi, (300, 1))
    mean = rng.uniform(-0.5, 0.5, (300, 1))
    shapes = 0.7 * np.sin(2.0 * np.pi * 1.2 * s + phase) + mean * s
    walker = Walker(shapes, WalkConfig())
    tip, place, n, frame = np.zeros(2), walker.track.end, 1, 0
    while True:  # n counts from 1, as printed: T_n is the point to go to
        angles = walker.track.body_rad(place)
        back = SEGMENT_M * np.cumsum(np.stack([np.cos(angles), np.sin(angles)], 1), axis=0)
        away = WAYPOINTS_M[min(n, len(WAYPOINTS_M)) - 1] - (tip - back.mean(axis=0))
        if np.hypot(*away) < NEAR_M:
            n += 1
        if place + 1 > walker.track.end:
            walker.decide(0.0, float(np.arctan2(away[1], away[0])))
        place += 1
        heading = walker.track.body_rad(place)[0]
        tip = tip + SEGMENT_M * np.array([np.cos(heading), np.sin(heading)])
        frame += 1
        if until(n) or frame == LAST_FRAME:
            return frame, n - 1


def test_until_n_is_less_than_the_number_ends_before_anything_is_reached() -> None:
    wanted = len(WAYPOINTS_M)
    assert synthesis(lambda n: n < wanted) == (1, 0)
    frames, passed = synthesis(lambda n: n > wanted)
    assert passed == wanted
    assert frames < LAST_FRAME
