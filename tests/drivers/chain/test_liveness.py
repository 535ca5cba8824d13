"""Registers that a run compares: which one in which cycle, and what is done about a difference."""

from collections import Counter
from types import SimpleNamespace

import numpy as np
import pytest

from snakewalk.config.robot import RobotConfig
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.chain.liveness import SLOW_EVERY, LivenessCheck, RegisterCheck
from snakewalk.drivers.chain.register_cause import MODE, TORQUE
from snakewalk.drivers.chain.start_up import IDENTITY, RAM_SETTINGS, SHAPING_SETTINGS
from snakewalk.drivers.errors import BusError, NoAnswerError
from snakewalk.drivers.protocol.packet import Instruction, InstructionPacket
from snakewalk.drivers.protocol.parser import PacketParser
from snakewalk.drivers.protocol.registers import WATCHDOG
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant

JOINTS = 4
STORED = (MODE, "Homing Offset", "Max Position Limit")
FREE = (0, 1, 2, 4, 7, 15)
"""Cycles of a round in which no check has its turn."""


class Rig:
    """Servos whose registers are as they were set, and the addresses that are read from them."""

    def __init__(self, *, has_watchdog: bool = True) -> None:
        self.robot = RobotConfig(name="some", joint_axes="y" * JOINTS)
        self.line = SimLine(ServoBank(self.robot.servo_ids), BenchPlant(JOINTS))
        self.bank = self.line.bank
        self.bank[TORQUE][:] = 1
        self.bank[IDENTITY][:] = range(1, JOINTS + 1)
        self.bank[WATCHDOG][:] = 127 if has_watchdog else 0
        self.bus = DynamixelBus(self.line, self.robot.models_by_id)
        self.goals = SimpleNamespace(is_due=True, cycle="the goals", check=self._check_goals)
        self.checked = 0
        self.read: list[str] = []
        kept = (*RAM_SETTINGS, *SHAPING_SETTINGS, IDENTITY)
        self.liveness = LivenessCheck(
            self.bus,
            self.robot,
            self.values(kept),
            self.values(STORED),
            dict.fromkeys(range(JOINTS), 127) if has_watchdog else {},
            self.goals,
            fast=False,
            rad_per_position=lambda joint: 0.0015,
        )
        self.names = {self.bank.register(name).address: name for name in self.bank.names}
        self.line.taps.append(self._note)

    def values(self, names: tuple[str, ...]) -> dict[int, dict[str, int]]:
        return {k: {name: int(self.bank[name][k]) for name in names} for k in range(JOINTS)}

    def _check_goals(self, explain: object) -> None:
        assert explain == self.liveness.explain
        self.checked += 1

    def _note(self, time_s: float, from_host: bool, data: bytes) -> None:
        for packet in PacketParser().feed(data) if from_host else []:
            if isinstance(packet, InstructionPacket) and packet.instruction in (
                Instruction.SYNC_READ,
                Instruction.READ,
            ):
                self.read.append(self.names[int.from_bytes(packet.params[:2], "little")])

    def cycle(self, cycle: int, *, has_time: bool = True) -> list[str]:
        """Names of the registers that the check of a cycle reads."""
        self.read.clear()
        returned = self.liveness.check(cycle, has_time=has_time)
        assert (returned is not None) == bool(self.read), "all servos are asked, or none"
        return [*self.read]

    def mute(self, joint: int, on: bool) -> None:
        self.line.mute(np.array([joint]), on)
        self.line.refresh_ids()


@pytest.mark.parametrize("has_watchdog", [True, False])
def test_each_register_has_its_turn_in_its_cycles(has_watchdog: bool) -> None:
    """Without a watchdog its place reads the mode once more."""
    rig = Rig(has_watchdog=has_watchdog)
    stored, shaping, settings = ([*names] for names in (STORED, SHAPING_SETTINGS, RAM_SETTINGS))
    rounds = 6
    expected: dict[int, list[str]] = {
        5: [TORQUE] * rounds,
        8: [IDENTITY] * rounds,
        10: [WATCHDOG if has_watchdog else MODE] * rounds,
        13: settings * 2,
        3: shaping[::2] * 2,
        11: shaping[1::2] * 2,
    }
    for place, turn in zip((6, 9, 12, 14), range(4), strict=True):
        expected[place] = [stored[(4 * k + turn) % 3] for k in range(rounds)]
    for cycle in range(rounds * SLOW_EVERY):
        k, place = divmod(cycle, SLOW_EVERY)
        assert rig.cycle(cycle, has_time=cycle % 2 == 0) == (
            [expected[place][k]] if place in expected else []
        )


