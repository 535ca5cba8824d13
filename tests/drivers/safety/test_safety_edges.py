"""Edge cases of the vetting that mutation testing found untested."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from snakewalk.config.loader import load_robot
from snakewalk.config.run import SafetyConfig
from snakewalk.drivers.safety.limits import SafetyLimits
from snakewalk.drivers.safety.vet import SafetyMemory, _age_max_s, vet
from snakewalk.drivers.types import JointCommand
from tests.drivers.safety.test_safety_vet import (
    LIMITS,
    NOW,
    J,
    TestVetoesAtTheirBoundary,
    memory,
    one,
    state,
    vetted,
)


def test_a_joint_may_be_bent_a_little_beyond_its_limit() -> None:
    limits = SafetyLimits.from_config(load_robot("yaw16"), SafetyConfig())
    assert limits.limit_slack_rad == 0.2


def test_a_clock_that_runs_back_allows_no_step() -> None:
    verdict = vetted(1.0, last=memory(goal=0.3, dt_s=-1.0))
    assert verdict.veto is None
    assert verdict.goal_rad.tolist() == [0.3] * J


@pytest.mark.parametrize("joint", range(J))
def test_the_limit_wins_over_rate_and_lead(joint: int) -> None:
    limit = LIMITS.limit_rad[joint]
    for sign in (-1.0, 1.0):
        bent = state(position_rad=one(sign * (limit + 0.15), joint))
        held = memory()
        held.goal_rad[joint] = sign * (limit + 0.15)
        verdict = vetted(one(sign * 3.0, joint), bent, held)
        assert verdict.veto is None
        assert verdict.goal_rad[joint] == sign * limit


def test_a_verdict_cannot_be_changed_afterwards() -> None:
    with pytest.raises(ValueError, match="read-only"):
        vetted(0.01).goal_rad[0] = 3.0


@pytest.mark.parametrize("joint", range(J))
@pytest.mark.parametrize("name", ["position_rad", "velocity_rad_s", "current_a"])
@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_the_joint_that_measures_no_number_is_named(joint: int, name: str, bad: float) -> None:
    verdict = vetted(now=state(**{name: one(bad, joint)}))
    assert verdict.veto == f"{LIMITS.joint_names[joint]}: measured {bad}: not a number"


@pytest.fixture
def _long_way(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every check by itself, without the quick look that nothing is the matter."""
    monkeypatch.setattr("snakewalk.drivers.safety.vet._age_max_s", lambda *_: np.nan)


@pytest.mark.usefixtures("_long_way")
class TestVetoesTheLongWay(TestVetoesAtTheirBoundary):
    """The same limits where the quick look has not decided."""


def test_a_goal_far_away_is_a_number_all_the_same() -> None:
    with np.errstate(over="ignore"):
        verdict = vetted(one(1e200, 1))
    assert verdict.veto is None
    assert verdict.clamped.tolist() == [False, True, False]


OLD = "joint yaw_01 (ID 7): not read for 0.101 s"


def test_a_state_judged_before_is_still_watched_for_its_age() -> None:
    now = state()
    first = vetted(0.05, now)
    assert first.veto is None
    assert first.memory.checked_state is not None
    again = vetted(0.05, now, first.memory, NOW + 0.1 + 1e-3)
    assert again.veto == f"{OLD}: this program did not run for 0.101 s; close other programs"
    assert vetted(0.05, now, first.memory, NOW + 0.1 - 1e-3).veto is None


def test_a_state_that_was_read_long_ago_is_old_when_it_is_first_judged() -> None:
    assert str(vetted(0.0, state(time_s=NOW - 0.1 - 1e-3)).veto).startswith(OLD)
    assert vetted(0.0, state(time_s=NOW - 0.1 + 1e-3)).veto is None


def test_the_quick_check_passes_what_is_at_its_limit_and_nothing_beyond() -> None:
    """It only saves the full checks; but where it is wrong they do not run."""
    bent = LIMITS.limit_rad + LIMITS.limit_slack_rad
    at_limits = state(
        position_rad=-bent,
        velocity_rad_s=np.full(J, -1e300),
        current_a=np.full(J, -LIMITS.current_limit_a),
        temperature_c=np.full(J, LIMITS.temperature_limit_c),
        voltage_v=np.array([LIMITS.voltage_min_v, LIMITS.voltage_max_v, 12.0]),
        age_s=np.array([0.0, 0.05, 0.01]),
        slow_age_s=np.array([0.0, LIMITS.slow_stale_limit_s, 0.3]),
    )
    assert _age_max_s(at_limits, memory(), LIMITS) == 0.05
    beyond = {
        "position_rad": [-bent * (1.0 + 1e-12), np.full(J, np.nan)],
        "velocity_rad_s": [np.full(J, -np.inf), np.full(J, np.nan)],
        "current_a": [np.full(J, -LIMITS.current_limit_a - 1e-9), np.full(J, np.nan)],
        "temperature_c": [np.full(J, LIMITS.temperature_limit_c + 1e-9), np.full(J, np.nan)],
        "voltage_v": [
            np.full(J, LIMITS.voltage_min_v - 1e-9),
            np.full(J, LIMITS.voltage_max_v + 1e-9),
            np.full(J, np.nan),
        ],
        "age_s": [np.full(J, np.inf), np.full(J, np.nan)],
        "slow_age_s": [np.full(J, LIMITS.slow_stale_limit_s + 1e-9), np.full(J, np.nan)],
        "error": [np.full(J, 1, np.uint8)],
        "hardware_error": [np.full(J, 0x20, np.uint8)],
    }
    for name, values in beyond.items():
        healthy = getattr(at_limits, name)
        for value, joint in product(values, range(J)):
            bad = at_limits._replace(**{name: np.where(np.arange(J) == joint, value, healthy)})
            assert np.isnan(_age_max_s(bad, memory(), LIMITS)), (name, joint, value)
    for name in ("over_current_since_s", "under_voltage_since_s"):
        begun = memory()._replace(**{name: one(NOW - 0.1, 1, np.nan)})
        assert np.isnan(_age_max_s(at_limits, begun, LIMITS))


