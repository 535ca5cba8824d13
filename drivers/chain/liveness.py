"""Liveness: whether servos still hold torque and watchdog, and no setting was lost.

A servo that has rebooted answers as before, limp and with the settings of its EEPROM. So registers
are read again, one at a time, and compared with what was written to them.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from snakewalk.config.robot import RobotConfig
from snakewalk.drivers.bus.chain_bus import ChainBus, GroupCycle
from snakewalk.drivers.chain.start_up import (
    IDENTITY,
    RAM_SETTINGS,
    SHAPING_SETTINGS,
    identity_fault,
)
from snakewalk.drivers.errors import BusError
from snakewalk.drivers.protocol.control_table import Register
from snakewalk.drivers.protocol.registers import WATCHDOG_TRIPPED

SLOW_EVERY = 16
"""Cycles from one reading of voltages and temperatures to the next (ours); torque and watchdog are
checked as often, in other cycles."""


class LivenessCheck:
    """Whether torque is still on, the watchdogs are armed, and no setting was lost.

    One group read of one register at a time. Servos that do not reply are not judged; the check is
    made again in the next cycle that has time for it.
    """

    def __init__(
        self,
        bus: ChainBus,
        robot: RobotConfig,
        configured: Mapping[int, Mapping[str, int]],
        watchdog_ticks: int,
        *,
        fast: bool,
    ) -> None:
        """Prepare the reads.

        Args:
            bus: where the servos are.
            robot: whose they are.
            configured: values of RAM registers as they were set, by joint.
            watchdog_ticks: Bus Watchdog(98) as it was armed.
            fast: begin with fast sync reads.

        """
        self._robot = robot
        joints = range(robot.joint_count)
        read = partial(RegisterCheck.of, bus, robot, fast=fast)
        self._torque = read("Torque Enable", dict.fromkeys(joints, 1))
        self._watchdog = read("Bus Watchdog", dict.fromkeys(joints, watchdog_ticks))

        def kept(registers: Iterable[str]) -> "list[RegisterCheck]":
            held = {
                register: {j: v[register] for j, v in sorted(configured.items()) if register in v}
                for register in registers
            }
            return [read(register, expected) for register, expected in held.items() if expected]

        (self._identity,) = kept([IDENTITY])
        self._settings = kept(RAM_SETTINGS)
        self._shaping = kept(SHAPING_SETTINGS)
        self._missed: list[RegisterCheck] = []
        """Not all servos replied to these; the oldest first."""

    def check(self, cycle: int, *, has_time: bool) -> GroupCycle | None:
        """Make the check whose turn it is in a cycle; the group read, if it asked all servos.

        In a round of ``SLOW_EVERY`` cycles: torque, watchdog, identity, one of the settings, and
        two of those that shape the motion. In between, where the cycle ``has_time``, one to which
        not all servos have replied.

        Raises:
            BusError: a servo is not as it was set.
            PortError: the port is gone.

        """
        rounds, place = divmod(cycle, SLOW_EVERY)
        check = None
        if place == SLOW_EVERY // 3:
            check = self._torque
        elif place == 2 * SLOW_EVERY // 3:
            check = self._watchdog
        elif place == SLOW_EVERY // 2:
            check = self._identity
        elif place == SLOW_EVERY - 3:
            check = self._settings[rounds % len(self._settings)]
        elif place in (3, SLOW_EVERY - 5):
            turn = 2 * rounds + (place > SLOW_EVERY // 2)
            check = self._shaping[turn % len(self._shaping)]
        if check is None and has_time and self._missed:
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
        if check is self._identity:
            other = identity_fault(self._robot, joint, value)
            if other is not None:
                raise BusError(other)
        if check is self._torque:
            what = "torque is off: has it rebooted?"
        elif check is self._watchdog and value == WATCHDOG_TRIPPED:
            what = "its bus watchdog has stopped it"
        else:
            what = (
                f"{check.register.name} is {value}, not {check.expected[joint]}: has it rebooted, "
                "or does another program write to it?"
            )
        raise BusError(f"{', '.join(map(self._robot.joint_label, differing))}: {what}")


@dataclass(frozen=True, slots=True, eq=False)
class RegisterCheck:
    """Group read of one register, and what it must return."""

    register: Register
    cycle: GroupCycle
    ids: tuple[int, ...]
    expected: Mapping[int, int]
    """By joint, in the order of ``ids``."""
    raw: bytes
    """Of it, in that order, as they stand in the reply."""

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
        register = bus.table_of(ids[0]).register(name)
        raw = np.array(list(expected.values()), _kind(register)).tobytes()
        return cls(register, cycle, ids, dict(expected), raw)

    def compare(self, ask_again: ChainBus | None = None) -> tuple[dict[int, int], bool]:
        """Read the register; the values that are not as expected, by joint, and if all are known.

        Args:
            ask_again: asks those that are not in the reply one by one; without it they are not
                judged.

        Raises:
            BusError: one that is asked again does not reply.
            PortError: the port is gone.

        """
        reply, register = self.cycle.read(), self.register
        if reply.flawless and reply.data.tobytes() == self.raw:  # the usual case
            return {}, True
        values = np.ascontiguousarray(reply.data).view(_kind(register))[:, 0]
        everybody = reply.valid_count == len(reply.valid)
        found = {}
        for place, (joint, expected) in enumerate(self.expected.items()):
            if reply.valid[place]:
                got = int(values[place])
            elif ask_again is not None:
                got = ask_again.read(self.ids[place], register.name)
            else:
                continue
            if got != expected:
                found[joint] = got
        return found, ask_again is not None or everybody


def _kind(register: Register) -> str:
    """Type of a register's numbers, as they stand in a packet."""
    return f"<{'i' if register.signed else 'u'}{register.size}"