def test_goals_are_read_once_a_round_and_after_a_difference_in_a_free_cycle() -> None:
    rig = Rig()
    asked = Counter[tuple[bool, bool, int]]()
    for is_due, has_time in ((False, False), (False, True), (True, False), (True, True)):
        rig.goals.is_due = is_due
        for cycle in range(2 * SLOW_EVERY):
            before = rig.checked
            read = rig.liveness.check_goals(cycle, has_time=has_time)
            assert read == ("the goals" if rig.checked > before else None)
            asked[is_due, has_time, cycle % SLOW_EVERY] += rig.checked - before
    for (is_due, has_time, place), count in asked.items():
        assert count == 2 * (place == 2 or (is_due and has_time and place in FREE))


def test_incomplete_checks_are_made_again_the_oldest_first_when_there_is_time() -> None:
    rig = Rig()
    rig.mute(1, True)
    assert rig.cycle(5) == [TORQUE]
    assert rig.cycle(8) == [IDENTITY]
    assert rig.cycle(15, has_time=False) == []
    assert rig.cycle(0) == [TORQUE]  # again without a reply: it goes behind the other
    assert rig.cycle(1) == [IDENTITY]
    rig.mute(1, False)
    assert [rig.cycle(cycle) for cycle in (15, 0, 1)] == [[TORQUE], [IDENTITY], []]


def test_a_missed_check_that_has_its_turn_is_made_once() -> None:
    rig = Rig()
    rig.mute(0, True)
    assert rig.cycle(5) == [TORQUE]
    rig.mute(0, False)
    assert rig.cycle(SLOW_EVERY + 5) == [TORQUE]
    assert rig.cycle(15) == []


@pytest.mark.parametrize(
    ("name", "cycle", "value", "joints", "said"),
    [
        (TORQUE, 5, 0, [1, 2], "yaw_02 (ID 2), joint yaw_03 (ID 3): torque is off"),
        (IDENTITY, 8, 4, [1, 2], "joint yaw_02 (ID 2): its servo was joint yaw_04 (ID 4)"),
        ("Position P Gain", 13, 5, [3], "joint yaw_04 (ID 4): Position P Gain is 5, "),
        (MODE, 6, 3, [0], "joint yaw_01 (ID 1): Operating Mode is "),
    ],
)
def test_a_difference_names_the_joints_and_the_cause(
    name: str, cycle: int, value: int, joints: list[int], said: str
) -> None:
    rig = Rig()
    rig.bank[name][joints] = value + (name == MODE)
    with pytest.raises(BusError) as error:
        rig.liveness.check(cycle, has_time=True)
    assert said in str(error.value)


@pytest.mark.parametrize("is_silent", [False, True])
def test_a_difference_that_cannot_be_read_again_is_reported_as_read(is_silent: bool) -> None:
    rig = Rig()
    rig.bank[TORQUE][2] = 0

    def change(time_s: float, from_host: bool, data: bytes) -> None:
        del time_s
        if from_host and data[7] == Instruction.READ:  # all registers of that servo
            rig.bank[TORQUE][2] = 1
            rig.mute(2, is_silent)

    rig.line.taps.append(change)
    said = r"joint yaw_03 \(ID 3\): Torque Enable is 0, was 1: it has rebooted, or another program"
    with pytest.raises(BusError, match=said):
        rig.liveness.check(5, has_time=True)


def test_checks_of_some_joints_return_no_group_read() -> None:
    rig = Rig()
    one = LivenessCheck(
        rig.bus,
        rig.robot,
        {2: {IDENTITY: 3}},
        {},
        {},
        rig.goals,
        fast=False,
        rad_per_position=lambda joint: 0.0015,
    )
    for cycle in range(SLOW_EVERY):
        rig.read.clear()
        returned = one.check(cycle, has_time=True)
        assert rig.read == {5: [TORQUE], 8: [IDENTITY]}.get(cycle, [])
        assert (returned is not None) == (cycle == 5)


def test_a_compared_register_tells_unexpected_values_and_if_all_are_known() -> None:
    rig = Rig()
    check = RegisterCheck.of(
        rig.bus, rig.robot, TORQUE, dict.fromkeys(range(JOINTS), 1), fast=False
    )
    assert check.compare() == ({}, True)
    rig.bank[TORQUE][2] = 0
    assert check.compare() == ({2: 0}, True)
    rig.mute(3, True)
    assert check.compare() == ({2: 0}, False)
    with pytest.raises(NoAnswerError):
        check.compare(rig.bus)
    rig.mute(3, False)
    read = check.cycle.read

    def lose_one() -> object:
        reply = read()
        valid = reply.valid.copy()
        valid[2] = False
        return reply._replace(valid=valid, flawless=False)

    check.cycle.read = lose_one
    assert check.compare() == ({}, False)
    assert check.compare(rig.bus) == ({2: 0}, True)
