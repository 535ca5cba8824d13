"""The chain of servos as a joint link: radians to raw goals, raw blocks to a ``JointState``."""

from collections.abc import Callable, Sequence

import numpy as np

from snakewalk.config.arrays import Bools, Floats, Int32s
from snakewalk.config.robot import RobotConfig
from snakewalk.drivers.bus.budget import WireBudget, chain_budget
from snakewalk.drivers.bus.control_cycle import FAST_FAILURES, ControlCycle, CycleCounters
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.chain.joint_codec import GoalEncoder, Readings
from snakewalk.drivers.chain.recheck import Recheck, recheck
from snakewalk.drivers.chain.start_up import (
    Inspection,
    check_pose,
    configure,
    goal_limits_raw,
    inspect,
)
from snakewalk.drivers.clock import Clock
from snakewalk.drivers.errors import BusError, ChainError, PortError
from snakewalk.drivers.port.byte_port import BytePort, reopen
from snakewalk.drivers.protocol.registers import WATCHDOG_TRIPPED, WATCHDOG_UNIT_S, ServoUnits
from snakewalk.drivers.types import JointCommand, JointState

SLOW_EVERY = 16
"""Cycles from one reading of voltages and temperatures to the next (ours); torque and watchdog are
checked as often, in other cycles."""
_FIRST_READS = 5
"""Tries to get one complete reply at the start (ours)."""


