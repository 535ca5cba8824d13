"""The goal check by itself: which differences count, how often, and what is said."""

import numpy as np
import pytest

from snakewalk.drivers.bus.control_cycle import CycleCounters
from snakewalk.drivers.bus.group_read import GroupReadReply
from snakewalk.drivers.chain.goal_check import (
    FOREIGN_READS,
    MOST_LATE,
    OWN_READS,
    WATCHED_READS,
    GoalCheck,
)
from snakewalk.drivers.chain.register_rows import RegisterRows
from snakewalk.drivers.errors import BusError

FOREIGN = 9999
"""A goal that is never sent here."""


class Servos:
    """Goals that the servos report."""

    fast, given_up_on, since_sent_s = False, (), 0.0

    def __init__(self, joints: int) -> None:
        self.counters = CycleCounters()
        self.goals = np.zeros(joints, np.int32)
        self.valid = np.ones(joints, np.bool_)
        self.is_flawless = True
        self.reads = 0

    def write_goals(self, goals: np.ndarray) -> None:
        self.goals = goals.copy()

    def read(self) -> GroupReadReply:
        self.reads += 1
        data = self.goals.view(np.uint8).reshape(len(self.goals), -1)
        whole = bool(self.valid.all())
        none = np.zeros(len(self.goals), np.uint8)
        is_flawless = whole and self.is_flawless
        return GroupReadReply(data, self.valid, none, self.valid, whole, whole, is_flawless)


class Rig:
    """A check of three joints whose goals rise by one with each write."""

    def __init__(self) -> None:
        self.servos = Servos(3)
        self.check = GoalCheck(["a", "b", "c"], self.servos, RegisterRows(["<i4"] * 3))
        self.sent = 0

    def cycle(self, *, hold: dict[int, int] | None = None, is_read: bool = True) -> None:
        """Send new goals, of which the servos hold others; read them back."""
        self.sent += 1
        goals = np.array([self.sent, 10 + self.sent, 20 + self.sent], np.int32)
        self.servos.write_goals(goals)
        self.check.note_write(goals)
        for joint, value in (hold or {}).items():
            self.servos.goals[joint] = value
        if is_read:
            self.check.check(lambda joint: None)

    def cycles(self, holds: list[dict[int, int]]) -> None:
        """Make a cycle with each of them."""
        for hold in holds:
            self.cycle(hold=hold)


def test_nothing_is_read_before_the_first_goal() -> None:
    rig = Rig()
    rig.check.check(lambda joint: None)
    assert (rig.servos.reads, rig.check.explain(0), rig.check.is_due) == (0, None, False)


@pytest.mark.parametrize(
    ("value", "reads", "cause"),
    [
        (FOREIGN, FOREIGN_READS, "another program writes goals (a second master)"),
        (1, OWN_READS, "it ignores sync writes"),
    ],
)
def test_differences_count_up_to_the_limit_and_not_before(
    value: int, reads: int, cause: str
) -> None:
    rig = Rig()
    rig.cycle()
    for _ in range(reads - 1):
        rig.cycle(hold={0: value})
        assert rig.check.is_due is (value == FOREIGN)
    with pytest.raises(BusError) as raised:
        rig.cycle(hold={0: value})
    assert str(raised.value) == f"a: Goal Position is {value}, not {rig.sent}: {cause}"


def test_older_goals_that_change_are_lost_writes() -> None:
    rig = Rig()
    rig.cycle()
    with pytest.raises(BusError, match=r"^b: Goal Position is 14, not 15: writes to it get lost$"):
        rig.cycles([{1: value} for value in (11, 11, 12, 14)])


def test_goals_that_are_late_by_the_same_number_of_cycles_are_named_so() -> None:
    rig = Rig()
    rig.cycle()
    cause = r"^b: Goal Position is 14, not 15: it accepts goals 1 cycle late$"
    with pytest.raises(BusError, match=cause):
        rig.cycles([{1: 11 + k} for k in range(OWN_READS)])


@pytest.mark.parametrize(("value", "is_foreign"), [(11, True), (12, False)])
def test_a_goal_replaced_long_before_the_last_right_one_does_not_come_back(
    value: int, is_foreign: bool
) -> None:
    """The limit is ``MOST_LATE`` goals before it, however many were sent since."""
    rig = Rig()
    for _ in range(12 + MOST_LATE):
        rig.cycle()
    for _ in range(5):
        rig.cycle(is_read=False)
    rig.cycle(hold={0: value})
    assert rig.check.is_due is is_foreign


def test_a_goal_of_this_run_after_a_foreign_one_is_of_a_second_master() -> None:
    rig = Rig()
    rig.cycle()
    rig.cycle(hold={0: FOREIGN})
    with pytest.raises(BusError, match="second master"):
        rig.cycle(hold={0: 1})


def test_a_foreign_goal_after_older_ones_is_of_a_second_master() -> None:
    rig = Rig()
    rig.cycle()
    rig.cycle(hold={0: 1})
    with pytest.raises(BusError, match="second master"):
        rig.cycle(hold={0: FOREIGN})


