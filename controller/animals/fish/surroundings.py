"""Walls and other fish that a synthesised motion keeps away from."""

from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.animals.fish.postures import Postures


@dataclass(frozen=True, slots=True)
class Surroundings:
    """A tank, and the ways of other fish over the same time."""

    tank: Floats | None = None
    """(2, 2) lowest and highest x and y; None: no walls."""
    others: tuple[Floats, ...] = ()
    """(T, 2) positions of the base of the head of each other fish; after its end a fish stays."""
    apart: float = 0.0
    """Least distance from the walls and from the heads of other fish, in the recording's unit."""

    start: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Place and direction, in radians, from which the fish starts."""

    @property
    def any(self) -> bool:
        """Whether there are walls or other fish to avoid."""
        return self.tank is not None or bool(self.others)

    def clearance(self, path: Floats, start: int) -> float:
        """Return the smallest distance of a path (n, 2 or 3) from walls and fish.

        Args:
            path: places of the base of the head; negative distances are beyond a wall.
            start: frame of its first place.

        """
        plan = path[:, :2]
        least = np.inf
        if self.tank is not None:
            least = float(np.minimum(plan - self.tank[0], self.tank[1] - plan).min())
        frames = start + np.arange(len(plan))
        for other in self.others:
            there = other[np.minimum(frames, len(other) - 1)]
            least = min(least, float(np.hypot(*(plan - there).T).min()))
        return least

    def ahead(self, place: Floats, head_rad: float, start: int) -> float:
        """Return the distance from walls and fish of the place twice ``apart`` ahead."""
        step = 2.0 * self.apart * np.array([np.cos(head_rad), np.sin(head_rad)])
        return self.clearance((place[:2] + step)[None], start)

    def wall_distance(self, motion: Postures) -> float | None:
        """Return the smallest distance of the whole body from the walls; below 0 it is outside."""
        if self.tank is None:
            return None
        body = motion.points()
        return float(np.minimum(body - self.tank[0], self.tank[1] - body).min())

    def fish_distance(self, motion: Postures) -> float | None:
        """Return the smallest distance between the bases of the heads of this and other fish."""
        if not self.others:
            return None
        alone = Surroundings(None, self.others)
        return alone.clearance(motion.base, 0)


OPEN_WATER = Surroundings()
