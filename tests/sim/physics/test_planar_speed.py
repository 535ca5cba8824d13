"""The plant against the independent planar model of ``planar_reference``: speed and direction.

The servos lag, so the plant does not make the shape it is told. The reference is prescribed the
shape that the plant made: its joint angles after every step, by cubic splines.
"""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from snakewalk.sim.physics.body import belly_points_m
from tests.helpers.physics import HZ, ROBOT, Floats, a_body, a_drive, serpenoid
from tests.oracles.planar_reference import PlanarBody, simulate

SECONDS = 1.0 + 1.0 / HZ


def crawl(mu: tuple[float, ...], step_s: float) -> tuple[Floats, Floats, Floats]:
    """Times (T,), joint angles (T, J), and the centre of mass (T, 2) from 0."""
    body, drive = a_body(mu, step_s), a_drive()
    steps = round(SECONDS / step_s)
    joints = np.zeros((steps + 1, ROBOT.joint_count))
    centre = np.zeros((steps + 1, 2))
    origin = body.link_positions_m[:, :2].mean(axis=0)
    for k in range(1, steps + 1):
        drive.goal_rad[:] = serpenoid((k - 1) * step_s)
        body.advance(k * step_s, drive)
        joints[k] = body.position_rad
        centre[k] = body.link_positions_m[:, :2].mean(axis=0) - origin
    return np.arange(steps + 1) * step_s, joints, centre


def reference(mu: tuple[float, ...], time_s: Floats, joints: Floats, at_s: Floats) -> Floats:
    """Centre of mass (len(at_s), 2) of a body that makes these shapes."""
    m, r, length = ROBOT.mean_link_mass_kg, ROBOT.body_radius_m, ROBOT.mean_link_length_m
    spin, points = m * (3 * r**2 + length**2) / 12, tuple(belly_points_m(ROBOT, 1)[0, :, 0])
    body = PlanarBody(
        ROBOT.joint_count + 1,
        length,
        m,
        spin,
        mu[0],
        mu[1],
        points_m=points,
        mu_back=mu[-1] if len(mu) > 2 else None,
    )
    still = np.zeros(ROBOT.joint_count)
    shape = CubicSpline(time_s, joints, bc_type=((1, still), "not-a-knot"))
    rate = shape.derivative()
    return simulate(body, lambda t: (shape(t), rate(t)), at_s).centre_m


@pytest.mark.slow_cases(1, "a planar model of each body: 3 s of CPU")
@pytest.mark.fast_cases(1)
@pytest.mark.costs("compares with an independent model over whole cycles")
@pytest.mark.parametrize(
    ("mu", "step_s"),
    [  # that of isotropic friction at 1 ms: below, backward with one of its own
        ((0.1, 0.7), 0.001),
        ((0.1, 0.7), 0.002),
        ((0.1, 0.7), 0.005),
        ((0.4, 0.4), 0.002),
        ((0.4, 0.4), 0.005),
    ],
)
def test_speed_is_that_of_the_independent_model(mu: tuple[float, float], step_s: float) -> None:
    """Within 2 % of the speed itself, also where that is small and backwards; 2.5 % at 5 ms."""
    time_s, joints, centre = crawl(mu, step_s)
    marks_s = np.array([0.0, 1.0, SECONDS])
    expected = reference(mu, time_s, joints, marks_s)
    way = expected[2] - expected[1]
    made = centre[-1] - centre[round(1.0 / step_s)]
    print(f"mu {mu} step {step_s * 1e3:g} ms: {made[0] / way[0] - 1.0:+.2%} of {way[0]:.4f} m")
    assert (way[0] > 0.15) if mu[0] < mu[1] else (way[0] < -0.015)
    assert made[0] == pytest.approx(way[0], rel=0.02 if step_s < 0.005 else 0.025)
    assert np.hypot(*(made - way)) < 0.02 * np.hypot(*way) + 0.003


@pytest.mark.slow_cases(1, "2 cases of 1.4 s of CPU")
@pytest.mark.slow
@pytest.mark.costs("compares with an independent model over whole cycles")
@pytest.mark.parametrize("mu", [(0.11, 0.2, 0.14), (0.4, 0.4, 0.8)])
def test_friction_backward_of_its_own_too(mu: tuple[float, float, float]) -> None:
    """The first is a milk snake's belly. (How far a link is thrown back tells the two apart.)"""
    time_s, joints, centre = crawl(mu, 0.001)
    marks_s = np.array([0.0, 1.0, SECONDS])
    expected = reference(mu, time_s, joints, marks_s)
    way, made = expected[2] - expected[1], centre[-1] - centre[1000]
    print(f"mu {mu}: {made[0] / way[0] - 1.0:+.2%} of {way[0]:.4f} m")
    assert made[0] == pytest.approx(way[0], rel=0.02)
