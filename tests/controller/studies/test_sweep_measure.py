"""What a point is measured for, on the physics; closed forms for slip and energy."""

from dataclasses import replace

import pytest

from snakewalk.config.loader import load_world
from snakewalk.controller.studies.sweep_measure import Measurement, measure
from snakewalk.controller.studies.sweep_points import Point
from snakewalk.controller.studies.tune import Task, loss


@pytest.mark.slow
def test_undulation_advances_costs_and_slips_less_than_it_goes() -> None:
    point = Point("lateral-undulation", "yaw16", "flat", 0, 0, 6.0)
    row = measure(point)
    assert row.ended == "ran to its end"
    assert row.forward_bl_cycle is not None
    assert row.forward_bl_cycle > 0.3
    assert row.slip is not None
    assert 0.0 < row.slip < 0.6
    assert row.cost_of_transport is not None
    assert row.mechanical_cost is not None
    # sliding along itself costs mu_along at least, whatever the motion: the speeds of the links
    # have a load-weighted mean no less than that of their centre
    assert load_world("flat").friction.along < row.mechanical_cost < row.cost_of_transport < 2.0
    assert measure(point) == row  # the same point gives the same row
    other = measure(point, vary=1)
    assert other.speed_m_s != row.speed_m_s


def test_a_gait_that_a_robot_refuses_is_a_row_and_no_crash() -> None:
    point = Point("lateral-undulation", "yaw16", "flat", 0, 0, 4.0)
    row = measure(replace(point, parameters={"winding_rad": 1.4, "turn_rad": 2.5, "waves": 3.0}))
    assert row.ended.startswith("refused: ")


def test_unmeasured_points_never_win() -> None:
    row = ahead(1.0, 0.0)
    good = loss(row, SPEED)
    assert good == -1.0
    assert loss(replace(row, ended="refused: no"), SPEED) > good
    assert loss(replace(row, speed_m_s=None), SPEED) > good
    assert loss(replace(row, least_rate=0.9), SPEED) > good


def test_what_goes_elsewhere_is_another_gait() -> None:
    assert loss(ahead(0.8, 0.6), SPEED) == pytest.approx(-0.8)
    assert loss(ahead(-1.0, 0.0), SPEED) > 0.0
    assert loss(ahead(0.0, 1.0), SPEED) > 0.0


SPEED = Task("speed", "advance", (1.0, 0.0), 0.5)


def ahead(forward: float, left: float) -> Measurement:
    """A run at 1 m/s in this direction."""
    return Measurement(
        "ran to its end",
        speed_m_s=1.0,
        climb_m_s=0.0,
        least_rate=1.0,
        forward_bl_cycle=forward,
        left_bl_cycle=left,
    )
