"""Summary of a path: its slopes, roughness and bends."""

from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.terrain.bends import sharpest_bend
from snakewalk.controller.terrain.path import SplinePath
from snakewalk.controller.terrain.planner import TerrainPlanner

_STEP_M = 0.02


@dataclass(frozen=True)
class PathRelief:
    """A path's ground and bends, over samples every two centimetres."""

    length_m: float
    """Arc length in the horizontal plane."""
    median_slope_rad: float
    """Median slope of the plane fitted in the planner's slope window."""
    max_slope_rad: float
    """Largest such slope; the planner bounds it."""
    median_surface_slope_rad: float
    """Median inclination of the surface itself, with no window."""
    world_median_slope_rad: float
    """Median over the whole world, for comparison."""
    mean_variance_m2: float
    """Mean elevation variance in the planner's variance window."""
    safe_node_share: float
    """Safe nodes over all nodes inside the margin; 1 on a flat floor."""
    climb_m: float
    """Highest less lowest elevation."""
    min_radius_m: float
    """Least radius of curvature; infinite on a straight path."""


def slopes_rad(planner: TerrainPlanner, path: SplinePath) -> Floats:
    """(n,) windowed slope every two centimetres along a path; zeros on a flat floor."""
    at = path.position(_samples(path))
    if planner.relief is None:
        return np.zeros(len(at))
    return planner.relief.slope_rad(*at.T)


def path_relief(planner: TerrainPlanner, path: SplinePath) -> PathRelief:
    """Summarise a path on the planner's ground."""
    slope = slopes_rad(planner, path)
    surface = variance = z = world = np.zeros(1)
    share = 1.0
    if planner.relief is not None and planner.graph is not None:
        ground, at = planner.relief.ground, path.position(_samples(path))
        surface, z = ground.slope_rad(*at.T), ground.elevation_m(*at.T)
        variance = planner.relief.variance_m2(*at.T)
        rows, columns = ground.z_m.shape
        x = ground.x0_m + np.arange(columns) * ground.spacing_m
        y = ground.y0_m + np.arange(rows) * ground.spacing_m
        world = planner.relief.slope_rad(*np.meshgrid(x, y))
        share = planner.graph.safe_share
    return PathRelief(
        length_m=path.length_m,
        median_slope_rad=float(np.median(slope)),
        max_slope_rad=float(slope.max()),
        median_surface_slope_rad=float(np.median(surface)),
        world_median_slope_rad=float(np.median(world)),
        mean_variance_m2=float(variance.mean()),
        safe_node_share=share,
        climb_m=float(np.ptp(z)),
        min_radius_m=sharpest_bend(path)[0],
    )


def _samples(path: SplinePath) -> Floats:
    return np.linspace(0.0, path.length_m, max(2, int(path.length_m / _STEP_M) + 1))
