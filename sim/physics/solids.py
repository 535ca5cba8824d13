"""The cylinders and boxes of poles, pipes, pegs and walls, for physics and drawings."""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.world import (
    WALL_M,
    CorridorObstacle,
    Obstacle,
    PegsObstacle,
    PipeObstacle,
    PoleObstacle,
)
from snakewalk.drivers.attitude import about_up

STAVE_COUNT = 24
"""Number of boxes of a pipe: its wall is flat by less than 1 % of its radius."""
STAVE_M = 0.02
CLEAR_M = 0.2
"""Gap between the floor and the outside of a level solid."""
WOOD = (0.55, 0.42, 0.30, 1.0)
GLASS = (0.55, 0.68, 0.78, 0.22)
"""Red, green, blue, opacity (ours)."""


@dataclass(frozen=True, slots=True)
class Solid:
    """One part of an obstacle; a cylinder's axis is the third of its axes."""

    kind: Literal["cylinder", "box"]
    half_m: tuple[float, ...]
    """Radius and half length, or half edges."""
    centre_m: Floats
    """(3,) centre of the solid, m."""
    axes: Floats
    """(3, 3) axes of the solid, in columns."""
    colour: tuple[float, float, float, float]


def solids(thing: Obstacle) -> list[Solid]:
    """Parts of an obstacle, in the world."""
    upright = np.eye(3)
    if isinstance(thing, PegsObstacle):
        # as deep below z = 0 as high above it, for pegs in hollows
        size = (thing.radius_m, thing.height_m)
        return [
            Solid("cylinder", size, np.array([x, y, 0.0]), upright, WOOD)
            for x, y in thing.places_m()
        ]
    if isinstance(thing, CorridorObstacle):
        x, y = thing.at_m
        off_m = 0.5 * (thing.width_m + WALL_M)
        edges = (0.5 * thing.length_m, 0.5 * WALL_M, thing.height_m)
        return [
            Solid("box", edges, np.array([x, y + side * off_m, 0.0]), upright, WOOD)
            for side in (1.0, -1.0)
        ]
    middle = middle_m(thing)
    turn = upright if thing.upright else np.array([[0, 0, 1.0], [0, 1, 0], [-1, 0, 0]])
    if isinstance(thing, PoleObstacle):
        return [Solid("cylinder", (thing.radius_m, thing.length_m / 2), middle, turn, WOOD)]
    half = (thing.radius_m + STAVE_M) * math.tan(math.pi / STAVE_COUNT)
    out = thing.radius_m + STAVE_M / 2
    stave = (STAVE_M / 2, half, thing.length_m / 2)
    parts = []
    for angle in 2.0 * math.pi * np.arange(STAVE_COUNT) / STAVE_COUNT:
        axes = turn @ about_up(angle)
        parts.append(Solid("box", stave, middle + out * axes[:, 0], axes, GLASS))
    return parts


def middle_m(thing: PoleObstacle | PipeObstacle) -> Floats:
    """(3,) middle of the axis."""
    outer = thing.radius_m + (STAVE_M if isinstance(thing, PipeObstacle) else 0.0)
    height = thing.length_m / 2 if thing.upright else outer + CLEAR_M
    return np.array([*thing.at_m, height])
