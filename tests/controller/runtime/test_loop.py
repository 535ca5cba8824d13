"""The loop keeps absolute deadlines and never makes up for lost time in a burst."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from snakewalk.controller.runtime.loop import ticks


class HandClock:
    """A clock moved by the test and by sleeping."""

    def __init__(self) -> None:
        self.time_s = 0.0

    def now_s(self) -> float:
        return self.time_s

    def sleep_until_s(self, time_s: float) -> None:
        self.time_s = max(self.time_s, time_s)


def test_ticks_fall_on_multiples_of_the_period_when_work_is_short() -> None:
    clock = HandClock()
    seen = []
    for tick in ticks(clock, 0.02, 1.0):
        clock.time_s += 0.013
        seen.append(tick)
    assert [t.number for t in seen] == list(range(51))
    assert all(t.deadline_s == pytest.approx(t.number * 0.02) for t in seen)
    assert all(t.lateness_s == pytest.approx(0.0) and t.skipped == 0 for t in seen)


@given(st.lists(st.floats(0.0, 0.3), min_size=3, max_size=60))
def test_after_any_stall_deadlines_are_ahead_and_distinct(work_s: list[float]) -> None:
    clock = HandClock()
    last = -1
    for tick, busy_s in zip(ticks(clock, 0.02, 1e9), work_s, strict=False):
        assert tick.number > last
        assert tick.skipped == tick.number - last - 1
        assert tick.lateness_s <= 1e-9
        last = tick.number
        clock.time_s += busy_s


def test_a_period_of_zero_is_refused() -> None:
    with pytest.raises(ValueError, match="positive"):
        next(ticks(HandClock(), 0.0, 1.0))