class ServoChain:
    """Joints of ``robot`` on ``bus``; implements ``JointLink``.

    Hand out a ``SafeLink`` around it, never itself.
    """

    def __init__(
        self,
        bus: DynamixelBus,
        robot: RobotConfig,
        *,
        watchdog_s: float = 0.2,
        rate_hz: float | None = None,
    ) -> None:
        """Prepare; nothing is sent before ``enable``.

        Args:
            bus: servos of the robot's model.
            robot: ids, limits, gains.
            watchdog_s: after so long without an instruction the servos stop by themselves.
            rate_hz: control cycles a second, checked against what the wire allows; None: unchecked.

        Raises:
            ControlTableError: the model lacks a register or a unit that the cycle needs.

        """
        self.robot = robot
        self.inspection: Inspection | None = None
        """The servos as found by the last ``enable``."""
        self.on_event: Callable[[str], None] = lambda line: None
        """Gets one line when fast reads are given up."""
        self._bus = bus
        self._clock = bus.port.clock
        self._units = ServoUnits.of(bus.table)
        self._watchdog_s = watchdog_s
        self._rate_hz = rate_hz
        self._goals = GoalEncoder(self._units, goal_limits_raw(robot, self._units))
        self._readings = Readings(robot.joint_count, bus.table, self._units)
        self._prepare_reads(fast=True)
        self._reads = 0
        self._armed = False
        self._sent_at_s = -np.inf

    @property
    def joint_count(self) -> int:
        """Number of joints J."""
        return self.robot.joint_count

    @property
    def port(self) -> BytePort:
        """The line."""
        return self._bus.port

    @property
    def clock(self) -> Clock:
        """The port's."""
        return self._clock

    @property
    def counters(self) -> CycleCounters:
        """What went wrong on the wire so far."""
        return self._cycle.counters

    @property
    def fast(self) -> bool:
        """Whether fast sync reads are in use."""
        return self._cycle.fast

    def enable(self) -> JointState:
        """Check and set up all servos, goal = present, torque on, watchdog armed.

        Raises:
            ChainError: the servos are not the robot's, have an alarm, or stand beyond a limit.
            BudgetError: the wire cannot carry the rate with the reads that the firmwares have.
            BusError: a servo does not do what an instruction asks; torque is off again then.
            PortError: the port is gone.

        """
        self.inspection = inspect(self._bus, self.robot)
        if self.inspection.faults:
            raise ChainError([str(fault) for fault in self.inspection.faults])
        if self._rate_hz is not None:
            self._budget(fast=self.inspection.fast_reads).check(self._rate_hz)
        configure(self._bus, self.robot, self._units)
        self._prepare_reads(fast=self.inspection.fast_reads)
        return self._begin()

    def recheck(self) -> Recheck:
        """Compare the chain after an interruption with what it was; moves nothing.

        Raises:
            BusError: a servo does not reply.
            PortError: the port is gone.

        """
        before = self._readings.state(self._clock.now_s()).position_rad
        return recheck(self._bus, self.robot, self._units, self.inspection, before)

    def resume(self, found: Recheck) -> JointState:
        """Go on after an interruption: torque that is on stays on, nothing moves.

        Servos that lost their torque (rebooted) are set up again. The others get their watchdog
        cleared and, right behind it, goal = present.

        Raises:
            ChainError: ``found`` forbids it.
            BusError: a servo does not do what an instruction asks; torque is off again then.
            PortError: the port is gone.

        """
        if found.faults:
            raise ChainError([str(fault) for fault in found.faults])
        configure(self._bus, self.robot, self._units, found.torque_off)
        return self._begin()

    def _begin(self) -> JointState:
        """Read the first state, hold it and arm the watchdogs; torque is off if that fails."""
        self._reads = 0
        state = self._first_state()
        check_pose(self.robot, state.position_rad)
        try:
            return self._hold_and_arm(state)
        except BaseException:
            self.disable()
            raise

    def reopen(self) -> None:
        """Close and open the port again.

        Raises:
            PortError: it is still not there.

        """
        reopen(self.port)

    def hold(self) -> None:
        """Set all goals to the positions that were last read.

        Raises:
            PortError: the port is gone.

        """
        here = self._readings.state(self._clock.now_s()).position_rad
        if np.isfinite(here).all():
            self._send_goals(here)

    def _hold_and_arm(self, state: JointState) -> JointState:
        """Goal = present, torque on, watchdog armed; every step read back."""
        bus, ids = self._bus, self.robot.servo_ids
        bus.sync_write(ids, "Bus Watchdog", 0)  # goals follow at once, else an old goal counts
        goals = self._send_goals(state.position_rad)
        for servo_id, goal in zip(ids, goals.tolist(), strict=True):
            self._expect(servo_id, "Goal Position", goal)
        bus.sync_write(ids, "Torque Enable", 1)
        for servo_id in ids:
            self._expect(servo_id, "Torque Enable", 1)
        ticks = min(127, max(1, round(self._watchdog_s / WATCHDOG_UNIT_S)))
        bus.sync_write(ids, "Bus Watchdog", ticks)
        for servo_id in ids:
            self._expect(servo_id, "Bus Watchdog", ticks)
        self._armed = True
        return self.read()

    def disable(self) -> None:
        """Torque off, then the watchdog, on every servo, also where others fail.

        Raises:
            BusError: servos that did not confirm; their watchdog stays armed and stops them.
            PortError: the port is gone and cannot be opened again; the watchdog stops the servos.

        """
        self._armed = False
        bus, ids = self._bus, self.robot.servo_ids
        try:
            bus.sync_write(ids, "Torque Enable", 0)
        except PortError:
            reopen(bus.port)  # it may be back
            bus.sync_write(ids, "Torque Enable", 0)
        silent = []
        for servo_id in ids:
            try:
                bus.write_verified(servo_id, "Torque Enable", 0)
                bus.write(servo_id, "Bus Watchdog", 0)
            except BusError:
                silent.append(str(servo_id))
        if silent:
            raise BusError(f"servo {', '.join(silent)}: torque off is not confirmed")

    def read(self) -> JointState:
        """Read all joints once; in every 16th call voltages and temperatures too.

        Raises:
            BusError: a servo has lost its torque (it has rebooted), or its watchdog has stopped it.
            PortError: the port is gone.

        """
        self._sent_at_s = self._clock.now_s()
        reply = self._cycle.read()
        if self._fast_reads and not self._cycle.fast:
            self._report_plain_reads()
        for joint in self._readings.update(reply, self._clock.now_s()):
            self._read_alarm(int(joint))
        place = self._reads % SLOW_EVERY
        self._reads += 1
        if place == 0:
            self._readings.update_slow(self._slow.read())
        elif self._armed and place == SLOW_EVERY // 3:
            self._liveness.torque()
        elif self._armed and place == 2 * SLOW_EVERY // 3:
            self._liveness.watchdog()
        return self._readings.state(self._clock.now_s())

    def write(self, command: JointCommand) -> None:
        """Send goal positions, kept inside the joint limits.

        Raises:
            ValueError: a goal is not finite.
            BusError: the pause since the last packet was long enough to stop the servos.
            PortError: the port is gone.

        """
        pause_s = self._clock.now_s() - self._sent_at_s
        if self._armed and pause_s > self._watchdog_s:
            raise BusError(
                f"{pause_s:.2f} s without a packet: the bus watchdog ({self._watchdog_s:g} s) has "
                "stopped the servos"
            )
        self._send_goals(command.goal_rad)
        self._sent_at_s = self._clock.now_s()

    def _prepare_reads(self, *, fast: bool) -> None:
        bus, ids = self._bus, self.robot.servo_ids
        self._cycle: ControlCycle = bus.cycle(ids, fast=fast)
        self._slow: ControlCycle = bus.slow_cycle(ids, fast=fast)
        self._liveness = LivenessCheck(bus, ids, fast=fast)
        self._fast_reads = fast

    def _budget(self, *, fast: bool) -> WireBudget:
        return chain_budget(self.joint_count, self.port.getBaudRate(), fast=fast)

    def _report_plain_reads(self) -> None:
        """Tell that fast reads were given up, and whether the wire still carries the rate."""
        self._fast_reads = False
        line = (
            f"fast sync reads given up after {FAST_FAILURES} failures in a row, plain from now on"
        )
        budget = self._budget(fast=False)
        if self._rate_hz is not None and budget.share(self._rate_hz) > 1.0:
            line += (
                f": the wire carries at most {budget.limit_hz:.0f} Hz of plain reads, not "
                f"{self._rate_hz:g} Hz: cycles will be late"
            )
        self.on_event(line)

    def _send_goals(self, goal_rad: Floats) -> Int32s:
        goals = self._goals.encode(goal_rad)
        self._cycle.write_goals(goals)
        return goals

    def _expect(self, servo_id: int, name: str, value: int) -> None:
        got = self._bus.read(servo_id, name)
        if got != value:
            raise BusError(f"servo {servo_id}: {name} is {got} after {value} was written to all")

    def _first_state(self) -> JointState:
        for _ in range(_FIRST_READS):
            state = self.read()
            if state.valid.all() and np.isfinite(state.voltage_v).all():
                return state
            self._reads = 0  # so that the slow state is read again, too
        silent = [str(i) for i, v in zip(self.robot.servo_ids, state.valid, strict=True) if not v]
        raise BusError(f"servo {', '.join(silent) or 'group'}: group read fails, pings do not")

    def _read_alarm(self, joint: int) -> None:
        servo_id = self.robot.servo_ids[joint]
        try:
            self._readings.update_alarm(joint, self._bus.read(servo_id, "Hardware Error Status"))
        except BusError:
            return  # the error byte carries the alert already; read again in the next cycle


