"""What Newton and the books of energy promise, whatever the gait."""

from itertools import pairwise

import numpy as np
import pytest

from snakewalk.config.constants import GRAVITY_M_S2
from tests.helpers.physics import ROBOT, a_body, a_drive, momentum, serpenoid

ICE = (1e-9, 1e-9)
MASS_KG = ROBOT.mean_link_mass_kg * (ROBOT.joint_count + 1)


def throw(body, forward_m_s: float = 0.0, left_m_s: float = 0.0) -> None:
    """Give a body at rest a velocity."""
    mechanics = body.mechanics
    mechanics.data.qvel[:2] = forward_m_s, left_m_s
    mechanics.start_at_rest()


def swim(step_s: float) -> tuple[float, float, float]:
    """Largest momentum over mass (m/s), way of the centre (m), and spin (N m s) on ice in 3 s."""
    body, drive = a_body(ICE, step_s), a_drive()
    start = body.link_positions_m.mean(axis=0)
    creep = way = swung = 0.0
    for k in range(1, round(3.0 / step_s) + 1):
        drive.goal_rad[:] = serpenoid(k * step_s)
        body.advance(k * step_s, drive)
        linear, spin = momentum(body)
        centre = body.link_positions_m.mean(axis=0) - start
        creep = max(creep, float(np.hypot(*linear[:2])) / MASS_KG)
        way = max(way, float(np.hypot(*centre[:2])))
        swung = max(swung, abs(float(spin[2])))
    assert np.abs(body.position_rad).max() > 0.2  # it did swim
    return creep, way, swung


@pytest.mark.slow
def test_on_ice_no_motion_of_the_joints_moves_the_centre_of_mass() -> None:
    """But for the error of Euler's step, which is of first order: half the step, half of it."""
    long, short = np.array(swim(0.002)), np.array(swim(0.001))
    print(f"m/s, m, N m s: {long} at 2 ms, {short} at 1 ms")
    assert (long < [6e-3, 6e-3, 5e-5]).all()
    np.testing.assert_allclose(long / short, 2.0, rtol=0.05)


@pytest.mark.parametrize("step_s", [0.001, 0.002, 0.005])
def test_thrown_along_itself_it_stops_after_the_way_that_coulomb_gives(step_s: float) -> None:
    mu = 0.3
    body = a_body((mu, mu), step_s)
    x0 = body.link_positions_m[0, 0]
    throw(body, forward_m_s=1.0)
    body.advance(1.0, a_drive(torque_on=False))
    way = body.link_positions_m[0, 0] - x0
    assert way == pytest.approx(1.0 / (2.0 * mu * GRAVITY_M_S2), abs=1.0 * step_s)
    assert body.energy_j[1] < 1e-6


@pytest.mark.parametrize("step_s", [0.001, 0.002, 0.005])
def test_thrown_sideways_a_straight_body_ends_rolling_at_two_thirds(step_s: float) -> None:
    """A solid cylinder: sliding spins it up until ``v = 2/3 v0`` and nothing slips any more."""
    body = a_body((0.4, 0.4), step_s)
    throw(body, left_m_s=0.6)
    body.advance(1.0, a_drive())
    linear, _ = momentum(body)
    assert linear[1] / MASS_KG == pytest.approx(0.4, rel=0.01)
    spin = body.mechanics.data.qvel[3]
    assert spin * ROBOT.body_radius_m == pytest.approx(-0.4, rel=0.02)


def test_without_torque_motion_dies_and_never_grows() -> None:
    body, drive = a_body(), a_drive()
    for k in range(1, 101):
        drive.goal_rad[:] = serpenoid(0.02 * k)
        body.advance(0.02 * k, drive)
    drive.torque_on[:] = 0.0
    kinetic = [body.energy_j[1]]
    for k in range(1, 601):
        body.advance(2.0 + 0.002 * k, drive)
        kinetic.append(body.energy_j[1])
    assert kinetic[0] > 0.1
    assert all(after <= before + 1e-9 for before, after in pairwise(kinetic))
    assert kinetic[-1] < 0.02 * kinetic[0]  # the rest is in the rotors, which only the gears brake


@pytest.mark.fast_cases(2)
@pytest.mark.parametrize("step_s", [0.001, 0.002])
@pytest.mark.parametrize("hold_s", [0.002, 0.02])
@pytest.mark.parametrize("mu", [(0.1, 0.7), (0.4, 0.4)])
def test_motors_pay_for_friction_gears_and_motion(
    mu: tuple[float, float], hold_s: float, step_s: float
) -> None:
    """Shaft work is friction, gear drag and motion; electrical energy is heat, gears and shafts."""
    body, drive = a_body(mu, step_s), a_drive()
    before = sum(body.energy_j)
    for k in range(1, round(3.0 / hold_s) + 1):
        drive.goal_rad[:] = serpenoid(k * hold_s)
        body.advance(k * hold_s, drive)
    worked = float(drive.work_j.sum())
    spent = sum(body.mechanics.totals[[0, 2]]) + sum(body.energy_j) - before
    # k_t is that of the output shaft: what it lacks to k_e, the gears take
    passed_on = float((drive.back_emf_v_s / drive.torque_constant_n_m_a) @ drive.work_j)
    taken = float((drive.drawn_j - drive.returned_j).sum())
    used = float(drive.heat_j.sum()) + passed_on
    print(
        f"mu {mu}: motors {worked:.3f} J, {spent:.3f} J accounted for ({spent / worked - 1:+.2%}); "
        f"electrical {taken:.3f} J, {used:.3f} J accounted for ({used / taken - 1:+.2%})"
    )
    assert body.mechanics.totals[0] > 0.5 * worked > 0.0
    assert spent == pytest.approx(worked, rel=0.02)
    assert used == pytest.approx(taken, rel=0.005)
    assert float(drive.drawn_j.sum()) > worked


def test_an_undulation_pays_at_least_for_sliding_along_itself() -> None:
    """The ellipse takes no less than ``mu_along`` times load and sliding distance, whatever slides.

    A chain that only bends in the plane lies on all of its links. The load-weighted mean of their
    speeds is no less than the speed of the centre of mass, so the work at the shafts, which pays
    for all of it, is no less than ``mu_along`` times weight times the way of the centre.
    """
    mu_along = 0.1
    body, drive = a_body((mu_along, 0.7)), a_drive()
    hold_s, rest_s = 0.02, 1.0
    way_m, centre_m = 0.0, body.link_positions_m.mean(axis=0)
    for k in range(1, round(6.0 / hold_s) + 1):
        drive.goal_rad[:] = serpenoid(k * hold_s)
        body.advance(k * hold_s, drive)
        last_m, centre_m = centre_m, body.link_positions_m.mean(axis=0)
        way_m += float(np.hypot(*(centre_m - last_m)[:2]))
    drive.torque_on[:] = 0.0
    body.advance(6.0 + rest_s, drive)  # what is still in motion is not paid for twice
    bound_j = mu_along * MASS_KG * GRAVITY_M_S2 * way_m
    print(
        f"way {way_m:.2f} m: bound {bound_j:.2f} J, friction {body.mechanics.totals[0]:.2f} J, "
        f"shafts {drive.work_j.sum():.2f} J, electrical {drive.drawn_j.sum():.2f} J"
    )
    assert way_m > 1.0
    assert bound_j < body.mechanics.totals[0] < drive.work_j.sum() < drive.drawn_j.sum()
