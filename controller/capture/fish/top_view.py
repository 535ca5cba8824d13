"""One frame from above: a posture searched coarse to fine, [TH] 3.3.3."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from snakewalk.config.arrays import Floats
from snakewalk.controller.capture.fish.matching import EDGE_WEIGHT, SilhouetteFrame, Target
from snakewalk.controller.capture.fish.model import FishModel
from snakewalk.controller.capture.fish.raster import Window
from snakewalk.controller.capture.fish.refine import refine

LEVELS = ((70.0, 5, 6), (140.0, 3, 6), (260.0, 3, 6))
"""Coarse to fine: body length on the canvas (px), width of edges (px), rounds at most."""
STIFFNESS = 0.15
"""Cost of a spine that goes to and fro, per px of body length on the canvas, with four angles; with
more it falls with the cube of their number, since a wave then turns back within fewer of them."""
_FOLDED_RAD = 1.5


@dataclass(frozen=True, slots=True)
class Match:
    """A posture and how well it explains the frame."""

    parameters: Floats
    """(3 + J,) base x, base y (px, y up), head direction, spine angles (rad)."""
    value: float
    """V of Eq. 3."""


def window_of(
    seen: SilhouetteFrame, model: FishModel, near: Floats | None, scale: float
) -> Window | None:
    """The part of a frame where the fish may be: around the mask, or around ``near`` (x, y)."""
    rows, columns = seen.mask.shape
    low_x, high_x, low_y, high_y = 0, columns, 0, rows
    if near is not None:
        reach = round(1.25 * model.length_px)
        column, row = round(float(near[0])), round(-float(near[1]))
        low_x, high_x = max(column - reach, 0), min(column + reach, columns)
        low_y, high_y = max(row - reach, 0), min(row + reach, rows)
        if high_x - low_x < 2 or high_y - low_y < 2:
            return None
    part = seen.mask[low_y:high_y, low_x:high_x]
    tall, wide = np.flatnonzero(part.any(axis=1)), np.flatnonzero(part.any(axis=0))
    if len(tall) == 0:
        return None
    edge = max(8, round(0.15 * model.length_px))
    left, top = max(low_x + int(wide[0]) - edge, 0), max(low_y + int(tall[0]) - edge, 0)
    right = min(low_x + int(wide[-1]) + edge, columns)
    bottom = min(low_y + int(tall[-1]) + edge, rows)
    return Window(left, top, right - left, bottom - top, scale)


class TopView:
    """A frame at one size, as a function of the posture's parameters (3 + J,)."""

    def __init__(self, target: Target, model: FishModel, pitch_rad: float, weight: float) -> None:
        self._target, self._model = target, model
        self._pitch_rad, self._weight = pitch_rad, weight

    def outline(self, at: Floats) -> Floats:
        """(n, 2) outline of parameters."""
        model = self._model
        return model.outline(model.midline(at[:2], float(at[2]), at[3:], self._pitch_rad))

    def picture(self, at: Floats) -> NDArray[np.float32]:
        """Blurred area of parameters."""
        return self._target.soft(self.outline(at))

    def value(self, at: Floats) -> float:
        """V of Eq. 3; a folded spine is worth nothing."""
        if np.abs(at[3:]).max() > _FOLDED_RAD:
            return float("-inf")
        return self._target.value(self.outline(at), self._weight)


def search(
    seen: SilhouetteFrame,
    model: FishModel,
    starts: list[Floats],
    *,
    pitch_rad: float = 0.0,
    weight: float = EDGE_WEIGHT,
    near: Floats | None = None,
    from_level: int = 0,
) -> Match | None:
    """Best posture of a frame.

    Args:
        seen: the frame.
        model: the fish.
        starts: parameters (3 + J,) to begin from; all are tried at the first size, and the one of
            the largest V goes on.
        pitch_rad: how far the head is lifted, if a side view says so.
        weight: W of Eq. 3.
        near: (2,) look only around here.
        from_level: entry of ``LEVELS`` to begin with; a good start needs no coarse one.

    Returns:
        None where the mask is empty or nothing was there to start from.

    """
    best: Match | None = None
    tried = starts
    for length, blur, rounds in LEVELS[from_level:]:
        scale = min(1.0, length / model.length_px)
        window = window_of(seen, model, near, scale)
        if window is None or not tried:
            return best
        target = Target(seen, window, blur)
        view = TopView(target, model, pitch_rad, weight)
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
        found = max(ends, key=view.value)
        best = Match(found, view.value(found))
        tried = [found]
        if scale >= 1.0 and blur <= LEVELS[-1][1]:
            break
    return best
