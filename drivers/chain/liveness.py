"""Liveness: whether torque, watchdog, settings and goals of the servos are as written.

A servo may have rebooted, or another program may have written to it. So registers are read again,
one at a time.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

from snakewalk.config.robot import RobotConfig
from snakewalk.drivers.bus.chain_bus import ChainBus, GroupCycle
from snakewalk.drivers.chain.chain_settings import FEETECH_SETTINGS
from snakewalk.drivers.chain.fingerprint import Fingerprint, register_change
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
_GOALS_AT, _TORQUE_AT, _IDENTITY_AT, _WATCHDOG_AT, _SETTINGS_AT = 2, 5, 8, 10, 13
_SHAPING_AT, _FINGERPRINT_AT = (3, 11), (6, 9, 12, 14)
"""Cycles of a round in which registers are read, at most one in each."""
_CHECKED_AT = frozenset(
    {_TORQUE_AT, _IDENTITY_AT, _WATCHDOG_AT, _SETTINGS_AT, *_SHAPING_AT, *_FINGERPRINT_AT}
)


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
        self._torque = read(TORQUE, dict.fromkeys(joints, 1))

        def checks(
            registers: Iterable[str], values: Mapping[int, Mapping[str, int]]
        ) -> "list[RegisterCheck]":
            by_register = {
                register: {j: v[register] for j, v in sorted(values.items()) if register in v}
                for register in registers
            }
            return [read(name, expected) for name, expected in by_register.items() if expected]

        self._identity = next(iter(checks([IDENTITY], configured)), None)
        self._settings = checks(RAM_SETTINGS, configured)
        self._shaping = checks((*SHAPING_SETTINGS, *FEETECH_SETTINGS[2:]), configured)
        compared = dict.fromkeys(name for values in fingerprints.values() for name in values)
        self._fingerprint = checks(compared, fingerprints)
        # without a watchdog its place reads the mode: a wheel turns at once at full speed
        self._watchdog = (
            read(WATCHDOG, watchdogs)
            if watchdogs
            else next((c for c in self._fingerprint if c.name == MODE), None)
        )
        parts = self._torque, self._identity, self._watchdog
        self._checks = [
            *(check for check in parts if check is not None),
            *(*self._settings, *self._shaping, *self._fingerprint),
        ]
        self._missed: list[RegisterCheck] = []
        """Checks to which not all servos replied; the oldest first."""

    def check_goals(self, cycle: int, *, has_time: bool) -> GroupCycle | None:
        """Read the goals back, once per round and after a difference; return the group read.

        Call it before the goals of the cycle are sent.

        Raises:
            BusError: a servo has another goal.
            PortError: the port is gone.

        """
        its_turn = cycle % SLOW_EVERY == _GOALS_AT
        if not its_turn and not (
            has_time and self._goals.is_due and cycle % SLOW_EVERY not in _CHECKED_AT
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
        if place == _TORQUE_AT:
            check = self._torque
        elif place == _WATCHDOG_AT:
            check = self._watchdog
        elif place == _IDENTITY_AT:
            check = self._identity
        elif place == _SETTINGS_AT:
            check = _in_turn(self._settings, rounds, (_SETTINGS_AT,), place)
        elif place in _SHAPING_AT:
            check = _in_turn(self._shaping, rounds, _SHAPING_AT, place)
        elif place in _FINGERPRINT_AT:
            check = _in_turn(self._fingerprint, rounds, _FINGERPRINT_AT, place)
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
        reason = self.explain(joint)
        if reason is None:  # it is right again, or silent
            unit_rad = self._rad_per_position(joint)
            change = register_change(check.name, check.expected[joint], value, unit_rad)
            reason = f"{change}: it has rebooted, or another program writes to it"
        joints = [joint] if check is self._identity else differing
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


def _in_turn(
    checks: Sequence["RegisterCheck"], rounds: int, places: tuple[int, ...], place: int
) -> "RegisterCheck | None":
    """The check of this cycle, if ``place`` is one of their places in a round."""
    if not checks:
        return None
    return checks[(len(places) * rounds + places.index(place)) % len(checks)]


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
        everybody = reply.valid_count == len(reply.valid)
        values_by_joint = {}
        for place, (joint, expected) in enumerate(self.expected.items()):
            if reply.valid[place]:
                got = int(values[place])
            elif ask_again is not None:
                got = ask_again.read(self.ids[place], self.name)
            else:
                continue
            if got != expected:
                values_by_joint[joint] = got
        return values_by_joint, ask_again is not None or everybody
