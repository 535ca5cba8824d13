"""The law of a servo's drive, against its closed form in each of its regions."""

from dataclasses import replace

import numpy as np
import pytest

from snakewalk.sim.plant import ServoDrive, shaft_torque

GAIN, LIMIT, SUPPLY_V, OHM, K_T, K_E = 8.0, 0.9, 12.0, 4.0, 1.5, 1.8


def law(
    off_rad: float, velocity_rad_s: float = 0.0, on: float = 1.0, limit_a: float = np.inf
) -> tuple[float, float, float]:
    """The law at 0.25 rad, ``off_rad`` before its goal."""
    motor = (SUPPLY_V, OHM, K_T, K_E)
    return shaft_torque(0.25, velocity_rad_s, on, 0.25 + off_rad, GAIN, LIMIT, *motor, limit_a)


@pytest.mark.parametrize("off_rad", [0.05, -0.05])
@pytest.mark.parametrize("velocity_rad_s", [0.0, 0.4, -0.4])
def test_within_its_limits_the_current_is_that_of_the_winding(
    off_rad: float, velocity_rad_s: float
) -> None:
    pwm, current_a, torque_n_m = law(off_rad, velocity_rad_s)
    assert pwm == pytest.approx(GAIN * off_rad)
    assert current_a == pytest.approx((GAIN * off_rad * SUPPLY_V - K_E * velocity_rad_s) / OHM)
    assert torque_n_m == pytest.approx(K_T * current_a)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_output_and_current_are_limited_on_both_sides(side: float) -> None:
    assert law(side * 1.0)[:2] == pytest.approx((side * LIMIT, side * LIMIT * SUPPLY_V / OHM))
    assert law(side * 1.0, limit_a=0.5) == pytest.approx((side * LIMIT, side * 0.5, side * 0.75))


def test_an_open_bridge_has_no_current_however_the_shaft_turns() -> None:
    assert law(0.3, 2.0, on=0.0) == (0.0, 0.0, 0.0)


def drive(joints: int = 3) -> ServoDrive:
    return ServoDrive(*(np.full(joints, float(k)) for k in range(9)))


def test_a_drive_begins_without_output_or_energy() -> None:
    servo = drive()
    assert all(column.shape == (3,) for column in servo.columns())
    for each in ("current_a", "torque_n_m", "pwm", "drawn_j", "returned_j", "heat_j", "work_j"):
        assert not getattr(servo, each).any()


@pytest.mark.parametrize("wrong", [np.zeros(2), np.zeros(3, int), np.zeros(6)[::2]])
def test_a_drive_of_other_arrays_is_rejected(wrong: np.ndarray) -> None:
    with pytest.raises(TypeError, match="contiguous float64 arrays of 3 joints"):
        replace(drive(), supply_v=wrong)
