"""A short fault campaign; the whole one is ``make campaign``."""

from contextlib import suppress

import numpy as np
import pytest
from pytest_mock import MockerFixture

from snakewalk.config.faults import FaultPlan
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.errors import SafetyTrippedError
from snakewalk.drivers.types import JointState
from snakewalk.sim.line.wire import RxQueue
from tests.campaign import rig
from tests.campaign.campaign import Tally, campaign, run_scenario
from tests.campaign.report import table
from tests.campaign.rig import JOINTS, ROBOT, Rig
from tests.campaign.scenarios import (
    CHANGES,
    JUMPS,
    KINDS,
    LINES,
    OTHERS,
    SCENARIOS,
    SENSORS,
    WRITES,
    plan,
)
from tests.helpers.tiers import slow_after
from tests.oracles.raw_positions import raw_positions


@pytest.mark.slow_cases(3, "the campaign plays all kinds at night")
@pytest.mark.parametrize("kind", slow_after(6, KINDS))
def test_each_kind_of_fault(kind: str) -> None:
    whole, _ = campaign([((kind,), KINDS.index(kind))], cycles=80)
    assert whole.complaints == []
    assert whole.violations == 0


@pytest.mark.slow_cases(4, "the campaign plays all changes at night")
@pytest.mark.parametrize("kind", slow_after(2, CHANGES))
def test_a_change_by_another_program_is_noticed_in_motion(kind: str) -> None:
    tally = run_scenario((kind,), 1, 130)
    assert tally.noticed
    assert tally.complaints == []
    assert tally.violations == 0


def test_another_robot_with_the_same_ids_is_never_gone_on_with() -> None:
    tally = run_scenario(("other robot",), 1, 130)  # an odd seed: the policy is to resume
    assert tally.trips
    assert tally.brought_back == 0
    assert tally.complaints == []


def test_a_servo_that_is_mounted_otherwise_while_it_is_off_is_not_gone_on_with() -> None:
    tally = run_scenario(("remounted",), 1, 130)
    assert tally.trips
    assert tally.brought_back == 0
    assert tally.complaints == []


def test_a_temperature_that_reads_0_is_reported() -> None:
    tally = run_scenario(("cold sensor",), 0, 100)
    assert tally.noticed
    assert tally.unnoticed == 0


def test_a_temperature_that_is_not_reported_is_counted(mocker: MockerFixture) -> None:
    mocker.patch("snakewalk.drivers.chain.servo_chain.TemperatureSensors.update", return_value=[])
    mocker.patch.object(rig, "NOTICED_CYCLES", 10)
    assert run_scenario(("cold sensor",), 1, 200).unnoticed


@pytest.mark.parametrize("seed", [40000, 40001])
def test_a_constant_current_is_named(seed: int) -> None:
    tally = run_scenario(("constant current",), seed, 240)
    assert tally.noticed
    assert tally.complaints == []


def test_a_dead_sensor_that_is_not_reported_is_counted(mocker: MockerFixture) -> None:
    mocker.patch("snakewalk.drivers.chain.servo_chain.MotionSensors.update", return_value=[])
    assert run_scenario(("constant velocity",), 40000, 240).unnoticed


def test_a_supply_that_is_too_low_for_a_moment_ends_no_run() -> None:
    tally = run_scenario(("dip",), 3, 130)
    assert (tally.trips, tally.complaints) == (0, [])


def test_a_scenario_without_a_fault_has_no_alarm() -> None:
    tally = run_scenario((), 1, 130)
    assert (tally.trips, tally.false_alarms, tally.complaints) == (0, 0, [])


def test_any_line_of_a_sound_chain_is_a_false_alarm(mocker: MockerFixture) -> None:
    mocker.patch(
        "snakewalk.drivers.chain.servo_chain.TemperatureSensors.update", return_value=["hot"]
    )
    assert run_scenario((), 1, 20).false_alarms


def test_a_change_that_the_chain_does_not_notice_is_counted(mocker: MockerFixture) -> None:
    mocker.patch.object(ServoChain, "_check")
    assert run_scenario(("I gain",), 0, 160).unnoticed


