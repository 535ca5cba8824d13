"""One frame from above: a posture searched coarse to fine, [TH] 3.3.3.

The last step moves all parameters at once, by least squares on shaded areas. A coordinate search
stops on a ridge: two spine angles that change against each other hardly move the outline. So from a
start five degrees off it leaves the angles where they are. The difference
of areas is a sum over pixels, so its derivative is cheap.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Floats, Singles
from snakewalk.controller.animals.fish.matching import EDGE_WEIGHT, SilhouetteFrame, Target
from snakewalk.controller.animals.fish.model import FishModel
from snakewalk.controller.animals.fish.raster import Window

LEVELS = ((70.0, 5, 6), (140.0, 3, 6), (260.0, 3, 6))
"""Coarse to fine: body length on the canvas (px), width of edges (px), rounds at most."""
STIFFNESS = 0.15
"""Cost of spine angles that alternate, per px of body length on the canvas, with four angles. With
more angles it falls with the cube of their number, since a wave then turns back within fewer of
them."""
_FOLDED_BEND_RAD = 1.5
_NUDGE_PX, _NUDGE_RAD = 0.5, 0.02


@dataclass(frozen=True, slots=True)
class Match:
    """A posture and how well it explains the frame."""

    parameters: Floats
    """(3 + J,) base x, base y (px, y up), head direction, spine angles (rad)."""
    value: float
    """Misfit V of Eq. 3 between model and picture."""


def window_of(
    frame: SilhouetteFrame, model: FishModel, near: Floats | None, scale: float
) -> Window | None:
    """The part of a frame where the fish may be: around the mask, or around ``near`` (x, y)."""
    rows, columns = frame.mask.shape
    low_x, high_x, low_y, high_y = 0, columns, 0, rows
    if near is not None:
        reach = round(1.25 * model.length_px)
        column, row = round(float(near[0])), round(-float(near[1]))
        low_x, high_x = max(column - reach, 0), min(column + reach, columns)
        low_y, high_y = max(row - reach, 0), min(row + reach, rows)
        if high_x - low_x < 2 or high_y - low_y < 2:
            return None
    part = frame.mask[low_y:high_y, low_x:high_x]
    tall = np.flatnonzero(part.any(axis=1))
    wide = np.flatnonzero(part.any(axis=0))
    if len(tall) == 0:
        return None
    edge = max(8, round(0.15 * model.length_px))
    left = max(low_x + int(wide[0]) - edge, 0)
    top = max(low_y + int(tall[0]) - edge, 0)
    right = min(low_x + int(wide[-1]) + edge, columns)
    bottom = min(low_y + int(tall[-1]) + edge, rows)
    return Window(left, top, right - left, bottom - top, scale)


class TopViewFit:
    """A frame at one size, as a function of the posture's parameters (3 + J,)."""

    def __init__(self, target: Target, model: FishModel, weight: float = EDGE_WEIGHT) -> None:
        self._target = target
        self._model = model
        self._weight = weight

    def outline(self, parameters: Floats) -> Floats:
        """(n, 2) outline of parameters."""
        model = self._model
        return model.outline(model.midline(parameters[:2], float(parameters[2]), parameters[3:]))

    def picture(self, parameters: Floats) -> Singles:
        """Blurred area of parameters."""
        return self._target.soft(self.outline(parameters))

    def value(self, parameters: Floats) -> float:
        """V of Eq. 3; a folded spine has the value 0."""
        if np.abs(parameters[3:]).max() > _FOLDED_BEND_RAD:
            return float("-inf")
        return self._target.value(self.outline(parameters), self._weight)


def search(
    frame: SilhouetteFrame,
    model: FishModel,
    starts: list[Floats],
    *,
    near: Floats | None = None,
    from_level: int = 0,
) -> Match | None:
    """Best posture of a frame.

    Args:
        frame: grey picture and silhouette.
        model: the fish.
        starts: parameters (3 + J,) to begin from; all are tried at the first size, and the one of
            the largest V goes on.
        near: (2,) search only around this place.
        from_level: entry of ``LEVELS`` to begin with; a good start needs no coarse one.

    Returns:
        None where the mask is empty or nothing was there to start from.

    """
    best: Match | None = None
    tried = starts
    for length, blur, rounds in LEVELS[from_level:]:
        scale = min(1.0, length / model.length_px)
        window = window_of(frame, model, near, scale)
        if window is None or not tried:
            return best
        target = Target(frame, window, blur)
        view = TopViewFit(target, model)
        stiffness = STIFFNESS * (4.0 / model.joints) ** 3 * model.length_px * scale
        ends = [
            refine(
                view.picture,
                target.soft_area,
                start,
                rounds=rounds,
                nudge=1.0 / scale,
                stiffness=stiffness,
            )
            for start in tried
        ]
        best_end = max(ends, key=view.value)
        best = Match(best_end, view.value(best_end))
        tried = [best_end]
        if scale >= 1.0 and blur <= LEVELS[-1][1]:
            break
    return best


def refine(
    picture: Callable[[Floats], Singles],
    target: Singles,
    start: Floats,
    *,
    rounds: int,
    nudge: float = 1.0,
    stiffness: float = 0.0,
) -> Floats:
    """Parameters near ``start`` whose picture differs least from the silhouette.

    Levenberg and Marquardt, derivatives by differences.

    Args:
        picture: the blurred area of parameters (P,).
        target: the blurred silhouette.
        start: (P,) two positions in pixels, then angles in rad.
        rounds: the largest number of steps.
        nudge: pixels of the frame per pixel of the canvas, for the derivative.
        stiffness: cost, per rad squared, of spine angles that alternate; a noisy outline shows
            little of them.

    """
    count = len(start)
    size = np.full(count, _NUDGE_RAD)
    size[:2] = _NUDGE_PX * nudge
    point = np.array(start, dtype=float)
    kinks = stiffness * _alternation(len(start))
    difference = target - picture(point)
    cost = float(np.vdot(difference, difference)) + float(point @ kinks @ point)
    damping = 1e-2
    for _ in range(rounds):
        slope = np.empty((count, difference.size), dtype=np.float32)
        for k in range(count):
            step = np.zeros_like(point)
            step[k] = size[k]
            slope[k] = ((picture(point + step) - picture(point - step)) * 0.5).ravel()
        units = np.outer(size, size)
        square = np.asarray(slope @ slope.T, dtype=float) + kinks * units
        pull = np.asarray(slope @ difference.ravel(), dtype=float) - (kinks @ point) * size
        gained = 0.0
        for _ in range(4):
            damped = square + damping * np.diag(np.diag(square) + 1e-3 * np.trace(square))
            step = np.clip(np.linalg.solve(damped, pull), -12.0, 12.0) * size
            away = target - picture(point + step)
            trial_cost = float(np.vdot(away, away)) + float((point + step) @ kinks @ (point + step))
            if trial_cost < cost:
                gained = cost - trial_cost
                point = point + step
                difference = away
                cost = trial_cost
                damping = max(damping / 5.0, 1e-4)
                break
            damping *= 5.0
        if gained < 1e-3 * cost:
            break
    return point


def _alternation(parameters: int) -> Floats:
    """(P, P) squared second difference of the spine angles, and a little of their size."""
    joints = parameters - 3
    second = np.diff(np.eye(joints), n=2, axis=0) if joints > 2 else np.zeros((1, joints))
    square = np.zeros((parameters, parameters))
    square[3:, 3:] = second.T @ second + 0.1 * np.eye(joints)
    return square