def test_a_goal_that_is_right_again_ends_the_count() -> None:
    rig = Rig()
    rig.cycle()
    for _ in range(10):
        rig.cycles([{0: rig.sent}] * (OWN_READS - 1))
        rig.cycle()
    assert not rig.check.is_due


def test_foreign_goals_in_three_reads_are_of_a_second_master_though_others_are_right() -> None:
    """A program that wrote every 0.1 s was never seen in two reads in a row."""
    rig = Rig()
    rig.cycles([{0: FOREIGN}, {}, {}, {1: FOREIGN}, *([{}] * (WATCHED_READS - 2))])
    with pytest.raises(BusError, match=r"^c: Goal Position is 9999, not \d+: another program"):
        rig.cycle(hold={2: FOREIGN})


def test_foreign_goals_that_are_rarer_are_forgotten() -> None:
    rig = Rig()
    for _ in range(5):
        rig.cycles([{0: FOREIGN}, *([{}] * WATCHED_READS)])
        assert rig.check.is_due is False


def test_a_foreign_goal_of_many_joints_counts_as_one() -> None:
    rig = Rig()
    rig.cycles([{0: FOREIGN, 1: FOREIGN, 2: FOREIGN}, {}])
    assert rig.check.is_due is True  # more reads follow as soon as there is time
    rig.cycles([{0: FOREIGN, 1: FOREIGN, 2: FOREIGN}, {}])
    with pytest.raises(BusError, match=r"^a, b, c: "):
        rig.cycle(hold={0: FOREIGN, 1: FOREIGN, 2: FOREIGN})


def test_a_foreign_goal_counts_again_only_after_another_write() -> None:
    rig = Rig()
    rig.cycle(hold={0: FOREIGN})
    right = np.array([rig.sent, 10 + rig.sent, 20 + rig.sent], np.int32)
    for _ in range(5):
        for value in (right[0], FOREIGN):
            rig.servos.goals[0] = value
            rig.check.check(lambda joint: None)


def test_older_goals_now_and_then_are_no_second_master() -> None:
    rig = Rig()
    rig.cycles([{0: 0}, {}])
    for _ in range(10):
        rig.cycles([{0: rig.sent}, {}])


def test_joints_count_for_themselves() -> None:
    rig = Rig()
    rig.cycle()
    for joint in (0, 1, 2):
        rig.cycles([{joint: rig.sent + 10 * joint}] * (OWN_READS - 1))
    rig.cycle(hold={0: FOREIGN})
    rig.cycle(hold={1: FOREIGN})


def test_all_joints_over_the_limit_are_named_in_their_order() -> None:
    rig = Rig()
    rig.cycle()
    rig.cycle(hold={2: FOREIGN, 0: FOREIGN})
    with pytest.raises(BusError, match=r"^a, c: Goal Position is 9998, not 3: another"):
        rig.cycle(hold={2: FOREIGN, 0: FOREIGN - 1})


def test_a_difference_counts_again_only_after_another_write() -> None:
    rig = Rig()
    rig.cycle()
    rig.cycle(hold={0: 1})
    for _ in range(2 * OWN_READS):
        assert not rig.check.is_due
        rig.check.check(lambda joint: None)
    rig.cycle(hold={0: 1}, is_read=False)
    assert rig.check.is_due


def test_a_joint_that_is_not_read_is_not_judged_and_the_check_is_due() -> None:
    rig = Rig()
    rig.cycle()
    rig.servos.valid[0] = False
    for _ in range(2 * OWN_READS):
        rig.cycle(hold={0: FOREIGN})
        assert rig.check.is_due
    rig.servos.valid[0] = True
    rig.cycle()
    assert not rig.check.is_due


def test_others_are_judged_if_one_joint_is_not_read() -> None:
    rig = Rig()
    rig.servos.valid[0] = False
    with pytest.raises(BusError, match=r"^b: "):
        rig.cycles([{1: FOREIGN}] * FOREIGN_READS)


def test_an_error_byte_does_not_hide_a_difference() -> None:
    rig = Rig()
    rig.servos.is_flawless = False
    rig.cycle()
    assert not rig.check.is_due
    with pytest.raises(BusError, match=r"^c: "):
        rig.cycles([{2: FOREIGN}] * FOREIGN_READS)


def test_a_known_reason_is_reported_instead() -> None:
    rig = Rig()
    rig.cycle(hold={1: FOREIGN, 2: FOREIGN})
    rig.cycle(hold={1: FOREIGN, 2: FOREIGN}, is_read=False)
    with pytest.raises(BusError, match=r"^b: torque of 1 is off$"):
        rig.check.check(lambda joint: f"torque of {joint} is off")


@pytest.mark.parametrize(
    ("value", "cause"),
    [(FOREIGN, "another program writes goals"), (11, "it accepts goals late, or ignores")],
)
def test_an_explanation_names_one_joint_at_once(value: int, cause: str) -> None:
    rig = Rig()
    rig.cycle()
    assert rig.check.explain(1) is None
    rig.cycle(hold={1: value}, is_read=False)
    assert rig.check.explain(0) is None
    assert str(rig.check.explain(1)).startswith(f"Goal Position is {value}, not 12: {cause}")
    rig.servos.valid[1] = False
    assert rig.check.explain(1) is None
