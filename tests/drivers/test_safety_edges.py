"""What mutation showed that no test noticed: small print of the judgement."""

import numpy as np
import pytest

from config.loader import load_robot
from config.run import SafetyConfig
from drivers.safety import SafetyLimits

from .test_safety_vet import (
    LIMITS,
    J,
    TestVetoesAtTheirBoundary,
    judge,
    memory,
    one,
    state,
)


def test_a_joint_may_be_bent_a_little_beyond_its_limit() -> None:
    limits = SafetyLimits.from_config(load_robot("yaw16"), SafetyConfig())
    assert limits.limit_slack_rad == 0.2


def test_a_clock_that_runs_back_allows_no_step() -> None:
    verdict = judge(1.0, last=memory(goal=0.3, dt_s=-1.0))
    assert verdict.veto is None
    assert verdict.goal_rad.tolist() == [0.3] * J


@pytest.mark.parametrize("joint", range(J))
def test_the_limit_wins_over_rate_and_lead(joint: int) -> None:
    limit = LIMITS.limit_rad[joint]
    for sign in (-1.0, 1.0):
        bent = state(position_rad=one(sign * (limit + 0.15), joint))
        held = memory()
        held.goal_rad[joint] = sign * (limit + 0.15)
        verdict = judge(one(sign * 3.0, joint), bent, held)
        assert verdict.veto is None
        assert verdict.goal_rad[joint] == sign * limit


def test_a_verdict_cannot_be_changed_afterwards() -> None:
    with pytest.raises(ValueError, match="read-only"):
        judge(0.01).goal_rad[0] = 3.0


@pytest.mark.parametrize("joint", range(J))
@pytest.mark.parametrize("name", ["position_rad", "velocity_rad_s", "current_a"])
@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_the_joint_that_measures_no_number_is_named(joint: int, name: str, bad: float) -> None:
    verdict = judge(now=state(**{name: one(bad, joint)}))
    assert verdict.veto == f"joint {joint}: measured {bad}: not a number"


@pytest.fixture
def _long_way(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every check by itself, without the quick look that nothing is the matter."""
    monkeypatch.setattr("drivers.safety._plainly_well", lambda *_: False)


@pytest.mark.usefixtures("_long_way")
class TestVetoesTheLongWay(TestVetoesAtTheirBoundary):
    """The same limits where the quick look has not decided."""


def test_a_goal_far_away_is_a_number_all_the_same() -> None:
    with np.errstate(over="ignore"):
        verdict = judge(one(1e200, 1))
    assert verdict.veto is None
    assert verdict.clamped.tolist() == [False, True, False]
