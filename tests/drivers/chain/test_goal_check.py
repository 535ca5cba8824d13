"""Goals that servos do not hold are noticed, with the joint and the likely cause."""

from collections.abc import Callable

import numpy as np
import pytest

from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import SafetyConfig
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.chain.liveness import SLOW_EVERY
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.errors import BusError, SafetyTrippedError
from snakewalk.drivers.protocol.packet import Instruction, InstructionPacket
from snakewalk.drivers.protocol.parser import PacketParser
from snakewalk.drivers.safety.limits import SafetyLimits
from snakewalk.drivers.safety.safe_link import SafeLink
from snakewalk.drivers.types import JointCommand
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant

PERIOD_S = 0.02


class Rig:
    """A chain that swings slowly, and another program on its bus."""

    def __init__(self, joints: int = 4, baud: int = 1_000_000) -> None:
        robot = RobotConfig(name="some", joint_axes="y" * joints)
        self.line = SimLine(ServoBank(robot.servo_ids, baud=baud), BenchPlant(joints))
        self.joints, self.events = joints, list[str]()
        chain = ServoChain(DynamixelBus(self.line, robot.models_by_id), robot, watchdog_s=2.54)
        chain.on_event = self.events.append
        limits = SafetyLimits.from_config(
            robot, SafetyConfig(stale_limit_s=1.0, slow_stale_limit_s=60.0)
        )
        self.link = SafeLink(chain, limits, self.line.clock)
        self.disturb: Callable[[], None] = lambda: None
        """Called a quarter of a cycle after each goal, when that has left the line."""

    def swing(self, cycles: int, amplitude_rad: float = 0.03, period_s: float = PERIOD_S) -> int:
        """Cycles until the run trips, or ``cycles``; a small swing hides the following error."""
        clock = self.line.clock
        start_s = clock.now_s()
        for k in range(cycles):
            clock.sleep_until_s(start_s + k * period_s)
            try:
                self.link.read()
                goal = amplitude_rad * np.sin(2.0 * k * period_s + np.arange(self.joints))
                goal -= amplitude_rad * np.sin(np.arange(self.joints))
                self.link.write(JointCommand(clock.now_s(), goal))
            except SafetyTrippedError:
                return k
            clock.sleep_until_s(clock.now_s() + period_s / 4)
            self.line.settle()
            self.disturb()
        return cycles

    def write_goals(self, joints: list[int], raw: int) -> None:
        self.line.bank["Goal Position"][joints] = raw
        self.line.firmware.apply_registers()

    def ignore_sync_writes(self, joint: int) -> None:
        """Let a servo keep its goal; the motor goes on to follow what it holds."""
        held = int(self.line.bank["Goal Position"][joint])
        self.disturb = lambda: self.write_goals([joint], held)


@pytest.fixture
def rig() -> Rig:
    made = Rig()
    made.link.enable()
    assert made.swing(40) == 40
    return made


@pytest.mark.parametrize("joints", [[2], [0, 1, 2, 3]])
def test_a_second_master_is_named_within_two_rounds(rig: Rig, joints: list[int]) -> None:
    """It kept the robot still, and the run went on without an event."""
    rig.disturb = lambda: rig.write_goals(joints, 2300)
    assert rig.swing(2 * SLOW_EVERY) < 2 * SLOW_EVERY
    tripped = str(rig.link.tripped)
    names = ", ".join(f"joint yaw_{k + 1:02} (ID {k + 1})" for k in joints)
    assert tripped.startswith(f"{names}: Goal Position is 2300, not ")
    assert "second master" in tripped


def test_a_servo_that_ignores_sync_writes_is_named(rig: Rig) -> None:
    rig.ignore_sync_writes(1)
    assert rig.swing(2 * SLOW_EVERY) < 2 * SLOW_EVERY
    assert str(rig.link.tripped).startswith("joint yaw_02 (ID 2): Goal Position is ")
    assert "it ignores sync writes" in str(rig.link.tripped)


