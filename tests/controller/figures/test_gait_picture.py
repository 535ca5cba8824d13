"""Bodies of a gait over a cycle: only a rolling body moves to the side."""

import numpy as np
import pytest

from snakewalk.config.loader import load_robot
from snakewalk.controller.figures.gait import PHASES, bodies_m
from snakewalk.controller.gaits.registry import make_gait


def test_a_body_rolls_its_circumference_to_the_left_in_a_cycle() -> None:
    """The simulated run of six seconds, three cycles, ends 0.61 m to the left (0.57 here)."""
    robot = load_robot("alternating16")
    bodies = bodies_m(make_gait("rolling"), robot)
    assert bodies.rolled_m == pytest.approx(2.0 * np.pi * robot.body_radius_m, rel=1e-6)
    middle = robot.link_count // 2
    steps_m = np.diff(bodies.link_m[:, middle, 1])
    np.testing.assert_allclose(steps_m, bodies.rolled_m / PHASES, rtol=0.05)


@pytest.mark.parametrize("name", ["sidewinding", "lateral-undulation"])
def test_other_gaits_do_not_roll(name: str) -> None:
    assert bodies_m(make_gait(name), load_robot("alternating16")).rolled_m == pytest.approx(0.0)