class LivenessCheck:
    """Whether torque is still on and no watchdog has expired: two group reads of one byte."""

    def __init__(self, bus: DynamixelBus, servo_ids: Sequence[int], *, fast: bool) -> None:
        self._ids = tuple(servo_ids)
        self._torque = bus.block(servo_ids, "Torque Enable", "Torque Enable", fast=fast)
        self._watchdog = bus.block(servo_ids, "Bus Watchdog", "Bus Watchdog", fast=fast)

    def torque(self) -> None:
        """Check that torque is on; servos that do not reply are not judged.

        Raises:
            BusError: torque is off.
            PortError: the port is gone.

        """
        reply = self._torque.read()
        self._raise_for(reply.valid & (reply.data[:, 0] == 0), "torque is off: has it rebooted?")

    def watchdog(self) -> None:
        """Check that no watchdog has run out; servos that do not reply are not judged.

        Raises:
            BusError: a watchdog has expired.
            PortError: the port is gone.

        """
        reply = self._watchdog.read()
        tripped = reply.valid & (reply.data[:, 0] == WATCHDOG_TRIPPED)
        self._raise_for(tripped, "its bus watchdog has stopped it")

    def _raise_for(self, bad: Bools, what: str) -> None:
        if bad.any():
            which = ", ".join(str(i) for i, b in zip(self._ids, bad, strict=True) if b)
            raise BusError(f"servo {which}: {what}")
