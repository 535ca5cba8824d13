"""Goals to raw positions: compiled and interpreted the same, position by position."""

from collections.abc import Callable

import numpy as np
import pytest

from snakewalk.config.servo_catalogue import servo_model
from snakewalk.drivers.chain import joint_codec
from snakewalk.drivers.chain.joint_codec import GoalEncoder, JointUnits, encode_goals
from snakewalk.drivers.protocol.registers import ServoUnits
from tests.oracles.raw_positions import raw_positions

UNITS = ServoUnits.of(servo_model("XM430-W350"))
LIMITS = np.array([[1024, 3072], [1500, 2600], [0, 4095]], np.int32)
ONES = np.ones(3)
JOINTS = JointUnits(
    np.full(3, UNITS.zero_position, np.int32),
    ONES * UNITS.rad_per_position,
    ONES * UNITS.rad_s_per_velocity,
    ONES * UNITS.a_per_current,
    LIMITS,
    ONES > 0.0,
    ONES > 0.0,
    ONES * UNITS.stall_current_a,
    np.full(3, UNITS.full_pwm, np.int32),
    ONES < 0.0,
)
both_ways = pytest.mark.parametrize(
    "loop", [encode_goals, encode_goals.py_func], ids=["compiled", "interpreted"]
)


@pytest.fixture
def encoder(loop: Callable[..., bool], monkeypatch: pytest.MonkeyPatch) -> GoalEncoder:
    monkeypatch.setattr(joint_codec, "encode_goals", loop)
    return GoalEncoder(JOINTS)


@both_ways
def test_goals_are_the_nearest_positions_also_at_halves(encoder: GoalEncoder) -> None:
    rng = np.random.default_rng(5)
    halves = (rng.integers(-3000, 3000, (500, 3)) + 0.5) * UNITS.rad_per_position
    for goal in (*rng.normal(0.0, 1.5, (500, 3)), *halves, np.array([1e300, -1e300, 1e12])):
        raw = encoder.encode(goal)
        if np.abs(goal).max() < 1e5:  # beyond, numpy's integers wrap around
            plain = raw_positions(UNITS, goal)
            assert np.array_equal(raw, np.minimum(np.maximum(plain, LIMITS[:, 0]), LIMITS[:, 1]))
        assert (raw >= LIMITS[:, 0]).all()
        assert (raw <= LIMITS[:, 1]).all()


@both_ways
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_goals_that_are_not_finite_or_too_few_are_refused(bad: float, encoder: GoalEncoder) -> None:
    with pytest.raises(ValueError, match="not finite"):
        encoder.encode(np.array([0.0, bad, 0.0]))
    with pytest.raises(ValueError, match="3 joints"):
        encoder.encode(np.zeros(2))
