"""Sections of a path that a body cannot climb."""

import numpy as np
import pytest

from snakewalk.config.heightfield import HeightField
from snakewalk.controller.terrain.climb import steep_sections
from snakewalk.controller.terrain.path import SplinePath

LIMIT_RAD = float(np.radians(15.5))
BODY_M = 1.2


def ramp(slope_deg: float) -> HeightField:
    """A floor to x = 0, a plane that rises to x = 3, and a floor behind it."""
    x = np.arange(-4.0, 6.01, 0.05)
    z = np.tan(np.radians(slope_deg)) * np.clip(x, 0.0, 3.0)
    return HeightField(np.tile(z, (41, 1)), 0.05, -4.0, -1.0)


def test_a_plane_of_18_degrees_is_one_section_from_body_to_body() -> None:
    path = SplinePath([(-3.0, 0.0), (5.0, 0.0)])
    (found,) = steep_sections(path, ramp(18.0), BODY_M, LIMIT_RAD)
    assert np.degrees(found.slope_rad) == pytest.approx(18.0, abs=0.1)
    inside_m = BODY_M * (np.tan(LIMIT_RAD) / np.tan(np.radians(18.0)) - 0.5)
    assert found.begin_m == pytest.approx(3.0 + inside_m, abs=0.04)
    assert found.end_m == pytest.approx(6.0 - inside_m, abs=0.04)


@pytest.mark.parametrize(
    ("slope_deg", "points"),
    [
        (15.0, [(-3.0, 0.0), (5.0, 0.0)]),
        (18.0, [(5.0, 0.0), (-3.0, 0.0)]),  # down
        (18.0, [(1.5, -0.8), (1.5, 0.8)]),  # across
    ],
)
def test_gentle_planes_and_ways_down_or_across_are_not_reported(
    slope_deg: float, points: list[tuple[float, float]]
) -> None:
    assert steep_sections(SplinePath(points), ramp(slope_deg), BODY_M, LIMIT_RAD) == []


def test_a_step_lower_than_the_rise_of_a_body_is_not_reported() -> None:
    x = np.arange(-3.0, 3.01, 0.05)
    step = HeightField(np.tile(np.where(x > 0.0, 0.2, 0.0), (41, 1)), 0.05, -3.0, -1.0)
    path = SplinePath([(-2.5, 0.0), (2.5, 0.0)])
    assert steep_sections(path, step, BODY_M, LIMIT_RAD) == []
    assert steep_sections(path, step, 0.5, LIMIT_RAD)
