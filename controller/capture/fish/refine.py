"""The last step of matching: all parameters at once, by least squares on shaded areas.

A coordinate search stops on a ridge: two spine angles that change against each other hardly move
the outline, so that from a start five degrees off it leaves the angles where they are (measured:
docs/fish.md). The difference of areas is a sum over pixels, so its derivative is cheap.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from snakewalk.config.arrays import Floats

_NUDGE_PX, _NUDGE_RAD = 0.5, 0.02


def refine(
    picture: Callable[[Floats], NDArray[np.float32]],
    seen: NDArray[np.float32],
    start: Floats,
    *,
    rounds: int,
    nudge: float = 1.0,
    free: int | None = None,
    stiffness: float = 0.0,
) -> Floats:
    """Parameters near ``start`` whose picture differs least from the silhouette.

    Levenberg and Marquardt, derivatives by differences.

    Args:
        picture: the blurred area of parameters (P,).
        seen: the blurred silhouette.
        start: (P,) two positions in pixels, then angles in rad.
        rounds: at most so many steps.
        nudge: pixels of the frame per pixel of the canvas, for the derivative.
        free: only the first so many parameters move.
        stiffness: what it costs, per rad squared, that spine angles go to and fro; an outline in
            noise says little of that.

    """
    count = len(start) if free is None else free
    size = np.full(count, _NUDGE_RAD)
    size[:2] = _NUDGE_PX * nudge
    here = np.array(start, dtype=float)
    kinks = stiffness * _to_and_fro(len(start))
    apart = seen - picture(here)
    cost, damping = float(np.vdot(apart, apart)) + float(here @ kinks @ here), 1e-2
    for _ in range(rounds):
        slope = np.empty((count, apart.size), dtype=np.float32)
        for k in range(count):
            step = np.zeros_like(here)
            step[k] = size[k]
            slope[k] = ((picture(here + step) - picture(here - step)) * 0.5).ravel()
        units = np.outer(size, size)
        square = np.asarray(slope @ slope.T, dtype=float) + kinks[:count, :count] * units
        pull = np.asarray(slope @ apart.ravel(), dtype=float) - (kinks @ here)[:count] * size
        gained = 0.0
        for _ in range(4):
            held = square + damping * np.diag(np.diag(square) + 1e-3 * np.trace(square))
            step = np.zeros_like(here)
            step[:count] = np.clip(np.linalg.solve(held, pull), -12.0, 12.0) * size
            away = seen - picture(here + step)
            found = float(np.vdot(away, away)) + float((here + step) @ kinks @ (here + step))
            if found < cost:
                gained = cost - found
                here, apart, cost, damping = here + step, away, found, max(damping / 5.0, 1e-4)
                break
            damping *= 5.0
        if gained < 1e-3 * cost:
            break
    return here


def _to_and_fro(parameters: int) -> Floats:
    """(P, P) squared second difference of the spine angles, and a little of their size."""
    joints = parameters - 3
    second = np.diff(np.eye(joints), n=2, axis=0) if joints > 2 else np.zeros((1, joints))
    square = np.zeros((parameters, parameters))
    square[3:, 3:] = second.T @ second + 0.1 * np.eye(joints)
    return square
