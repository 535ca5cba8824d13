"""Level of detail and culling ([YT] 4.3 and 6): how much of each body a picture needs."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from snakewalk.config.arrays import Floats, Ints
from snakewalk.config.heightfield import HeightField
from snakewalk.controller.mechanics.ground_step import GroundStep
from snakewalk.controller.repertoire.crowd import Crowd
from snakewalk.sim.rendering.view_frustum import ViewFrustum

HIDDEN, FAR, MIDDLE, NEAR = range(4)
"""Levels: body frame alone, three segments, every second link, all links on the ground."""
NEAR_PX: Final = 110.0
MIDDLE_PX: Final = 45.0
"""Least apparent length of a body at these levels (ours)."""


def detail_levels(view: ViewFrustum, centre_m: Floats, length_m: Floats) -> Ints:
    """(N,) level of bodies with centres (N, 3) and lengths (N,).

    A single point is checked, with the frustum wider by half a body ([YT] 6): no body of which a
    part is in view is left out.
    """
    depth, across, up = view.in_camera(centre_m)
    focal_px = 0.5 * view.height_px / view.half_tan[1]
    size_px = focal_px * length_m / np.maximum(np.hypot(depth, np.hypot(across, up)), 1e-6)
    level = FAR + (size_px >= MIDDLE_PX).astype(int) + (size_px >= NEAR_PX)
    return np.where(view.touches(centre_m, 0.5 * length_m), level, HIDDEN)


@dataclass(frozen=True, slots=True)
class DetailedChain:
    """A body as detailed as it needs to be."""

    body: int
    level: int
    points_m: Floats
    """(n, 3) on the ground, head first: 4, one of two links, or all."""
    radius_m: Floats
    """(n,) there."""


class DetailedCrowd:
    """Lays the bodies of a crowd on a ground, each at its level."""

    def __init__(self, ground: HeightField, radius_m: Floats) -> None:
        """``radius_m`` (L,): half the recorded body's height at its links."""
        self._ground = ground
        self._radius_m = radius_m
        self._step = GroundStep(ground)
        last = len(radius_m) - 1
        self._kept = {
            FAR: np.linspace(0, last, 4).round().astype(int),
            MIDDLE: np.arange(0, last + 1, 2),
        }

    def chains(self, crowd: Crowd, levels: Ints) -> list[DetailedChain]:
        """Return the bodies that are not hidden.

        Near ones stand on the ground by the half circle of [PT] 2.6.5, which keeps their lengths;
        of others each point is lifted onto the ground.
        """
        found = []
        for body in np.flatnonzero(levels > HIDDEN).tolist():
            level = int(levels[body])
            scale = float(crowd.scale[body])
            links = crowd.link_m(body)
            if level == NEAR:
                radius = scale * self._radius_m
                chord = links[:-1, :2] - links[1:, :2]
                r = float(np.hypot(*chord.T).mean())
                angles = np.arctan2(chord[:, 1], chord[:, 0])
                points = self._step.place(angles, links[-1, :2], r, radius).points_m
            else:
                kept = self._kept[level]
                points = links[kept]
                radius = scale * self._radius_m[kept]
                points[:, 2] = self._ground.elevation_m(points[:, 0], points[:, 1]) + radius
            found.append(DetailedChain(body, level, points, radius))
        return found
