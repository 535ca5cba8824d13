"""Backlash of a servo's gears, in closed form, and Goal Current as the limit of the torque."""

import math

import numpy as np
import pytest

from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.backlash import GAP, SIDE
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant
from snakewalk.sim.servo.motor import MOTORS, Gearbox, make_drive, p_gain_per_rad
from tests.helpers.bus import write

XM430 = MOTORS["XM430-W350"]
DEGREE = math.radians(1.0)


def gear(backlash_rad: float, dry_n_m: float = 0.0, armature_kg_m2: float = 0.01) -> Gearbox:
    none = (0.0, 0.0, 0.3, 0.0, 0.0, 0.0)
    return Gearbox(armature_kg_m2, dry_n_m, *none, backlash_rad=backlash_rad)


@pytest.mark.parametrize("backlash_rad", [0.0, 0.3 * DEGREE, DEGREE, 3.0 * DEGREE])
def test_a_shaft_moves_by_the_backlash_when_its_load_reverses(backlash_rad: float) -> None:
    """The gears hold a heavy rotor, so only the play is left for the shaft, at any step."""
    for step_s in (1e-3, 3e-4):
        held = gear(backlash_rad, dry_n_m=0.2, armature_kg_m2=100.0)
        plant = BenchPlant(1, gear=held, step_s=step_s)
        drive, places = make_drive([XM430], 12.0), []
        for load_n_m in (0.05, -0.05, 0.05):
            plant.set_load([0], load_n_m)
            plant.advance(plant.time_s + 1.0, drive)
            assert plant.velocity_rad_s[0] == 0.0
            places.append(plant.position_rad[0])
        assert places[0] == pytest.approx(0.5 * backlash_rad, abs=1e-6)
        assert places[0] - places[1] == pytest.approx(backlash_rad, abs=1e-6)
        assert places[2] == pytest.approx(places[0], abs=1e-6)


def test_a_servo_that_is_loaded_one_way_moves_as_without_backlash() -> None:
    plants = [
        BenchPlant(1, gear=gear(backlash_rad), load_n_m=lambda q: np.full_like(q, -0.5))
        for backlash_rad in (0.0, DEGREE)
    ]
    places = []
    for plant in plants:
        drive = make_drive([XM430], 12.0)
        drive.torque_on[:], drive.p_gain_per_rad[:] = 1.0, p_gain_per_rad(800, XM430)
        plant.advance(4.0, drive)
        rows = []
        for k in range(400):
            drive.goal_rad[:] = 0.5 * math.sin(0.02 * k)
            plant.advance(4.0 + 0.01 * k, drive)
            rows.append(plant.position_rad[0])
        places.append(rows)
    np.testing.assert_allclose(places[1], places[0], atol=1e-9)
    assert plants[1]._play[SIDE, 0] == 1.0


def test_a_motor_crosses_the_gap_under_its_own_inertia() -> None:
    """From one tooth to the other under a constant torque: t = sqrt(2 backlash J / torque)."""
    torque_n_m, inertia = 0.05, 0.01
    plant = BenchPlant(1, gear=gear(DEGREE, armature_kg_m2=inertia), step_s=1e-5)
    drive = make_drive([XM430], 12.0)
    drive.torque_on[:], drive.p_gain_per_rad[:], drive.goal_rad[:] = 1.0, 1.0, -1e9
    drive.current_limit_a[:] = torque_n_m / XM430.torque_constant_n_m_a
    while plant._play[SIDE, 0] == 0.0:
        plant.advance(plant.time_s + 1e-5, drive)
    plant._play[:, 0] = -0.5 * DEGREE, 0.0, 0.0
    plant._velocity[:], drive.goal_rad[:], start_s = 0.0, 1e9, plant.time_s
    while plant._play[SIDE, 0] == 0.0:
        plant.advance(plant.time_s + 1e-5, drive)
    expected_s = math.sqrt(2.0 * DEGREE * inertia / torque_n_m)
    assert plant.time_s - start_s == pytest.approx(expected_s, rel=1e-3)


def test_an_impact_keeps_the_momentum_and_takes_energy() -> None:
    inertia, shaft_kg_m2, speed = 0.01, 0.004, 2.0
    plant = BenchPlant(
        1, inertia_kg_m2=shaft_kg_m2, gear=gear(DEGREE, armature_kg_m2=inertia), step_s=1e-4
    )
    plant._play[:, 0] = 0.0, speed, 0.0
    plant.advance(0.1, make_drive([XM430], 12.0))
    common = inertia * speed / (inertia + shaft_kg_m2)
    assert plant.velocity_rad_s[0] == pytest.approx(common, rel=1e-12)
    assert plant._play[GAP, 0] == 0.5 * DEGREE
    after_s = 0.1 - 0.5 * DEGREE / speed
    assert plant.position_rad[0] == pytest.approx(common * after_s, rel=1e-9)


@pytest.mark.parametrize("model", ["XM430-W350", "XL330-M288"])
@pytest.mark.parametrize("backlash_rad", [0.0, DEGREE])
def test_mode_5_never_pushes_more_than_its_goal_current(model: str, backlash_rad: float) -> None:
    """A step of the goal into a stop, and a load that turns the shaft back: mode 5 gives way."""
    raw, motor = 60, MOTORS[model]
    most_n_m = raw * motor.current_unit_a * motor.torque_constant_n_m_a

    def stop(q: np.ndarray) -> np.ndarray:
        return np.where(q > 0.3, -50.0 * (q - 0.3), 0.0)

    plant = BenchPlant(1, gear=gear(backlash_rad), load_n_m=stop)
    line = SimLine(ServoBank([1], model), plant)
    for address, value, size in ((11, 5, 1), (64, 1, 1), (102, raw, 2), (116, 3072, 4)):
        assert write(line, 1, address, value, size) == 0
    torque, drive = [], line.firmware.drive
    for goal in (3072, 1024, 2048):
        assert write(line, 1, 116, goal, 4) == 0
        for _ in range(250):
            line.clock.advance(0.002)
            line.settle()
            torque.append(drive.torque_n_m[0])
    assert np.abs(torque).max() == pytest.approx(most_n_m, rel=1e-9)
    assert np.abs(torque).max() <= most_n_m * (1.0 + 1e-12)
