"""Hard walks of sound servos are not stopped by a false reason, and planted faults are found."""

from typing import Any

import pytest

from benchmarks.hard_walks import FAULTS, KINDS, drawn, fault_of, is_false, table, walked


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(9000, 9020))
def test_a_hard_walk_of_sound_servos_has_no_false_trip(seed: int) -> None:
    row = walked(seed)
    assert not is_false(row), row


@pytest.mark.slow
@pytest.mark.slow_cases(2, "8 s of CPU each; python -m benchmarks.hard_walks --planted")
@pytest.mark.parametrize("name", ["no supply", "no reply", "no output", "exchange", "hot"])
def test_a_planted_fault_is_found_in_a_hard_walk(name: str) -> None:
    """A soft pitch joint without output looks like one that lies on the ground: stiff ones only."""
    drawn_faults = ((seed, *fault_of(seed, 16)[:2]) for seed in range(9000, 10_000))
    seed = next(
        seed for seed, fault, joint in drawn_faults if fault == name and joint in range(0, 16, 2)
    )
    assert walked(seed, is_planted=True)["found"]


def test_all_kinds_and_faults_are_drawn() -> None:
    assert [drawn(seed)[0] for seed in range(6)] == list(KINDS)
    assert {fault_of(seed, 16)[0] for seed in range(200)} == set(FAULTS)
    assert drawn(7) == drawn(7)


def test_a_load_is_no_false_trip_and_a_wrong_reason_is() -> None:
    row: dict[str, Any] = {"kind": "stuck", "duration_s": 5.0, "trip": None}
    load = row | {"trip": "joint yaw_03 (ID 3): -2.28 A for too long"}
    false = row | {"trip": "joint yaw_03 (ID 3): 0.12 rad from its goal: dead current sensor"}
    assert [is_false(each) for each in (row, load, false)] == [False, False, True]
    blocked = "joint yaw_03 (ID 3): 0.54 rad from its goal for 0.30 s with {} A: it does not follow"
    assert not is_false(row | {"trip": blocked.format("-2.04")})
    assert is_false(row | {"trip": blocked.format("0.41")}), "such a current blocks no servo"
    assert "| stuck | 3 | 15 | 1 | 1 |" in table([row, load, false])