@pytest.mark.parametrize(
    ("lags", "cause"),
    [
        ((3,), "it accepts goals 3 cycles late"),
        ((1,), "it accepts goals 1 cycle late"),
        ((2, 3, 4), "writes to it get lost"),
    ],
)
def test_older_goals_are_named_as_late_or_as_lost(
    rig: Rig, lags: tuple[int, ...], cause: str
) -> None:
    """A servo that obeyed each goal two cycles late was reported as one that loses writes."""
    goals: list[int] = []

    def lag() -> None:
        goals.append(int(rig.line.bank["Goal Position"][3]))
        cycles = lags[len(goals) % len(lags)]
        rig.write_goals([3], goals[-1 - cycles] if len(goals) > cycles else goals[-1])

    rig.disturb = lag
    assert rig.swing(3 * SLOW_EVERY, 0.2) < 3 * SLOW_EVERY
    assert "joint yaw_04 (ID 4)" in str(rig.link.tripped)
    assert str(rig.link.tripped).endswith(cause)


def test_goals_that_reach_no_servo_are_lost_by_the_line(rig: Rig) -> None:
    """The run blamed one servo: its servo ignores the goals."""
    held = [int(each) for each in rig.line.bank["Goal Position"]]

    def restore() -> None:
        for joint, raw in enumerate(held):
            rig.write_goals([joint], raw)

    rig.disturb = restore
    assert rig.swing(3 * SLOW_EVERY, 0.5) < 3 * SLOW_EVERY
    assert "none has the newest goals: the adapter loses what is written" in str(rig.link.tripped)


def test_a_single_difference_is_no_fault(rig: Rig) -> None:
    once = [True]

    def disturb() -> None:
        if rig.link._link._reads % SLOW_EVERY == 2 and once:  # type: ignore[attr-defined]
            once.clear()
            rig.write_goals([2], 2300)

    rig.disturb = disturb
    assert rig.swing(4 * SLOW_EVERY) == 4 * SLOW_EVERY
    assert not once


def test_goals_that_stand_still_are_not_judged_twice_by_one_write() -> None:
    """Between two reads that differ another goal must have been sent."""
    rig = Rig()
    rig.link.enable()
    rig.swing(20)
    rig.write_goals([0], 2060)
    for _ in range(3 * SLOW_EVERY):  # reads only: nobody writes
        rig.line.clock.advance(0.01)
        rig.link.read()
    assert rig.link.tripped is None


def test_a_servo_that_refuses_goals_is_named_with_the_register_that_is_the_reason(
    rig: Rig,
) -> None:
    rig.line.bank["Max Position Limit"][1] = 2000
    rig.line.firmware.apply_registers()
    assert rig.swing(2 * SLOW_EVERY) < 2 * SLOW_EVERY
    assert "joint yaw_02 (ID 2): Max Position Limit is 2000" in str(rig.link.tripped)


@pytest.mark.fast_cases(2)
@pytest.mark.parametrize(
    ("joints", "baud", "period_s"),
    [(16, 1_000_000, 0.02), (64, 4_000_000, 0.02), (16, 57_600, 0.2), (64, 57_600, 0.8)],
)
def test_detection_takes_at_most_a_round_and_a_few_cycles(
    joints: int, baud: int, period_s: float
) -> None:
    rig = Rig(joints, baud)
    rig.link.enable()
    assert rig.swing(SLOW_EVERY + 3, period_s=period_s) == SLOW_EVERY + 3
    rig.disturb = lambda: rig.write_goals([joints - 1], 2300)
    assert rig.swing(2 * SLOW_EVERY, period_s=period_s) <= SLOW_EVERY + 3
    assert f"joint yaw_{joints:02} (ID {joints}): Goal Position is 2300" in str(rig.link.tripped)


def test_torque_stays_off_if_another_program_writes_goals_while_the_watchdog_is_armed() -> None:
    rig = Rig()

    def after_the_watchdog(time_s: float, from_host: bool, data: bytes) -> None:
        del time_s
        for packet in PacketParser().feed(data) if from_host else []:
            is_write = (
                isinstance(packet, InstructionPacket)
                and packet.instruction == Instruction.SYNC_WRITE
                and packet.params[:2] == (98).to_bytes(2, "little")
            )
            if is_write and packet.params[5]:
                rig.write_goals([2], 1500)

    rig.line.taps.append(after_the_watchdog)
    with pytest.raises(BusError, match=r"yaw_03.*: Goal Position is 1500 after 2048 was written"):
        rig.link.enable()
    rig.line.settle()
    assert rig.line.bank["Torque Enable"].tolist() == [0, 0, 0, 0]
