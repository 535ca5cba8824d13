"""A motion that comes to rest, and goes on again, without a step in its rate."""

import numpy as np

from snakewalk.controller.motion.stop_profile import StopProfile

STEP_S = 0.02


def rates(profile: StopProfile, seconds: float) -> list[float]:
    """Mean rate of each step."""
    return [profile.step(STEP_S) / STEP_S for _ in range(round(seconds / STEP_S))]


def test_it_goes_on_from_rest_and_from_half_way_without_a_step() -> None:
    profile = StopProfile()
    seen = rates(profile, 0.1)
    profile.stop()
    seen += rates(profile, 0.5)
    assert 0.3 < profile.rate < 0.7
    profile.go_on()
    seen += rates(profile, 1.0)
    assert seen[-1] == 1.0
    assert not profile.begun
    profile.stop()
    seen += rates(profile, 5.0)
    assert profile.over
    assert seen[-1] == 0.0
    profile.go_on()
    seen += rates(profile, 1.1)
    assert not profile.over
    assert seen[-1] == 1.0
    assert np.abs(np.diff(seen)).max() < 2.0 * STEP_S


def test_going_on_at_full_rate_changes_nothing() -> None:
    profile = StopProfile()
    profile.go_on()
    assert rates(profile, 0.1) == [1.0] * 5
