"""Where no waypoint may be set: off the ground, in an obstacle."""

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.config.world import (
    CorridorObstacle,
    PegsObstacle,
    PipeObstacle,
    PoleObstacle,
)
from snakewalk.controller.run.factory import prepare_walk


@pytest.mark.parametrize(
    ("run", "inside_m", "outside_m", "size"),
    [
        ("flat-slalom", (5.9, -5.9), (6.1, 0.0), "12.0 m by 12.0 m"),
        ("ramp-10-up", (0.0, 3.9), (0.0, 4.1), "8.0 m by 8.0 m"),
    ],
)
def test_a_waypoint_is_on_the_ground(
    run: str, inside_m: tuple[float, float], outside_m: tuple[float, float], size: str
) -> None:
    prepared = prepare_walk(run, motion="serpenoid")
    prepared.check_waypoint(np.array(inside_m))
    with pytest.raises(InputError, match=f"is outside the world, {size}"):
        prepared.check_waypoint(np.array(outside_m))


@pytest.mark.parametrize(
    ("obstacle", "in_it_m", "beside_m"),
    [
        (CorridorObstacle(width_m=0.4, at_m=(1.0, 0.0)), (2.9, -0.22), (2.9, -0.18)),
        (CorridorObstacle(width_m=0.4, at_m=(1.0, 0.0)), (-0.9, 0.21), (3.1, 0.22)),
        (PegsObstacle(spacing_m=0.5, rows=1, row_pegs=3), (0.02, 0.375), (0.05, 0.375)),
        (PoleObstacle(radius_m=0.1, at_m=(0.5, 0.0)), (0.55, 0.05), (0.55, 0.1)),
        (PipeObstacle(radius_m=0.2, at_m=(0.5, 0.0)), (0.6, 0.1), (0.75, 0.0)),
    ],
)
def test_a_waypoint_is_not_in_an_obstacle(
    obstacle: CorridorObstacle | PegsObstacle | PoleObstacle | PipeObstacle,
    in_it_m: tuple[float, float],
    beside_m: tuple[float, float],
) -> None:
    prepared = prepare_walk("flat-slalom", motion="serpenoid")
    object.__setattr__(prepared, "world", prepared.world.model_copy(update={"obstacle": obstacle}))
    prepared.check_waypoint(np.array(beside_m))
    with pytest.raises(InputError, match=f"is in the world's obstacle, the {obstacle.kind}"):
        prepared.check_waypoint(np.array(in_it_m))
