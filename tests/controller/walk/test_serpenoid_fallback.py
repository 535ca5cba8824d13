"""A lost walk goes on as a serpenoid on the same track, without a jump, and comes back."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from snakewalk.config.run import WalkConfig
from snakewalk.controller.walk.serpenoid import SERPENOID, SerpenoidFallback
from snakewalk.controller.walk.walker import Walker

POINTS = 100


def walker(seed: int) -> Walker:
    rng = np.random.default_rng(seed)
    s = np.linspace(0.0, 2.0 * np.pi, POINTS)
    waves = rng.uniform(0.8, 1.8, (40, 1))
    shapes = rng.uniform(0.3, 0.8, (40, 1)) * np.sin(waves * s + rng.uniform(0, 6.28, (40, 1)))
    return Walker(shapes, WalkConfig())


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10_000), before=st.integers(1, 6), aim=st.floats(-3.0, 3.0))
def test_the_track_never_jumps_when_the_serpenoid_takes_over(
    seed: int, before: int, aim: float
) -> None:
    chooser = SerpenoidFallback(walker(seed))
    for _ in range(before):
        chooser.decide(0.0, aim)
    end = chooser.track.end
    largest = float(np.abs(np.diff(chooser.track.at_rad(np.arange(end, dtype=float)))).max())
    chooser.fall_back(True)
    assert chooser.decide(0.0, aim).state == SERPENOID
    joined = chooser.track.at_rad(np.arange(end - 1, end + 3, dtype=float))
    # 0.7 rad, 1.2 waves: at most 0.053 rad a sample, and the turn of the mean line
    assert np.abs(np.diff(joined)).max() < max(largest, 0.053 + 0.02)


def test_it_turns_towards_the_aim_and_hands_back() -> None:
    chooser = SerpenoidFallback(walker(1))
    chooser.decide(0.0, 0.0)
    visited = chooser.decide(0.0, 0.0).visited
    chooser.fall_back(True)
    for _ in range(60):
        made = chooser.decide(0.0, 1.0)
    assert made.visited == visited
    body = chooser.track.body_rad(float(chooser.track.end))
    whole = chooser.track.at_rad(np.arange(chooser.track.end - 250, chooser.track.end, dtype=float))
    assert whole.mean() == pytest.approx(1.0, abs=0.1)
    assert np.ptp(body) == pytest.approx(1.4, abs=0.05)
    chooser.fall_back(False)
    assert chooser.decide(0.0, 1.0).state != SERPENOID


def test_a_walk_that_is_not_lost_is_the_walk() -> None:
    alone, with_fallback = walker(3), SerpenoidFallback(walker(3))
    for k in range(12):
        assert alone.decide(0.0, 0.1 * k) == with_fallback.decide(0.0, 0.1 * k)
    assert np.array_equal(
        alone.track.body_rad(float(alone.track.end)),
        with_fallback.track.body_rad(float(with_fallback.track.end)),
    )
