"""Base of the runs along a path over the ground."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from snakewalk.config.arrays import Bools, Floats
from snakewalk.config.errors import InputError
from snakewalk.config.world import FlatGround, WaterGround
from snakewalk.controller.run.prepared_run import GroundedRun
from snakewalk.controller.terrain.path import SplinePath
from snakewalk.controller.terrain.planner import TerrainPlanner


@dataclass(frozen=True)
class PathRun(GroundedRun):
    """Base of prepared runs along a path that is planned through waypoints."""

    @cached_property
    def planner(self) -> TerrainPlanner:
        """Plans paths over safe ground."""
        return TerrainPlanner(self.ground_ahead, self.world.planner)

    @cached_property
    def path(self) -> SplinePath:
        """Through the start and the waypoints."""
        return self.planner.plan(np.vstack([self.run.start_m, self.run.waypoints_m]))

    def path_length_m(self) -> float:
        """Return the length of the path."""
        return self.path.length_m

    def check_waypoint(self, point_m: Floats) -> None:
        """Reject a point (2,) off the ground or in an obstacle; paths are not checked.

        Raises:
            InputError: with the fault.

        """
        x_m, y_m = (float(coordinate) for coordinate in point_m)
        where = f"waypoint ({x_m:.2f}, {y_m:.2f})"
        if not self.on_map(point_m):
            wide_m = self._map_size_m
            raise InputError(
                f"{where} is outside the world, {wide_m[0]:.1f} m by {wide_m[1]:.1f} m"
            )
        obstacle = self.world.obstacle
        if obstacle is not None and obstacle.is_blocked_at(x_m, y_m):
            raise InputError(f"{where} is in the world's obstacle, the {obstacle.kind}")

    def on_map(self, points_m: Floats) -> Bools:
        """Whether points (..., 2) are on the world's ground: (...)."""
        ground = self.world.ground
        if isinstance(ground, FlatGround | WaterGround):
            return np.asarray(np.abs(points_m).max(axis=-1) <= 0.5 * ground.size_m)
        assert self.ground is not None
        return self.ground.contains(points_m[..., 0], points_m[..., 1])

    @property
    def _map_size_m(self) -> tuple[float, float]:
        ground = self.world.ground
        if isinstance(ground, FlatGround | WaterGround):
            return ground.size_m, ground.size_m
        assert self.ground is not None
        return self.ground.size_m

    @property
    def start_heading_rad(self) -> float:
        """Mean heading of the body at the start."""
        given = self.run.start_heading_rad
        return self.path.heading_rad(0.05) if given is None else given
