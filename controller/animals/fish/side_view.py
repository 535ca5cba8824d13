"""The second camera: height and pitch from the side, given the posture from above, [TH] 3.3.4."""

from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.animals.fish.matching import LEAST_VALUE, SilhouetteFrame, Target
from snakewalk.controller.animals.fish.model import FishModel
from snakewalk.controller.animals.fish.pattern_search import pattern_search
from snakewalk.controller.animals.fish.raster import side_outline
from snakewalk.controller.animals.fish.top_view import window_of

_LIMIT_RAD = 1.2


@dataclass(frozen=True, slots=True)
class SideCamera:
    """Looks across the tank: its columns run along x of the top view, its rows down."""

    scale: float
    """Pixels of the side view per pixel of the top view."""
    offset_px: float
    """Column of the side view where the top view has column 0."""


def align(top: list[SilhouetteFrame], side: list[SilhouetteFrame], name: str) -> SideCamera:
    """Fit scale and offset to where the silhouettes begin and end along x in both views.

    Raises:
        InputError: fewer than two frames show the fish in both views, or it never moves along x
            nor has a length there.

    """
    top_ends, there = [], []
    for above, side_frame in zip(top, side, strict=True):
        wide = [np.flatnonzero(frame.mask.any(axis=0)) for frame in (above, side_frame)]
        if all(len(columns) for columns in wide):
            top_ends += [wide[0][0], wide[0][-1]]
            there += [wide[1][0], wide[1][-1]]
    if len(top_ends) < 4 or np.ptp(top_ends) < 10:
        raise InputError(f"{name}: the fish is not seen in both views at the same time")
    scale, offset = np.polyfit(np.array(top_ends, dtype=float), np.array(there, dtype=float), 1)
    left = np.array(there, dtype=float) - (scale * np.array(top_ends, dtype=float) + offset)
    if not 0.05 < scale < 20.0 or np.std(left) > 0.2 * np.ptp(there):
        raise InputError(
            f"{name}: the two views do not show the same motion along x; are they of one moment, "
            "and is the side camera upright?"
        )
    return SideCamera(float(scale), float(offset))


class SideView:
    """Searches height and pitch frame by frame, starting from the last ones."""

    def __init__(self, model: FishModel, camera: SideCamera) -> None:
        self._camera = camera
        self._model = model.sized(model.length_px * camera.scale)
        self.last: Floats | None = None
        """Height and pitch (2,) from which the next search starts; None searches everywhere."""

    def search(self, frame: SilhouetteFrame, parameters: Floats) -> tuple[Floats, float] | None:
        """Height of the base (px of the side view, up) and pitch (rad), and their V.

        Args:
            frame: of the side camera.
            parameters: (3 + J,) the posture from above.

        Returns:
            None where the side view shows nothing.

        """
        model = self._model
        window = window_of(frame, model, None, min(1.0, 180.0 / model.length_px))
        if window is None:
            self.last = None
            return None
        target = Target(frame, window, 3)

        def value(tilt: Floats) -> float:
            if abs(tilt[1]) > _LIMIT_RAD:
                return float("-inf")
            return target.value_of_pieces(self.pieces(parameters, tilt))

        rows = np.flatnonzero(frame.mask.any(axis=1))
        middle = -0.5 * float(rows[0] + rows[-1])
        fresh = [np.array([middle, pitch]) for pitch in (0.0, 0.3, -0.3)]
        steps = np.array([0.04 * model.length_px, 0.1])

        def best(starts: list[Floats]) -> tuple[Floats, float]:
            ends = [
                pattern_search(value, start, steps, halvings=5, evaluations=60) for start in starts
            ]
            return max(ends, key=lambda end: end[1])

        side_fit = best(fresh if self.last is None else [self.last])
        if side_fit[1] < LEAST_VALUE:
            side_fit = best(fresh)
        self.last = side_fit[0]
        return side_fit

    def pieces(self, parameters: Floats, side: Floats) -> list[Floats]:
        """Convex pieces in pixels of the side view, for a posture and (height, pitch)."""
        base = np.array(
            [parameters[0] * self._camera.scale + self._camera.offset_px, 0.0, float(side[0])]
        )
        head = float(parameters[2])
        midline = self._model.midline(base, head, parameters[3:], float(side[1]))
        return side_outline(self._model, midline, head)
