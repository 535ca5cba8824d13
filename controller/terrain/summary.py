"""Summary of a path: its slopes, roughness and bends."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.terrain.path import SplinePath
from snakewalk.controller.terrain.planner import TerrainPlanner

_STEP_M = 0.02
_DISC_POINTS = 60
WAYPOINT_SLOPE_RAD = float(np.radians(8.0))
"""Steeper ground under a waypoint is warned of (ours): a straight body slides from 5.7 deg on."""


@dataclass(frozen=True)
class PathRelief:
    """A path's ground and bends, sampled every two centimetres."""

    length_m: float
    """Arc length in the horizontal plane."""
    median_slope_rad: float
    """Median slope of the plane fitted in the planner's slope window."""
    max_slope_rad: float
    """Largest slope of the plane fitted in the planner's slope window; the planner bounds it."""
    median_footprint_slope_rad: float
    """Median inclination of the surface in the strip that the body stands on, with no window."""
    max_footprint_slope_rad: float
    """Largest inclination of the surface in the strip that the body stands on."""
    max_up_slope_rad: float
    """Steepest climb: slope of the footprint's plane along the path."""
    max_side_slope_rad: float
    """Largest root mean square of the slope across the path over a footprint."""
    world_median_slope_rad: float
    """Median over the whole world, for comparison."""
    safe_node_share: float
    """Safe nodes over all nodes inside the margin; 1 on a flat floor."""
    climb_m: float
    """Highest less lowest elevation."""


def slopes_rad(planner: TerrainPlanner, path: SplinePath) -> Floats:
    """(n,) windowed slope every two centimetres along a path; zeros on a flat floor."""
    points = path.position(_samples(path))
    if planner.relief is None:
        return np.zeros(len(points))
    return planner.relief.slope_rad(*points.T)


def path_relief(planner: TerrainPlanner, path: SplinePath) -> PathRelief:
    """Summarise a path on the planner's ground."""
    slope = slopes_rad(planner, path)
    z = world = strip = np.zeros(1)
    steepest = np.zeros(2)
    share = 1.0
    if planner.relief is not None and planner.graph is not None:
        ground = planner.relief.ground
        points = path.position(_samples(path))
        z = ground.elevation_m(*points.T)
        strip = ground.slope_rad(*(points[:, None] + _disc_m(planner.relief.config.footprint_m)).T)
        ahead = np.gradient(points, axis=0)
        ahead = ahead / np.hypot(*ahead.T)[:, None]
        steepest = np.arctan(planner.graph.footprint.slopes(points, ahead).max(axis=-1))
        world = planner.relief.slope_rad(*np.meshgrid(*ground.axes_m))
        share = planner.graph.safe_share
    return PathRelief(
        length_m=path.length_m,
        median_slope_rad=float(np.median(slope)),
        max_slope_rad=float(slope.max()),
        median_footprint_slope_rad=float(np.median(strip)),
        max_footprint_slope_rad=float(strip.max()),
        max_up_slope_rad=max(float(steepest[0]), 0.0),
        max_side_slope_rad=float(steepest[1]),
        world_median_slope_rad=float(np.median(world)),
        safe_node_share=share,
        climb_m=float(np.ptp(z)),
    )


def path_warnings(
    planner: TerrainPlanner, relief: PathRelief, waypoints_m: Sequence[tuple[float, float]]
) -> tuple[str, ...]:
    """Warn of steep waypoints, and of slopes under the body that exceed the limit."""
    if planner.relief is None or planner.graph is None:
        return ()
    slopes = planner.graph.footprint.slope_rad(np.asarray(waypoints_m, float).reshape(-1, 2))
    warnings = [
        f"waypoint {k} ({x:.2f}, {y:.2f}) is on a slope of {np.degrees(slope):.1f} deg; "
        f"over {np.degrees(WAYPOINT_SLOPE_RAD):.0f} deg a body may slide past it"
        for k, ((x, y), slope) in enumerate(zip(waypoints_m, slopes, strict=True), start=1)
        if slope > WAYPOINT_SLOPE_RAD
    ]
    limit_rad = planner.relief.config.climb_limit_rad
    limit = f"the world's climb limit is {np.degrees(limit_rad):.1f} deg"
    if relief.max_up_slope_rad > limit_rad:
        warnings.append(f"the path climbs {np.degrees(relief.max_up_slope_rad):.1f} deg; {limit}")
    if relief.max_side_slope_rad > limit_rad:
        warnings.append(
            f"the path leads across {np.degrees(relief.max_side_slope_rad):.1f} deg; {limit}"
        )
    return tuple(warnings)


def _disc_m(width_m: float) -> Floats:
    """Offsets (k, 2) that fill a disc evenly, at the golden angle."""
    k = np.arange(_DISC_POINTS) + 0.5
    turn = k * np.pi * (3.0 - np.sqrt(5.0))
    radius = width_m / 2.0 * np.sqrt(k / _DISC_POINTS)
    return np.stack([radius * np.cos(turn), radius * np.sin(turn)], axis=-1)


def _samples(path: SplinePath) -> Floats:
    return np.linspace(0.0, path.length_m, max(2, int(path.length_m / _STEP_M) + 1))
