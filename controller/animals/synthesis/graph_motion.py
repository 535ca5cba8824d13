"""Motion by a walk on the fixed graph of states ([KP] 4.2.1), whose head leads its tail (Eq. 9).

On land the angles ``A_c`` of the head pass down the body, one point a frame:
``A_f(t, s_k) = m(s_k) A_c(t, s_k) + (1 - m(s_k)) A_f(t - 1, s_(k-1))``. Correction: the text wants
m "close to 1" at the head. It must be 1 there, as nothing is in front of the head.
"""

from collections.abc import Callable, Iterator

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.animals.synthesis.synthesis import Locomotion, Until, chain
from snakewalk.controller.kinematics import smoothstep
from snakewalk.controller.terrain.path import SplinePath

HEAD_SHARE = 0.5
"""Share of the body, behind which m is 0 (ours). A tenth alone makes a body that is nearly
straight, because neighbouring states differ little at the head."""


def leading(points: int) -> Floats:
    """m(s_k) of Eq. 9, (points,): 1 at the head, 0 from ``HEAD_SHARE`` on."""
    along = np.arange(points) / (HEAD_SHARE * points)
    return 1.0 - smoothstep.cubic(np.clip(along, 0.0, 1.0))


def handed_down(wanted_rad: Floats, before_rad: Floats, m: Floats) -> Floats:
    """One frame of Eq. 9: (N,) from the present A_c, A_f of the frame before, and m.

    Raises:
        ValueError: m is not 1 at the head.

    """
    if m[0] != 1.0:
        raise ValueError(
            f"m: is {m[0]:g} at the head, which has no body ahead of it; set its first value to 1"
        )
    ahead = np.concatenate([wanted_rad[:1], before_rad[:-1]])
    return np.asarray(m * wanted_rad + (1.0 - m) * ahead)


def graph_motion(
    shapes: Iterator[tuple[int, Floats]],
    path: SplinePath,
    frames: int,
    segment_m: float,
    dt_s: float,
    until: Until,
    on_state: Callable[[int, int], object],
) -> Locomotion:
    """Lay at most ``frames`` frames along a path: mass centre on it, mean heading along it.

    Beyond its end the path continues straight. Without slip a point of the body moves along the
    path by a segment a frame, times the mean cosine of the angles about their mean. The centre
    advances by the same distance (ours; the text leaves the speed open).

    Args:
        shapes: of ``film_angles``.
        path: through the waypoints.
        frames: largest number of frames.
        segment_m: r, the body's length over N.
        dt_s: time between frames.
        until: ends the motion early.
        on_state: called with (frame, state) at each change of state.

    """
    state, body = next(shapes)
    on_state(0, state)
    m = leading(len(body))
    at_m = 0.0
    angles = []
    points = []
    speed = []
    for t in range(frames):
        if t > 0:
            now, next_shape = next(shapes)
            body = handed_down(next_shape, body, m)
            if now != state:
                state = now
                on_state(t, state)
        swing = body - body.mean()
        heading = path.heading_rad(min(at_m, path.length_m))
        beyond_m = max(at_m - path.length_m, 0.0)
        centre_m = path.position(min(at_m, path.length_m)) + beyond_m * np.array(
            [np.cos(heading), np.sin(heading)]
        )
        angles.append(swing + heading)
        shape = chain(angles[-1], segment_m)
        points.append(shape - shape.mean(axis=0) + centre_m)
        advance_m = segment_m * float(np.cos(swing).mean())
        speed.append(advance_m / dt_s)
        at_m += advance_m
        if until(t, points[-1]):
            break
    place = np.arange(len(angles))[:, None] + np.arange(len(body))[::-1].astype(float)
    return Locomotion(np.array(angles), np.array(points), np.array(speed), place)
