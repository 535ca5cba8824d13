"""Constants that were planted in another simulation come back inside their intervals."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from snakewalk.controller.studies.identification.pendulum_fit import error_deg, fit_pendulum
from snakewalk.controller.studies.identification.pendulum_log import PendulumLog
from snakewalk.controller.studies.identification.pendulum_swing import _GEAR, _swing, swing_rad
from snakewalk.controller.studies.identification.servo_constants import (
    CONSTANTS,
    NAMES,
    ServoConstants,
    ranges,
)
from tests.controller.studies.identification.conftest import (
    DELAY_S,
    PLANTED,
    TICK_RAD,
    swing,
)
from tests.helpers.tiers import slow_except


@pytest.fixture(scope="module")
def found(logs: list[PendulumLog]) -> ServoConstants:
    return fit_pendulum(logs, starts=6, hops=4)


@pytest.mark.parametrize("name", PLANTED)
def test_a_planted_constant_comes_back(found: ServoConstants, name: str) -> None:
    k = NAMES.index(name)
    assert found.low[k] <= PLANTED[name] <= found.high[k]


@pytest.mark.parametrize(
    "name",
    ["torque_constant_n_m_a", "resistance_ohm", "armature_kg_m2", "viscous_n_m_s", "dry_n_m"],
)
def test_what_the_logs_tell_is_told_narrowly(found: ServoConstants, name: str) -> None:
    k = NAMES.index(name)
    assert found.values[k] == pytest.approx(PLANTED[name], rel=0.03)
    assert found.high[k] - found.low[k] < 0.1 * PLANTED[name]


def test_what_is_left_is_the_encoder(found: ServoConstants, logs: list[PendulumLog]) -> None:
    # rounding to a tick is off by a quarter of it on average
    for log in logs:
        assert error_deg(found, log) < 1.5 * np.degrees(TICK_RAD) / 4.0


def test_squares_are_felt_only_where_motor_and_load_strive_against_each_other(
    logs: list[PendulumLog],
) -> None:
    """M6: of the weaker one while the other drives it; a motor that is off strives not."""
    values = np.array([c.start for c in CONSTANTS])
    values[NAMES.index("stribeck_rad_s")] = 2.0
    plain = swing_rad(values, logs[0])
    for name in ("by_motor_square", "by_load_square"):
        squared = values.copy()
        squared[NAMES.index(name)] = 0.5
        assert np.abs(swing_rad(squared, logs[0]) - plain).max() > 1e-3
    limp = replace(logs[0], torque_on=np.zeros(len(logs[0].time_s)))
    squared = values.copy()
    squared[-2:] = 0.5
    np.testing.assert_array_equal(swing_rad(squared, limp), swing_rad(values, limp))


def test_a_fit_leaves_squares_as_they_are_given(logs: list[PendulumLog]) -> None:
    given = np.array([c.start for c in CONSTANTS])
    given[-2:] = 0.02, 0.03
    unknown = np.full(len(given), np.nan)
    start = ServoConstants(given, unknown, unknown, "xl330")
    found = fit_pendulum(logs[1:2], start, starts=1, hops=0)
    np.testing.assert_array_equal(found.values[-2:], given[-2:])
    assert np.isnan(found.low[-2:]).all()


def test_without_full_output_a_strong_motor_is_not_told_from_a_quick_one(
    logs: list[PendulumLog],
) -> None:
    """More torque constant and P unit, and resistance by the square, move it alike."""
    found = fit_pendulum(logs[1:2], starts=2, hops=0)
    for name, times in (("torque_constant_n_m_a", 2.0), ("resistance_ohm", 4.0)):
        k = NAMES.index(name)
        assert found.low[k] < PLANTED[name] / times
        assert found.high[k] > PLANTED[name] * times
    k = NAMES.index("p_unit_per_rad")
    assert found.values[k] == pytest.approx(CONSTANTS[k].start)  # what is not told is as it was


def test_a_log_that_tells_little_has_wide_intervals(logs: list[PendulumLog]) -> None:
    found = fit_pendulum(logs[2:], starts=2, hops=0)  # one gain, never let go
    searched = ranges(logs[2].actuator)
    width = (found.high - found.low) / (searched.high - searched.low)
    assert width[NAMES.index("stribeck_exponent")] == 1.0
    resistance = NAMES.index("resistance_ohm")
    assert found.high[resistance] - found.low[resistance] > 0.1 * PLANTED["resistance_ohm"]


def test_a_free_pendulum_swings_at_its_frequency(logs: list[PendulumLog]) -> None:
    log = logs[0]
    values = np.array([c.start for c in CONSTANTS])
    for name in ("dry_n_m", "stribeck_n_m", "by_motor", "by_load", "viscous_n_m_s"):
        values[NAMES.index(name)] = 0.0
    for name in ("by_motor_slow", "by_load_slow", "armature_kg_m2"):
        values[NAMES.index(name)] = 0.0
    position = np.full(len(log.time_s), 0.01)
    free = PendulumLog(
        *(log.path, "", 0.5, 0.1, 400.0, log.time_s, log.goal_rad, position, log.supply_v),
        np.zeros(len(log.time_s)),
    )
    angle = swing_rad(values, free)
    expected = 0.01 * np.cos(np.sqrt(9.80665 / 0.1) * log.time_s)
    np.testing.assert_allclose(angle, expected, atol=1e-4)
    out = np.empty(50)
    rows = (free.time_s[:50], free.goal_rad[:50], free.supply_v[:50], free.torque_on[:50])
    _swing.py_func(values, values[_GEAR], *rows, 0.01, 0.5, 0.1, 400.0, np.inf, 1e-3, out)
    np.testing.assert_allclose(out, angle[:50], rtol=1e-12)


@pytest.mark.slow_cases(1, "2 cases of 1.2 s of CPU")
@pytest.mark.costs("fits eight constants")
@pytest.mark.parametrize(
    ("seed", "limit_a"), slow_except([(1, np.inf)], [(0, np.inf), (1, np.inf), (2, 1.2)])
)
def test_a_planted_backlash_comes_back(seed: int, limit_a: float) -> None:
    """One degree, within 0.2 degrees, with the noise of an encoder; in mode 5, too."""
    found = with_backlash(loose_logs(1.0, seed, limit_a), seed)
    k = NAMES.index("backlash_rad")
    assert np.degrees(found.values[k]) == pytest.approx(1.0, abs=0.2)
    assert found.low[k] <= np.radians(1.0) <= found.high[k]


@pytest.mark.slow
def test_a_servo_without_backlash_gets_none(found: ServoConstants) -> None:
    assert np.isnan(found.high[NAMES.index("backlash_rad")])  # not asked for
    found = with_backlash(loose_logs(0.0, 3), 3)
    k = NAMES.index("backlash_rad")
    assert (found.values[k], found.low[k]) == (0.0, 0.0)
    assert np.degrees(found.high[k]) < 0.2


def with_backlash(logs: list[PendulumLog], seed: int) -> ServoConstants:
    """Fit from constants that are a tenth off."""
    rng, values = np.random.default_rng(seed), np.array([c.absent for c in CONSTANTS])
    planted = PLANTED | {"delay_s": DELAY_S}
    for name, value in planted.items():
        values[NAMES.index(name)] = value * rng.uniform(0.9, 1.1)
    unknown = np.full(len(values), np.nan)
    start = ServoConstants(values, unknown, unknown, "xl330")
    return fit_pendulum(logs, start, starts=1, hops=0, seed=seed, backlash=True)


def loose_logs(degrees: float, seed: int, limit_a: float = np.inf) -> list[PendulumLog]:
    loose = partial(
        swing,
        backlash_rad=float(np.radians(degrees)),
        limit_a=limit_a,
        noise=np.random.default_rng(seed),
    )
    return [
        loose(400, lambda t: 1.4 * np.sin(2.0 * t) * np.sin(5.1 * t), 9.0),
        loose(800, lambda t: 0.8 * np.sin(9.0 * t), 2.5),
    ]