@pytest.mark.parametrize("other", [False, True])
def test_only_what_names_a_change_counts_as_noticed(*, other: bool) -> None:
    rig = Rig(FaultPlan(), "stop")
    rig.link.enable()
    rig.restart()
    rig.line.bank["Position P Gain"][2] = 50
    if other:
        rig.link.request_stop("stop button")
    with suppress(SafetyTrippedError):
        while rig.link.tripped is None:
            rig.line.clock.advance(0.02)
            rig.read()
    rig.changes.end(rig.link)
    assert (rig.changes.noticed, rig.changes.ended_otherwise) == ((0, 1) if other else (1, 0))


@pytest.mark.nightly("the campaign plays all pairs at night")
def test_some_pairs_of_faults() -> None:
    pairs = [kinds for kinds in SCENARIOS if len(kinds) == 2][::31]
    whole, by_kind = campaign([(kinds, k) for k, kinds in enumerate(pairs)], cycles=70)
    assert whole.complaints == []
    assert whole.violations == 0
    assert whole.trips + whole.brought_back > 5
    assert whole.missing > 20
    assert len(by_kind) > 15


def test_all_kinds_and_all_pairs_are_in_the_campaign() -> None:
    assert len(SCENARIOS) == 1 + len(KINDS) + len(KINDS) * (len(KINDS) - 1) // 2
    known = str(FaultPlan.model_json_schema())
    several = {*WRITES, *OTHERS, "second master", *SENSORS, *JUMPS, *LINES}
    assert all(f"'{kind}'" in known for kind in {*KINDS, "write", "reading"} - several)
    assert all(plan((kind,), 0, 5.0).fault for kind in KINDS)


def test_the_same_seed_gives_the_same_campaign() -> None:
    first, second = (run_scenario(("drop", "reboot"), 3, 60) for _ in range(2))
    assert first == second


def test_bytes_are_due_in_the_order_of_the_wire_and_not_before_they_are_there() -> None:
    """Else a client that waits for them spins for ever in simulated time (late and clash)."""
    arrivals = RxQueue()
    arrivals.add(0.5, b"slow")
    arrivals.add(0.1, b"quick")
    for count in range(1, 10):
        due_s = arrivals.due_s(count)
        assert due_s is not None
        assert arrivals.count(due_s) >= count
    assert arrivals.take(9, 0.05) == b""
    assert arrivals.take(9, 0.4) == b"quick"
    assert arrivals.take(9, 0.6) == b"slow"


def test_the_witness_sees_old_foreign_and_changed_values() -> None:
    rig = Rig(FaultPlan(), "stop")
    rig.link.enable()
    rig.restart()
    rig.line.clock.advance(0.02)
    good = rig.read()
    assert rig.witness.violations == 0
    rig._cycle += 1
    rig._check_values(good, None)
    assert rig.witness.old == JOINTS
    rig._cycle -= 1
    swapped = np.roll(good.current_a, 1)
    rig._check_values(_with(good, current_a=swapped), None)
    assert rig.witness.foreign == JOINTS
    lost = np.zeros(JOINTS, np.bool_)
    rig._check_values(_with(good, valid=lost, position_rad=np.zeros(JOINTS) + 0.1), good)
    assert rig.witness.not_held == JOINTS


@pytest.mark.parametrize("goal", [1.6, -1.6, 0.9, -0.9])
def test_the_witness_sees_goals_that_should_not_be_sent(goal: float) -> None:
    rig = Rig(FaultPlan(), "stop")
    rig.link.enable()
    rig.read()
    rig.chain._cycle.write_goals(raw_positions(rig._units, np.full(JOINTS, goal)))
    rig.line.drain_until_quiet(1e-3)
    assert rig.witness.beyond_limit >= JOINTS
    assert rig.witness.too_fast == JOINTS


def test_the_witness_knows_that_a_joint_is_not_where_it_was_read() -> None:
    """The reading may be another servo's: where it was read was taken for where it is."""
    rig = Rig(FaultPlan(), "stop")
    rig.link.enable()
    state = rig.read()
    rig._seen = _with(state, position_rad=state.position_rad + 0.3)
    rig.chain._cycle.write_goals(raw_positions(rig._units, np.full(JOINTS, 0.3)))
    rig.line.drain_until_quiet(1e-3)
    assert rig.witness.too_fast == JOINTS


