"""Servos that lose power for a moment while the doctor runs."""

from collections.abc import Callable

import numpy as np
import pytest

from snakewalk.controller.bench.servo_checks import ServoClock, restarts
from tests.controller.bench.test_broken_buses import ROBOT, Plant, TestLine, doctor


def losing_power(begin_s: float) -> Plant:
    """Servo 3 has no power for 0.25 s in each second, first after ``begin_s``."""

    def plant(line: TestLine) -> None:
        events, rows = line.firmware.events, np.array([2])

        def switch(change: Callable[[np.ndarray], None]) -> Callable[[], None]:
            def act() -> None:
                change(rows)
                line.refresh_ids()

            return act

        for k in range(100):
            at_s = line.clock.now_s() + begin_s + k
            events.schedule(at_s, switch(line.firmware.cut_power))
            events.schedule(at_s + 0.25, switch(line.firmware.restore_power))

    return plant


@pytest.mark.parametrize("begin_s", [0.1, 0.35, 0.6, 0.85])
def test_a_servo_that_restarts_is_named_in_every_phase(begin_s: float) -> None:
    """It was named only if it had no power during the pings."""
    line = TestLine()
    losing_power(begin_s)(line)
    named = [f.found for f in doctor(line) if f.check == "power"]
    assert named == ["joint yaw_03 (ID 3) restarts while doctor runs"]


def test_a_servo_that_falls_silent_is_named() -> None:
    """It replied to all requests but the last ones."""
    first = {3: ServoClock(120, 1.0, 1.1)}
    (finding,) = restarts(first, {}, ROBOT)
    assert finding.found == "joint yaw_03 (ID 3) replies no more since the start"


@pytest.mark.parametrize(("counted", "named"), [(2000, 0), (2080, 0), (1920, 0), (700, 1)])
@pytest.mark.parametrize("start", [5, 32_000])
def test_a_clock_may_run_over_and_be_inexact(start: int, counted: int, named: int) -> None:
    first = {3: ServoClock(start, 1.0, 1.0)}
    last = {3: ServoClock((start + counted) % 32_768, 3.0, 3.0)}
    assert len(restarts(first, last, ROBOT)) == named
