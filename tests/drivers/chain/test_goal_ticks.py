"""Goals to raw positions: compiled and in numpy the same, tick by tick."""

import numpy as np
import pytest

from snakewalk.drivers.chain.joint_codec import GoalTicks
from snakewalk.drivers.protocol.registers import ServoUnits

UNITS = ServoUnits(2048, 2.0 * np.pi / 4096, 0.02, 0.00269)
LIMITS = np.array([[1024, 3072], [1500, 2600], [0, 4095]], np.int32)


def both() -> tuple[GoalTicks, GoalTicks]:
    pytest.importorskip("numba")
    return GoalTicks(UNITS, LIMITS, compiled=True), GoalTicks(UNITS, LIMITS, compiled=False)


def test_compiled_and_numpy_agree_on_random_goals_and_on_halves() -> None:
    loop, plain = both()
    rng = np.random.default_rng(5)
    halves = (rng.integers(-3000, 3000, (500, 3)) + 0.5) * UNITS.rad_per_position
    for goal in (*rng.normal(0.0, 1.5, (500, 3)), *halves, np.array([1e300, -1e300, 1e12])):
        if np.abs(goal).max() < 1e5:  # beyond, numpy's integers wrap around
            assert np.array_equal(loop.of(goal), plain.of(goal))
        assert (loop.of(goal) >= LIMITS[:, 0]).all()
        assert (loop.of(goal) <= LIMITS[:, 1]).all()


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_what_is_no_number_and_what_is_too_short_is_refused(bad: float) -> None:
    for ticks in both():
        with pytest.raises(ValueError, match="not finite"):
            ticks.of(np.array([0.0, bad, 0.0]))
        with pytest.raises(ValueError, match="3 joints"):
            ticks.of(np.zeros(2))
