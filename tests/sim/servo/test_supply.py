"""Voltage along a chain of servos: cables between neighbours, leads of the supply."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot, with_keys
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant
from snakewalk.sim.servo.protection import SLICE_S, SupplyAndAmbient
from snakewalk.sim.servo.supply import Cabling

SOURCE_V, SOURCE_OHM = 12.0, 0.02


@given(st.integers(0, 2**32 - 1), st.integers(1, 40))
def test_every_ampere_that_a_servo_draws_comes_through_a_lead(seed: int, servos: int) -> None:
    """Kirchhoff: at each servo what comes in goes out, and no power is lost but in resistances."""
    rng = np.random.default_rng(seed)
    fed = rng.random(servos) < 0.3
    fed[rng.integers(servos)] = True
    lead_ohm = np.where(fed, rng.uniform(1e-3, 1.0, servos), np.inf)
    cabling = Cabling(rng.uniform(1e-3, 5.0, servos - 1), lead_ohm)
    at_zero_a, slope_s = rng.uniform(0.0, 1.0, servos), rng.uniform(0.0, 0.5, servos)
    servo_v = cabling.servo_v(SOURCE_V, SOURCE_OHM, at_zero_a, slope_s)
    drawn_a = at_zero_a + slope_s * servo_v
    rail_v = SOURCE_V - SOURCE_OHM * drawn_a.sum()
    lead_a, cable_a = (rail_v - servo_v) / lead_ohm, cabling.cable_a(servo_v)
    assert lead_a.sum() == pytest.approx(drawn_a.sum(), rel=1e-9, abs=1e-9)
    onward_a = np.append(cable_a, 0.0) - np.insert(cable_a, 0, 0.0)
    np.testing.assert_allclose(lead_a, drawn_a + onward_a, rtol=1e-8, atol=1e-8)
    lost_w = np.sum(cable_a**2 * cabling.cable_ohm) + np.sum(lead_a[fed] ** 2 * lead_ohm[fed])
    lost_w += SOURCE_OHM * drawn_a.sum() ** 2
    given_w, taken_w = SOURCE_V * lead_a.sum(), float(servo_v @ drawn_a)
    assert given_w == pytest.approx(taken_w + lost_w, rel=1e-8, abs=1e-8)


def test_an_even_chain_fed_at_its_head_falls_as_the_formula_says() -> None:
    servos, ohm, each_a = 16, 0.055, 0.1
    cabling = Cabling(np.full(servos - 1, ohm), np.where(np.arange(servos) == 0, 0.02, np.inf))
    k = np.arange(servos)
    expected = SOURCE_V - 0.02 * servos * each_a - ohm * each_a * (servos * k - k * (k + 1) / 2)
    np.testing.assert_allclose(cabling.servo_v(SOURCE_V, 0.0, each_a), expected, atol=1e-12)


def loaded(power: dict[str, object]) -> SimLine:
    """Four servos that push with half their output against shafts that are blocked."""
    four = {"joint_axes": "yyyy", "power": power}
    robot = with_keys(load_robot("yaw16"), four, "test")
    bank = ServoBank(robot.servo_ids)
    line = SimLine(bank, BenchPlant(4), supply_and_ambient=SupplyAndAmbient.of(robot))
    bank["Operating Mode"][:] = 16
    bank["Shutdown"][:] = 0
    line.firmware.apply_registers()
    bank["Torque Enable"][:] = 1
    bank["Goal PWM"][:] = 442
    line.firmware.block_shafts(np.arange(4))
    line.firmware.advance(10 * SLICE_S)
    return line


def test_present_input_voltage_falls_along_the_chain() -> None:
    line = loaded({"cable_ohm": 0.5})
    drive = line.firmware.drive
    line.firmware.refresh()
    tenths = line.bank["Present Input Voltage"].astype(int)
    assert list(tenths) == sorted(tenths, reverse=True)
    assert tenths[0] - tenths[3] > 10
    drawn_a = (442 / 885) ** 2 * drive.supply_v / drive.resistance_ohm + 0.04
    behind_a = np.cumsum(drawn_a[::-1])[::-1][1:]
    np.testing.assert_allclose(-np.diff(drive.supply_v), 0.5 * behind_a, rtol=1e-6)


def test_a_second_lead_lifts_the_far_end() -> None:
    one, both = (
        loaded({"cable_ohm": 0.5, "inject_ids": ids}).firmware.drive.supply_v
        for ids in ([1], [1, 4])
    )
    assert both.min() > one.min() + 0.5
    assert both[0] == pytest.approx(both[3], abs=0.01)


def test_a_cable_that_takes_nearly_all_leaves_the_chain_calm() -> None:
    """Its voltage settles: it does not swing between full and none from one check to the next."""
    line = loaded({"cables_ohm": [0.05, 20.0, 0.05]})
    drive, seen = line.firmware.drive, []
    for k in range(6):
        line.firmware.advance((20 + k) * SLICE_S)
        seen.append(drive.supply_v.copy())
    assert seen[-1][2] < 6.0
    assert np.ptp(np.array(seen), axis=0).max() < 0.05


def test_the_voltage_that_a_servo_measures_follows_the_current_at_once() -> None:
    """It was that of the last check, up to 50 ms ago: the step of a current was not to be seen."""
    line = SimLine(
        ServoBank([1, 2]), BenchPlant(2), supply_and_ambient=SupplyAndAmbient(supply_ohm=2.0)
    )
    firmware, measured = line.firmware, line.bank["Present Input Voltage"]
    line.bank["Torque Enable"][:] = 1
    firmware.apply_registers()
    firmware.advance(10 * SLICE_S + 1e-3)
    firmware.refresh()
    rest = measured.copy()
    line.bank["Goal Position"][:] += 300
    firmware.apply_registers()
    firmware.advance(10 * SLICE_S + 3e-3)
    before_v = firmware.drive.supply_v.copy()
    firmware.refresh()
    assert (measured < rest - 10).all()
    np.testing.assert_array_equal(firmware.drive.supply_v, before_v)  # to read changes nothing


@pytest.mark.parametrize(
    ("power", "said"),
    [
        ({"inject_ids": [40]}, "ID 40 is not of this robot"),
        ({"inject_ids": [1, 1]}, "ID 1 is named twice"),
        ({"cables_ohm": [0.1]}, "16 servos have 15 cables between them"),
        ({"cables_ohm": [0.1] * 14 + [0.0]}, "each over 0 and at most 100"),
    ],
)
def test_a_table_that_does_not_fit_is_refused(power: dict[str, object], said: str) -> None:
    with pytest.raises(InputError, match=said):
        with_keys(load_robot("yaw16"), {"power": power}, "test")
