"""The cause that a run names is the one that was planted, and a sound bus has no fault."""

import re

import pytest

from benchmarks.planted_causes import (
    KINDS,
    SEEDS,
    SOUND_BUSES,
    STS,
    Kind,
    X,
    named,
    sound,
    verdict,
)
from tests.helpers.adapters import NETWORK_S, AdapterLine, Swing, swing

CASES = [
    pytest.param(kind, make, seed, id=f"{kind.name}-{make}-{seed}")
    for seed in SEEDS
    for kind in KINDS
    for make in kind.makes
]


@pytest.mark.slow_cases(30, "6 runs of each kind and make")
@pytest.mark.fast_cases(6)
@pytest.mark.parametrize(("kind", "make", "seed"), CASES)
def test_the_cause_that_was_planted_is_named(kind: Kind, make: str, seed: int) -> None:
    said = named(kind, make, seed)
    assert re.search(kind.names, said), said


@pytest.mark.slow_cases(20, "500 buses")
@pytest.mark.fast_cases(4)
@pytest.mark.parametrize("seed", range(SOUND_BUSES))
def test_a_sound_bus_has_no_fault(seed: int) -> None:
    assert not sound(seed)


def test_a_verdict_counts_the_other_causes_of_the_same_report() -> None:
    kind = Kind("blocked", "a/b#1", "it is blocked")
    assert verdict(kind, "joint 1: it is blocked (torque off failed: a or b)") == "alone"
    assert verdict(kind, "noise or dust; joint 1: it is blocked; see doctor") == "alone"
    assert verdict(kind, "joint 1: it is blocked or overloaded") == "one of two"
    assert verdict(kind, "weak, it is blocked, dust, or noise") == "one of several"
    assert verdict(kind, "joint 1: alarm: overload") == "missed"


@pytest.mark.parametrize("phase_rad", [0.5, 2.75])
def test_goals_that_arrive_with_the_next_request_show_no_dead_motor(phase_rad: float) -> None:
    """Blocks of 40 ms: a joint had not moved yet when it was read, and was called dead."""
    assert not swing(
        X,
        line=AdapterLine(out_grid_s=0.04),
        amplitude_rad=0.5,
        phase_rad=phase_rad,
        seconds=6.0,
        latency_s=NETWORK_S,
    ).said


def test_a_dead_motor_is_named_behind_a_slow_adapter() -> None:
    said = swing(
        X,
        line=AdapterLine(out_grid_s=0.04),
        faults=[{"kind": "no_output", "ids": [3]}],
        latency_s=NETWORK_S,
    ).said
    assert "(ID 3)" in said
    assert "its motor does not push" in said


@pytest.mark.parametrize("make", [X, STS])
def test_a_pause_shorter_than_the_watchdog_is_read_again(make: str) -> None:
    """A pause of 0.15 s during a read ended the run: not read for 0.175 s."""
    assert not swing(make, faults=[{"kind": "stall", "for_s": 0.15}], seconds=3.0).said


def test_a_line_that_is_too_slow_for_the_limit_is_reported_at_the_start() -> None:
    line = AdapterLine(in_grid_s=0.036, out_grid_s=0.036)
    ran = swing(X, line=line, seconds=0.1, latency_s=NETWORK_S, stale_limit_s=0.1)
    assert ran.at_start[0].startswith("replies need up to 0.")
    assert "safety.stale_limit_s is 0.1; set it to 0." in ran.at_start[0]


@pytest.mark.parametrize(("way_s", "limit_s"), [(0.015, 0.1), (0.025, 0.15), (0.04, 0.24)])
def test_a_network_works_with_the_limit_that_the_start_names(way_s: float, limit_s: float) -> None:
    """With 25 ms each way, each run at the default limit ended within a second."""

    def there_and_back(limit_s: float | None) -> Swing:
        line = AdapterLine(in_s=way_s, out_s=way_s)
        return swing(X, line=line, seconds=2.5, latency_s=NETWORK_S, stale_limit_s=limit_s)

    if limit_s > 0.1:
        at_default = there_and_back(0.1)
        assert f"set it to {limit_s:g}" in at_default.at_start[0]
        assert "its reply was slow: the latency of adapter or network" in at_default.said
    ran = there_and_back(limit_s)
    assert not ran.said + "".join(ran.at_start)
    unset = there_and_back(None)
    assert not unset.said
    assert [f"stale_limit_s is {limit_s:g} in this run" in line for line in unset.at_start] == (
        [True] if limit_s > 0.1 else []
    )
