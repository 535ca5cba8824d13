"""Paths that are planned in one piece."""

from typing import Any

from snakewalk.controller.terrain.in_steps import at_once
from snakewalk.controller.terrain.map_planner import MapPlanner
from snakewalk.controller.terrain.path import SplinePath
from snakewalk.controller.terrain.planner import TerrainPlanner


def whole_path(planner: TerrainPlanner | MapPlanner, *given: Any, **named: Any) -> SplinePath:
    """Do all steps of a plan."""
    return at_once(planner.in_steps(*given, **named))
