"""Liveness: whether torque, watchdog, settings and goals of the servos are as written.

A servo may have rebooted, or another program may have written to it. So registers are read again,
one at a time.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import partial

from snakewalk.config.robot import RobotConfig
from snakewalk.drivers.bus.chain_bus import ChainBus, GroupCycle
from snakewalk.drivers.chain.chain_settings import FEETECH_SETTINGS
from snakewalk.drivers.chain.fingerprint import Fingerprint
from snakewalk.drivers.chain.goal_check import GoalCheck
from snakewalk.drivers.chain.register_cause import MODE, TORQUE, register_cause
from snakewalk.drivers.chain.register_rows import RegisterRows
from snakewalk.drivers.chain.start_up import (
    IDENTITY,
    RAM_SETTINGS,
    SHAPING_SETTINGS,
    identity_fault,
)
from snakewalk.drivers.errors import BusError
from snakewalk.drivers.protocol.registers import WATCHDOG

SLOW_EVERY = 16
"""Cycles of a round (ours). Voltages and temperatures are read in its cycle 0."""
_GOALS_AT = 2
_CHECK_CYCLES = (5,), (8,), (10,), (13,), (3, 11), (6, 9, 12, 14)
"""Cycles of a round in which torque, identity, watchdog, a setting, one that shapes the motion, and
the fingerprint are read, at most one in each."""


class LivenessCheck:
    """Reads and compares one register of all servos at a time.

    An incomplete check is repeated in the next cycle with time for it.
    """

    def __init__(
        self,
        bus: ChainBus,
        robot: RobotConfig,
        configured: Mapping[int, Mapping[str, int]],
        fingerprints: Mapping[int, Fingerprint],
        watchdogs: Mapping[int, int],
        goals: GoalCheck,
        *,
        fast: bool,
        rad_per_position: Callable[[int], float],
    ) -> None:
        """Prepare the reads.

        ``configured`` has RAM registers, ``fingerprints`` EEPROM registers, by joint.
        ``watchdogs`` are the ticks of each joint's watchdog; those without one are left out.
        """
        self._bus = bus
        self._robot = robot
        self._goals = goals
        self._rad_per_position = rad_per_position
        joints = range(robot.joint_count)
        read = partial(RegisterCheck.of, bus, robot, fast=fast)
        torque = read(TORQUE, dict.fromkeys(joints, 1))

        def checks(
            registers: Iterable[str], values: Mapping[int, Mapping[str, int]]
        ) -> "list[RegisterCheck]":
            by_register = {
                register: {j: v[register] for j, v in sorted(values.items()) if register in v}
                for register in registers
            }
            return [read(name, expected) for name, expected in by_register.items() if expected]

        compared = dict.fromkeys(name for values in fingerprints.values() for name in values)
        fingerprint = checks(compared, fingerprints)
        # without a watchdog its place reads the mode: a wheel turns at once at full speed
        mode = [check for check in fingerprint if check.name == MODE]
        turns = (
            [torque],
            checks([IDENTITY], configured),
            [read(WATCHDOG, watchdogs)] if watchdogs else mode,
            checks(RAM_SETTINGS, configured),
            checks((*SHAPING_SETTINGS, *FEETECH_SETTINGS[2:]), configured),
            fingerprint,
        )
        self._checks = [check for turn in turns for check in turn]
        self._turns = {
            place: (turn, places)
            for turn, places in zip(turns, _CHECK_CYCLES, strict=True)
            for place in places
        }
        """Checks that are made in turn, and their places in a round, by place."""
        self._missed: list[RegisterCheck] = []
        """Checks to which not all servos replied; the oldest first."""

    def check_goals(self, cycle: int, *, has_time: bool) -> GroupCycle | None:
        """Read the goals back, once per round and after a difference; return the group read.

        Call it before the goals of the cycle are sent.

        Raises:
            BusError: a servo has another goal.
            PortError: the port is gone.

        """
        is_slow_cycle = cycle % SLOW_EVERY == _GOALS_AT
        if not is_slow_cycle and not (
            has_time and self._goals.is_due and cycle % SLOW_EVERY not in self._turns
        ):
            return None
        self._goals.check(self.explain)
        return self._goals.cycle

    def check(self, cycle: int, *, has_time: bool) -> GroupCycle | None:
        """Make the check of this cycle; return the group read if it asked all servos.

        A round of ``SLOW_EVERY`` cycles has torque, watchdog, identity, one setting, two registers
        that shape the motion, and four of the fingerprint. If ``has_time``, an incomplete check is
        repeated.

        Raises:
            BusError: a servo differs from its settings.
            PortError: the port is gone.

        """
        rounds, place = divmod(cycle, SLOW_EVERY)
        check = None
        if place in self._turns:
            turn, places = self._turns[place]
            if turn:
                check = turn[(len(places) * rounds + places.index(place)) % len(turn)]
        elif has_time and self._missed:
            check = self._missed[0]
        if check is None:
            return None
        self._judge(check)
        return check.cycle if len(check.ids) == self._robot.joint_count else None

    def _judge(self, check: "RegisterCheck") -> None:
        differing, is_complete = check.compare()
        if check in self._missed:
            self._missed.remove(check)
        if not is_complete:
            self._missed.append(check)
        if not differing:
            return
        joint, value = next(iter(differing.items()))
        # right again, or silent
        change = f"{check.name} is {value}, was {check.expected[joint]}"
        reason = (
            self.explain(joint) or f"{change}: it has rebooted, or another program writes to it"
        )
        joints = [joint] if check.name == IDENTITY else differing
        names = ", ".join(map(self._robot.joint_label, joints))
        raise BusError(f"{names}: {reason}")

    def explain(self, joint: int) -> str | None:
        """Read all compared registers of a joint's servo; return the cause of a change, or None.

        Raises:
            PortError: the port is gone.

        """
        expected = {c.name: c.expected[joint] for c in self._checks if joint in c.expected}
        servo_id = self._robot.servo_ids[joint]
        try:
            values = self._bus.read_each(servo_id, expected)
        except BusError:
            return None
        other = identity_fault(self._robot, joint, values.get(IDENTITY, 0))
        facts = self._robot.servo_records[joint]
        unit_rad = self._rad_per_position(joint)
        return other or register_cause(facts, expected, values, unit_rad)


@dataclass(frozen=True, slots=True, eq=False)
class RegisterCheck:
    """Group read of one register, and its expected values."""

    name: str
    rows: RegisterRows
    cycle: GroupCycle
    ids: tuple[int, ...]
    expected: Mapping[int, int]
    """Expected values by joint, in the order of ``ids``."""
    raw: bytes
    """Bytes of the block of each servo as in the reply, in the order of ``ids``."""

    @classmethod
    def of(
        cls,
        bus: ChainBus,
        robot: RobotConfig,
        name: str,
        expected: Mapping[int, int],
        *,
        fast: bool,
    ) -> "RegisterCheck":
        """Prepare the read of a register of some joints' servos."""
        ids = tuple(robot.servo_ids[joint] for joint in expected)
        cycle = bus.block(ids, name, name, fast=fast)
        rows = RegisterRows.of(bus, ids, name)
        return cls(name, rows, cycle, ids, dict(expected), rows.encode([*expected.values()]))

    def compare(self, ask_again: ChainBus | None = None) -> tuple[dict[int, int], bool]:
        """Read the register; return unexpected values by joint, and whether all are known.

        ``ask_again`` asks servos without a reply one by one; None ignores them.

        Raises:
            BusError: a servo that is asked again does not reply.
            PortError: the port is gone.

        """
        reply = self.cycle.read()
        if reply.flawless and reply.data.tobytes() == self.raw:  # the usual case
            return {}, True
        values = self.rows.decode(reply.data)
        all_replied = reply.valid_count == len(reply.valid)
        values_by_joint = {}
        for place, (joint, expected) in enumerate(self.expected.items()):
            if reply.valid[place]:
                goal = int(values[place])
            elif ask_again is not None:
                goal = ask_again.read(self.ids[place], self.name)
            else:
                continue
            if goal != expected:
                values_by_joint[joint] = goal
        return values_by_joint, ask_again is not None or all_replied
