"""Grounds for the planner, drawn by seed: rotated crops, ramps, valleys and walls in turn."""

from collections.abc import Iterator
from contextlib import suppress
from typing import Final

import numpy as np
from scipy.ndimage import map_coordinates

from snakewalk.config.errors import InputError
from snakewalk.config.ground import _elevation_m
from snakewalk.config.heightfield import HeightField
from snakewalk.config.world import PlannerConfig
from snakewalk.controller.terrain.in_steps import Steps, at_once
from snakewalk.controller.terrain.path import SplinePath
from snakewalk.controller.terrain.planner import TerrainPlanner

KINDS: Final = ("rotated crop", "ramp", "valley", "walls")
HALF_M: Final = 4.0


def drawn_ground(seed: int) -> tuple[str, HeightField, PlannerConfig]:
    """Return the kind of a ground of 8 m by 8 m, the ground, and the limits of its paths."""
    chance = np.random.default_rng([seed, 640])
    kind = KINDS[seed % len(KINDS)]
    spacing_m = float(chance.choice([0.03, 0.05, 0.1]))
    axis = np.arange(-HALF_M, HALF_M + spacing_m / 2, spacing_m)
    x, y = np.meshgrid(axis, axis)
    turn = chance.uniform(0.0, 2.0 * np.pi)
    along, across = np.cos(turn) * x + np.sin(turn) * y, np.cos(turn) * y - np.sin(turn) * x
    config = PlannerConfig()
    match kind:
        case "rotated crop":
            model_m = _elevation_m("drawn", "jacksboro")
            row, column = (chance.uniform(40.0, size - 40.0) for size in model_m.shape)
            places = [row + across / 0.18, column + along / 0.18]
            z_m = 0.002 * map_coordinates(model_m, places, order=3, mode="nearest")
            config = PlannerConfig(
                variance_limit_m2=5e-3, slope_limit_rad=0.4, climb_limit_rad=0.35
            )
        case "ramp":
            rise = np.tan(np.radians(chance.uniform(8.0, 18.0)))
            z_m = rise * np.clip(along + 1.5, 0.0, 3.0)
            config = PlannerConfig(
                variance_limit_m2=1e-2, slope_limit_rad=0.35, climb_limit_rad=0.3
            )
        case "valley":
            rise = np.tan(np.radians(chance.uniform(10.0, 30.0)))
            z_m = rise * np.minimum(np.abs(across + 0.5 * np.sin(along)), 2.0)
            config = PlannerConfig(variance_limit_m2=1e-2)
        case _:
            z_m = np.zeros(x.shape)
            for place in (-2.0, 0.0, 2.0):
                door = chance.uniform(-3.0, 3.0)
                wide = chance.uniform(0.3, 0.8)
                is_wall = (np.abs(along - place) < 0.1) & (np.abs(across - door) > wide)
                z_m = np.where(is_wall, 0.3, z_m)
    return kind, HeightField(z_m - z_m.min(), spacing_m, -HALF_M, -HALF_M), config


def drawn_requests(seed: int, planner: TerrainPlanner) -> Iterator[Steps[SplinePath]]:
    """Yield plans in steps through three safe points: from a drawn head, and with stalls near it.

    Before them a path is planned from a fourth point, as at the start of a run.
    """
    assert planner.graph is not None
    chance = np.random.default_rng([seed, 641])
    safe = planner.graph.nodes_m
    route = safe[chance.choice(len(safe), 4, replace=False)]
    head = route[:2].mean(axis=0) + chance.normal(0.0, 0.3, 2)
    stalls = head + chance.normal(0.0, 0.3, (int(chance.integers(1, 4)), 2))
    heading_rad = float(chance.uniform(-np.pi, np.pi))
    with suppress(InputError):
        at_once(planner.in_steps(route))
    points_m = np.vstack([head, route[1:]])
    yield planner.in_steps(points_m, heading_rad)
    yield planner.in_steps(points_m, heading_rad, avoid_m=stalls)
