"""The table of bus faults: complete, and able to show a silent fault."""

from dataclasses import replace
from pathlib import Path
from typing import get_args

import pytest
from pytest_mock import MockerFixture

from benchmarks.bus_fault_scenarios import SCENARIOS
from benchmarks.bus_faults import Result, Sound, sound_buses, try_scenario
from snakewalk.config import faults as plan


def _named(name: str, tmp_path: Path, **changes: int) -> Result:
    scenario = next(each for each in SCENARIOS if each.name.startswith(name))
    return try_scenario(replace(scenario, **changes), tmp_path)


def test_every_kind_of_a_fault_file_is_in_the_table() -> None:
    kinds: set[str] = set()
    for each in get_args(get_args(plan.Fault)[0]):
        kinds |= set(get_args(each.model_fields["kind"].annotation))
    tried = {fault["kind"] for scenario in SCENARIOS for fault in scenario.faults}
    assert tried == kinds
    assert len({each.name for each in SCENARIOS}) == len(SCENARIOS)


def test_a_fault_is_judged_by_what_the_run_reports(tmp_path: Path) -> None:
    result = _named("second master: Goal Position of all joints, every", tmp_path)
    assert (result.ended_by, result.outcome, result.silent) == (
        "goal read-back",
        "off",
        False,
    )


def test_a_fault_that_no_check_sees_is_silent(tmp_path: Path, mocker: MockerFixture) -> None:
    """The run ends before joints count as standing."""
    mocker.patch("snakewalk.drivers.chain.goal_check.GoalCheck.check")
    mocker.patch(
        "snakewalk.drivers.safety.following_error.FollowingError.update", return_value=None
    )
    result = _named("second master: Goal Position of all joints, every", tmp_path, cycles=150)
    assert (result.outcome, result.silent) == ("goes on", True)


def test_a_report_of_a_sound_bus_is_counted(mocker: MockerFixture) -> None:
    mocker.patch(
        "snakewalk.drivers.chain.servo_chain.TemperatureSensors.update", return_value=["hot"]
    )
    (bus,) = sound_buses(1, 20)
    assert isinstance(bus, Sound)
    assert bus.alarms


@pytest.mark.parametrize(
    ("name", "limit"),
    [
        ("`reading`: current always 186, and `no_output`, amplitude 0.18", 40),
        ("`reading`: current always 186, pitch joint, and `no_output`", 150),
    ],
)
def test_a_dead_output_stage_behind_a_dead_current_sensor_ends_the_run(
    name: str, limit: int, tmp_path: Path
) -> None:
    result = _named(name, tmp_path)
    assert result.ended_by == "current at an error"
    assert result.ended_after is not None
    assert result.ended_after < limit


def test_a_dead_current_sensor_of_a_joint_that_follows_is_reported(tmp_path: Path) -> None:
    result = _named("`reading`: current always 186", tmp_path)
    assert (result.detected_by, result.outcome) == ("motion sensors", "reported")