def test_what_one_state_or_one_set_of_limits_kept_says_nothing_of_another() -> None:
    first = vetted(0.05, state())
    assert vetted(0.05, state(current_a=np.full(J, np.nan)), first.memory).veto is not None
    now = state(position_rad=np.full(J, 0.3))
    kept = vetted(0.3, now, memory(0.3))
    strict = replace(LIMITS, limit_rad=np.full(J, 0.05))
    command = JointCommand(NOW, np.full(J, 0.3))
    assert vet(command, now, kept.memory, LIMITS, NOW).veto is None
    assert "forced beyond" in str(vet(command, now, kept.memory, strict, NOW).veto)


def test_a_state_with_a_fault_is_checked_again_and_refused_again() -> None:
    hot = state(temperature_c=np.full(J, 71.0))
    first = vetted(0.05, hot)
    assert first.memory.checked_state is None
    assert (
        vetted(0.05, hot, first.memory).veto == first.veto == "joint yaw_01 (ID 7): 71 C: too hot"
    )


def test_lasting_over_current_is_no_checked_state_that_is_kept() -> None:
    """The same reading again, later: the time since it began is compared with its own time."""
    early = state(time_s=NOW - 1.0, current_a=one(3.0, 1))
    begun = vetted(0.0, early, now_s=NOW - 1.0)
    assert begun.veto is None
    assert begun.memory.over_current_since_s[1] == NOW - 1.0
    later = vetted(0.0, state(current_a=one(3.0, 1)), begun.memory)
    assert later.veto == "joint yaw_02 (ID 8): 3.00 A for too long at rest: it is blocked"
    turning = state(current_a=one(3.0, 1), velocity_rad_s=one(0.5, 1))
    assert str(vetted(0.0, turning, begun.memory).veto).endswith("in motion: it is overloaded")


@pytest.mark.parametrize("name", ["error", "hardware_error"])
def test_one_error_among_healthy_servos_is_an_alarm(name: str) -> None:
    for joint in range(J):
        shown = np.zeros(J, np.uint8)
        shown[joint] = 0x80
        assert "alarm" in str(vetted(now=state(**{name: shown})).veto)


@pytest.mark.parametrize("joint", range(J))
def test_an_age_that_is_no_number_is_too_old(joint: int) -> None:
    veto = vetted(now=state(age_s=one(np.nan, joint))).veto
    assert veto is not None
    assert veto.startswith(f"{LIMITS.joint_names[joint]}: not read")


def test_goals_and_angles_of_another_kind_of_number_are_numbers() -> None:
    now = state(position_rad=np.zeros(J, np.float32))
    assert vetted(np.zeros(J, np.int64), now).veto is None


def test_memory_at_rest_tells_that_no_current_was_too_high() -> None:
    memory_at_rest = SafetyMemory.at_rest(state())
    assert np.isnan(memory_at_rest.over_current_since_s).all()
    with pytest.raises(ValueError, match="read-only"):
        memory_at_rest.over_current_since_s[0] = NOW


def test_the_joint_that_is_too_old_is_named_not_one_at_the_limit() -> None:
    assert vetted(now=state(age_s=np.array([0.1, 0.2, 0.0]))).veto == (
        "joint yaw_02 (ID 8): not read for 0.200 s: its reply was slow: the latency of adapter or "
        "network, or a busy computer"
    )


def test_a_joint_that_was_not_read_keeps_its_time_though_none_is_above_the_limit_now() -> None:
    begun = memory()._replace(over_current_since_s=one(NOW - 0.3, 1, np.nan))
    unread = state(valid=np.array([True, False, True]))
    assert vetted(now=unread, last=begun).memory.over_current_since_s[1] == NOW - 0.3
    assert np.isnan(vetted(last=begun).memory.over_current_since_s).all()


def test_a_supply_that_dips_does_not_end_the_run_and_one_that_stays_low_does() -> None:
    """The first low reading ended it: a dip of a few milliseconds does no harm."""
    low = one(9.9, 1, 12.0)
    first = vetted(now=state(voltage_v=low))
    assert first.veto is None
    held = vetted(
        now=state(time_s=NOW + 1.0, voltage_v=low, slow_age_s=np.full(J, 1.0)),
        last=first.memory,
        now_s=NOW + 1.0,
    )
    assert held.veto is None  # the same measurement, only older
    well = vetted(now=state(time_s=NOW + 1.0), last=held.memory, now_s=NOW + 1.0)
    assert np.isnan(well.memory.under_voltage_since_s).all()
    for last, is_over in ((held.memory, True), (well.memory, False)):
        later = vetted(now=state(time_s=NOW + 1.32, voltage_v=low), last=last, now_s=NOW + 1.32)
        assert (later.veto is not None) == is_over
        assert "joint yaw_02 (ID 8): 9.9 V: supply too low" in str(later.veto) or not is_over


def test_a_state_with_a_dip_is_checked_once() -> None:
    now = state(voltage_v=one(9.9, 1, 12.0))
    first = vetted(now=now)
    assert first.memory.checked_state is not None
    assert vetted(now=now, last=first.memory).memory.under_voltage_since_s[1] == NOW
