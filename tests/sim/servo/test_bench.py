"""What a bench's motors take in and do, in closed form."""

import numpy as np
import pytest

from snakewalk.sim.servo.bench import BenchPlant
from snakewalk.sim.servo.motor import MOTORS, make_drive, p_gain_per_rad

XM430 = MOTORS["XM430-W350"]


def test_a_motor_that_holds_a_load_only_heats() -> None:
    load_n_m = 0.5
    plant = BenchPlant(1, dry_n_m=0.0, load_n_m=lambda q: np.full_like(q, load_n_m))
    drive = make_drive([XM430], 12.0)
    drive.torque_on[:], drive.p_gain_per_rad[:] = 1.0, p_gain_per_rad(800, XM430)
    plant.advance(1.0, drive)
    heat_j, work_j, drawn_j = drive.heat_j.copy(), drive.work_j.copy(), drive.drawn_j.copy()
    plant.advance(3.0, drive)
    amps = load_n_m / XM430.torque_constant_n_m_a
    loss_j = 2.0 * XM430.resistance_ohm * amps**2
    assert drive.heat_j - heat_j == pytest.approx(loss_j, rel=1e-6)
    assert drive.drawn_j - drawn_j == pytest.approx(loss_j, rel=1e-6)
    assert drive.work_j - work_j == pytest.approx(0.0, abs=1e-9)


def test_a_motor_at_steady_speed_works_against_the_friction() -> None:
    viscous_n_m_s, far_rad = 0.1, 1e6
    plant = BenchPlant(1, dry_n_m=0.0, viscous_n_m_s=viscous_n_m_s)
    drive = make_drive([XM430], 12.0)
    drive.torque_on[:], drive.p_gain_per_rad[:], drive.goal_rad[:] = 1.0, 1.0, far_rad
    plant.advance(1.0, drive)
    work_j, taken_j = drive.work_j.copy(), drive.drawn_j.copy()
    plant.advance(2.0, drive)
    stiff = XM430.torque_constant_n_m_a / XM430.resistance_ohm
    speed = stiff * 12.0 / (viscous_n_m_s + stiff * XM430.back_emf_v_s)
    amps = viscous_n_m_s * speed / XM430.torque_constant_n_m_a
    assert drive.work_j - work_j == pytest.approx(viscous_n_m_s * speed**2, rel=1e-6)
    assert drive.drawn_j - taken_j == pytest.approx(12.0 * amps, rel=1e-6)
    assert drive.returned_j == 0.0