@pytest.mark.parametrize("limp", [True, False])
def test_the_witness_judges_a_goal_when_there_is_torque(*, limp: bool) -> None:
    """Without torque it moves nothing; it does when torque comes on."""
    rig = Rig(FaultPlan(), "stop")
    rig.link.enable()
    rig.read()
    if limp:
        rig.link.disable()
    rig.chain._cycle.write_goals(raw_positions(rig._units, np.full(JOINTS, 0.9)))
    rig.line.drain_until_quiet(1e-3)
    assert rig.witness.violations == (0 if limp else 2 * JOINTS)
    rig.bus.sync_write(ROBOT.servo_ids, "Torque Enable", 1)
    rig.line.drain_until_quiet(1e-3)
    assert rig.witness.beyond_limit == JOINTS


def test_a_goal_that_is_written_behind_the_last_reading_is_a_race() -> None:
    rig = Rig(FaultPlan(), "stop")
    rig.link.enable()
    rig.read()
    rig.link.disable()
    rig.chain._identified.positions_and_goals(3, ask_again=True)
    rig.line.bank["Goal Position"][:] = 3000
    rig.bus.sync_write(ROBOT.servo_ids, "Torque Enable", 1)
    rig.line.drain_until_quiet(1e-3)
    assert (rig.witness.raced, rig.witness.violations) == (JOINTS, 0)


def test_ids_that_are_exchanged_behind_the_goals_of_a_start_are_found_before_torque() -> None:
    tally = run_scenario(("voltage", "exchange"), 7001, 240)
    assert tally.trips
    assert tally.complaints == []


def test_the_table_has_a_line_for_each_kind() -> None:
    text = table(Tally(cycles=1_234), {"brown_out": Tally(old=7)})
    assert text.splitlines()[2].startswith("| brown out | 0 |")
    assert "| **all** | 1,234 |" in text


def _with(state: JointState, **changes: object) -> JointState:

    return state._replace(**changes)  # type: ignore[arg-type]


@pytest.mark.parametrize("other", ["drop", "encoder"])
def test_a_joint_whose_id_two_servos_have_is_not_sent_to_where_the_other_stands(other: str) -> None:
    """Its reading is not believed: neither a hold nor going on may make a goal of it."""
    kinds = ("drop", "clash") if other == "drop" else ("clash", other)
    assert run_scenario(kinds, 3001, 240).complaints == []


@pytest.mark.parametrize(
    ("other", "seed"), [("overload", 3001), ("overload", 1013), ("feed-forward", 1003)]
)
def test_a_reading_of_another_servo_that_could_be_the_joints_own_is_no_goal_of_a_hold(
    other: str, seed: int
) -> None:
    """Two servos of one ID stood within 0.3 rad of each other."""
    tally = run_scenario(("clash", other), seed, 240)
    assert tally.brought_back + tally.trips
    assert tally.complaints == []


@pytest.mark.slow
def test_a_hold_where_the_joints_just_were_is_not_too_fast() -> None:
    """Between the read and the hold the line is drained: fast joints go on for 10 ms."""
    tally = run_scenario(("mute", "shock"), 5001, 240)
    assert tally.brought_back
    assert tally.complaints == []


@pytest.mark.parametrize(
    ("kinds", "seed"),
    [(("duplicate", "profile"), 5001), (("corrupt", "feed-forward"), 5001)],
)
def test_a_change_is_noticed_though_the_check_of_it_was_lost(
    kinds: tuple[str, str], seed: int
) -> None:
    tally = run_scenario(kinds, seed, 240)
    assert tally.noticed
    assert tally.complaints == []


def test_what_was_read_before_an_alarm_in_the_same_cycle_is_of_this_cycle() -> None:
    """The servo was silent when the state was read once more for the alarm."""
    tally = run_scenario(("mute", "shock"), 5000, 240)
    assert tally.trips
    assert tally.complaints == []


@pytest.mark.parametrize(
    ("kinds", "seed"),
    [
        (("drop", "watchdog"), 3002),
        (("corrupt", "watchdog"), 5000),
        (("truncate", "watchdog"), 1008),
    ],
)
def test_a_trip_ends_safe_though_the_line_is_dead_and_the_watchdogs_are_disarmed(
    kinds: tuple[str, str], seed: int
) -> None:
    tally = run_scenario(kinds, seed, 240)
    assert tally.trips
    assert tally.complaints == []
