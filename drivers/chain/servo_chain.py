"""The chain of servos as a joint link: radians to raw goals, raw blocks to a ``JointState``."""

import math
from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np

from snakewalk.config.arrays import Floats, Int32s
from snakewalk.config.robot import RobotConfig
from snakewalk.drivers.bus.budget import WireBudget, robot_budget
from snakewalk.drivers.bus.chain_bus import ChainBus, GroupCycle
from snakewalk.drivers.bus.control_cycle import FAST_FAILURES, CycleCounters
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.bus.group_read import GroupReadReply
from snakewalk.drivers.chain.imu_reader import ImuReader
from snakewalk.drivers.chain.joint_codec import GoalEncoder, JointUnits, Readings
from snakewalk.drivers.chain.liveness import SLOW_EVERY, LivenessCheck, RegisterCheck
from snakewalk.drivers.chain.recheck import MOVED_RAD, Recheck, recheck
from snakewalk.drivers.chain.start_up import (
    IDENTITY,
    Inspection,
    check_pose,
    configure,
    identity,
    inspect,
    let_reply,
)
from snakewalk.drivers.clock import Clock
from snakewalk.drivers.errors import BusError, ChainError, PortError
from snakewalk.drivers.protocol.registers import (
    WATCHDOG_TICKS_MAX,
    WATCHDOG_UNIT_S,
    ServoUnits,
)
from snakewalk.drivers.types import JointCommand, JointState

_SLOW_S = 1.0
"""Age from which voltages and temperatures are read in every cycle until they come (ours)."""
_OFF_ROUNDS = 8
"""Group reads in which the servos may confirm that their torque is off (ours)."""
_OFF_S = 1.0
"""How long servos that do not are asked one by one, round after round, s (ours): longer than a line
may be disturbed before the state is stale and for some tenths of a second after it."""
_PORT_PATIENCE_S, _REOPEN_S = 2.0, 0.1
"""How long torque off waits for a port that is gone, and between the tries to open it (ours)."""
_FIRST_READS = 5
"""Tries to get one complete reply at the start (ours)."""
_LOSS_READS, _LOSSES = 100, 4
"""So many losses within so many reads show a bad line (ours): a servo that falls silent, or a
computer that stands still for a while, is one loss."""
_GOAL = "Goal Position"
_HOLD_READS = 2
"""Reads in which the servos may tell where they are before they hold (ours)."""
STILL_RAD = 0.1
"""A joint that is read farther from where it was just set to hold is not the one that holds
(ours)."""


class ServoChain:
    """Joints of ``robot`` on ``bus``; implements ``JointLink``.

    Hand out a ``SafeLink`` around it, never itself.
    """

    def __init__(
        self,
        bus: ChainBus,
        robot: RobotConfig,
        *,
        watchdog_s: float = 0.2,
        rate_hz: float | None = None,
    ) -> None:
        """Prepare; nothing is sent before ``enable``.

        Args:
            bus: servos of the robot's models.
            robot: ids, limits, gains.
            watchdog_s: after so long without an instruction the servos stop by themselves.
            rate_hz: control cycles a second, checked against what the wire allows; None: unchecked.

        Raises:
            ControlTableError: a model lacks a register or a unit that the cycle needs, or has it
                elsewhere than the others.

        """
        self.robot = robot
        self.inspection: Inspection | None = None
        """The servos as found by the last ``enable``."""
        self.on_event: Callable[[str], None] = lambda line: None
        """Gets a line on each setting that another program has left in a servo, when fast reads are
        given up, and when replies get lost again and again."""
        self.on_state: Callable[[JointState], None] = lambda state: None
        """Gets each state that was read."""
        self._bus = bus
        self._port = bus.port_of(robot.servo_ids[0])
        self._clock = self._port.clock
        tables = [bus.table_of(servo_id) for servo_id in robot.servo_ids]
        self._units = JointUnits.of(robot, [ServoUnits.of(table) for table in tables])
        # rounded up: at least the time that was asked for
        ticks = math.ceil(watchdog_s / WATCHDOG_UNIT_S - 1e-9)
        self._watchdog_ticks = min(WATCHDOG_TICKS_MAX, max(1, ticks))
        self._watchdog_s = self._watchdog_ticks * WATCHDOG_UNIT_S
        self._configured: dict[int, dict[str, int]] = {}
        self._liveness: LivenessCheck | None = None
        self._rate_hz = rate_hz
        self._goals = GoalEncoder(self._units)
        self._readings = Readings(tables, self._units)
        self._prepare_reads(fast=True)
        self._imu = None if robot.imu is None else ImuReader(bus, robot.imu)
        self._reads = 0
        self._losses = _Losses()
        self._armed = False
        self._sent_at_s = -np.inf
        self._goal_rad = np.full(robot.joint_count, np.nan)

    @property
    def joint_count(self) -> int:
        """Number of joints J."""
        return self.robot.joint_count

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
        replies = let_reply(self._bus, self.robot)
        self.inspection = inspect(self._bus, self.robot, replies=replies)
        if self.inspection.faults:
            raise ChainError([str(fault) for fault in self.inspection.faults])
        if self._imu is not None:
            self._imu.find()
        if self._rate_hz is not None:
            self._budget(fast=self.inspection.fast_reads).check(self._rate_hz)
        blind = np.flatnonzero(~self._units.measures_current)
        if len(blind):
            self.on_event(
                f"{self.robot.servo_models[blind[0]]}: measures no current: safety "
                "watches its output instead, as a share of the stall current"
            )
        self._configured = configure(self._bus, self.robot, self._units, None, self.on_event)
        self._prepare_reads(fast=self.inspection.fast_reads)
        return self._begin()

    def recheck(self, believed_rad: Floats) -> Recheck:
        """Compare the chain after an interruption with what it was; moves nothing.

        Args:
            believed_rad: (J,) where its joints were when their readings could last be believed.

        Raises:
            BusError: a servo does not reply.
            PortError: the port is gone.

        """
        known, settings = self.inspection, self._configured
        return recheck(self._bus, self.robot, self._units, known, settings, believed_rad)

    def resume(self, found: Recheck) -> JointState:
        """Go on after an interruption: torque that is on stays on, nothing moves.

        A joint that is elsewhere than ``found``, or whose servo does not tell that it is this
        joint's, is not gone on with: two servos with one ID reply in turn. Servos that lost their
        torque or their settings (rebooted) are set up again. The others get their watchdog cleared
        and, right behind it, goal = present.

        Raises:
            ChainError: ``found`` forbids it.
            BusError: a servo does not do what an instruction asks; torque is off again then.
            PortError: the port is gone.

        """
        if found.faults:
            raise ChainError([str(fault) for fault in found.faults])
        again = configure(self._bus, self.robot, self._units, found.reset, self.on_event)
        self._configured.update(again)
        return self._begin(found.position_rad)

    def _begin(self, found_rad: Floats | None = None) -> JointState:
        """Read the first state, hold and arm the watchdogs; torque is off if that fails."""
        self._reads = 0
        check_pose(self.robot, self._first_state().position_rad)
        try:
            here_rad = self._own_positions(_FIRST_READS, ask_again=True)
            before_rad = here_rad if found_rad is None else found_rad
            self._check_stillness(here_rad, before_rad, MOVED_RAD)
            return self._hold_and_arm(here_rad)
        except BaseException:
            self.disable()
            raise

    def reboot(self, joint: int) -> None:
        """Restart a joint's servo, which ends its alarm; it is limp until ``resume`` sets it up.

        Raises:
            BusError: it does not answer, or refuses.
            PortError: the port is gone.

        """
        self._bus.reboot(self.robot.servo_ids[joint])

    def reopen(self) -> None:
        """Close and open the port again; of several, those that are gone.

        Raises:
            PortError: it is still not there.

        """
        self._bus.reopen()

    def _own_positions(self, reads: int, *, ask_again: bool = False) -> Floats:
        """(J,) where each joint is, by a reply that also tells which joint's its servo is."""
        return self._own_registers(reads, ask_again=ask_again)[0]

    def _own_registers(self, reads: int, *, ask_again: bool = False) -> tuple[Floats, Floats]:
        """(J,) where each joint is, and its raw goal, by a reply that tells whose its servo is.

        So no joint is given the place of another whose servo has the same ID, or its ID.

        Args:
            reads: how often all are asked; NaN for a joint whose servo has not told it.
            ask_again: ask those alone: one may refuse to be read across registers that it lacks.

        Raises:
            BusError: a servo that is asked alone does not reply.
            PortError: the port is gone.

        """
        here_rad, goals = np.full((2, self.joint_count), np.nan)
        registers = self._own
        start = registers[IDENTITY].address

        def take(joint: int, values: Mapping[str, int]) -> None:
            if values[IDENTITY] == identity(joint):
                here_rad[joint] = self._units.position_rad(joint, values[self._position_name])
                goals[joint] = values[_GOAL]

        for _ in range(reads):
            reply = self._identified.read()
            for joint in np.flatnonzero(reply.valid & np.isnan(here_rad)).tolist():
                row = reply.data[joint].tobytes()
                take(joint, {n: r.decode(row[r.address - start :]) for n, r in registers.items()})
            if not np.isnan(here_rad).any():
                break
        for joint in np.flatnonzero(np.isnan(here_rad)).tolist() if ask_again else ():
            take(joint, self._bus.read_each(self.robot.servo_ids[joint], registers))
        return here_rad, goals

    def _check_stillness(self, position_rad: Floats, found_rad: Floats, most_rad: float) -> None:
        """Compare where the joints are with where they have just been found.

        Raises:
            ChainError: a joint is elsewhere, or it is not known where, though it should hold.

        """
        moved_rad = np.abs(position_rad - found_rad)
        if np.nanmax(moved_rad, initial=0.0) <= most_rad and not np.isnan(moved_rad).any():
            return
        joint = int(np.argmax(np.where(np.isnan(moved_rad), np.inf, moved_rad)))
        name = self.robot.joint_label(joint)
        if np.isnan(moved_rad[joint]):
            text = (
                f"{name}: its servo does not tell that it is this joint's: two servos with one ID?"
            )
        else:
            text = (
                f"{name}: read {position_rad[joint] - found_rad[joint]:+.2f} rad from where it was "
                "found just before: two servos with one ID, or moved by hand"
            )
        raise ChainError([text])

    def hold(self) -> None:
        """Set the goals to where the joints are.

        A joint whose servo does not tell both in one reply, where it is and that it is this
        joint's, keeps its goal: it does not reply, or two servos have one ID, or IDs were
        exchanged.

        Raises:
            PortError: the port is gone.

        """
        here_rad = self._own_positions(_HOLD_READS)
        self._send_goals(np.where(np.isfinite(here_rad), here_rad, self._goal_rad))

    def _hold_and_arm(self, here_rad: Floats) -> JointState:
        """Goal = present, torque on, watchdog armed; every step read back; the state then."""
        bus, ids = self._bus, self.robot.servo_ids
        bus.sync_write(ids, "Bus Watchdog", 0)  # goals follow at once, else an old goal counts
        goals = self._send_goals(here_rad)
        now_rad, held = self._own_registers(_FIRST_READS, ask_again=True)
        self._check_stillness(now_rad, here_rad, STILL_RAD)  # IDs may have been exchanged since
        for joint in np.flatnonzero(held != goals).tolist():
            raise BusError(
                f"{self.robot.joint_label(joint)}: {_GOAL} is {held[joint]:.0f} after "
                f"{goals[joint]} was written to all"
            )
        bus.sync_write(ids, "Torque Enable", 1)
        self._expect("Torque Enable", [1] * len(ids))
        ticks = self._watchdog_ticks
        bus.sync_write(ids, "Bus Watchdog", ticks)
        self._expect("Bus Watchdog", [ticks] * len(ids))
        self._liveness = LivenessCheck(
            bus, self.robot, self._configured, ticks, fast=self._fast_reads
        )
        self._armed = True
        state = self.read()
        self._check_stillness(state.position_rad, here_rad, STILL_RAD)
        return state

    def disable(self) -> None:
        """Torque off, then the watchdog, on every servo, also where others fail.

        Servos that do not confirm it in a group read are asked one by one, again and again for a
        limited time: their watchdogs may be disarmed. Where one of several ports is gone, the
        servos on the others are off before it is waited for.

        Raises:
            BusError: servos that did not confirm; their watchdog stays armed and stops them.
            PortError: a port is gone and does not come back; the watchdog stops its servos.

        """
        self._armed = False
        give_up_s = self._clock.now_s() + _PORT_PATIENCE_S
        on = {part: self._joints_on(part) for part in self._bus.parts}
        gone: list[DynamixelBus] = []
        for part, joints in on.items():
            try:
                part.sync_write(self._ids_of(joints), "Torque Enable", 0)
            except PortError:
                gone.append(part)
        silent: list[int] = []
        faults: list[PortError] = []
        for part in sorted(on, key=gone.__contains__):
            try:
                if part in gone:
                    self._wait_to_send_torque_off(part, on[part], give_up_s)
                silent += self._without_torque_off(part, on[part])
            except PortError as error:
                faults.append(error)
        names = ", ".join(map(self.robot.joint_label, sorted(silent)))
        if faults:
            which = "its servos: a servo" if len(on) > 1 else "a servo"
            text = (
                f"{'; '.join(map(str, faults))}; torque is not off: {which} that has torque holds "
                f"where its bus watchdog ({self._watchdog_s:.3g} s) stops it: switch the servo "
                "power off"
            )
            if len(on) > len(faults) and not silent:
                text += "; on the other ports torque is off"
            raise PortError(f"{text}; {names}: not confirmed" if names else text) from faults[0]
        if names:
            raise BusError(
                f"{names}: torque off is not confirmed; if a joint still holds, switch the servo "
                "power off"
            )

    def _joints_on(self, part: DynamixelBus) -> list[int]:
        """Joints whose servos are on one of the ports."""
        return [k for k, i in enumerate(self.robot.servo_ids) if self._bus.port_of(i) is part.port]

    def _ids_of(self, joints: Iterable[int]) -> list[int]:
        return [self.robot.servo_ids[joint] for joint in joints]

    def _wait_to_send_torque_off(
        self, part: DynamixelBus, joints: Sequence[int], give_up_s: float
    ) -> None:
        """Torque off, unconfirmed, on a port that is gone: wait a little, it may be back."""
        while True:
            late = self._clock.now_s() >= give_up_s
            try:
                part.reopen()
                part.sync_write(self._ids_of(joints), "Torque Enable", 0)
            except PortError:
                if late:
                    raise
                self._clock.sleep_until_s(self._clock.now_s() + _REOPEN_S)
            else:
                return

    def _without_torque_off(self, bus: DynamixelBus, on_it: Sequence[int]) -> list[int]:
        """Joints that do not confirm that their torque is off; the others' watchdogs are off."""
        ids, joints = self.robot.servo_ids, list(on_it)
        for _ in range(_OFF_ROUNDS):
            asked = self._ids_of(joints)
            reply = bus.block(asked, "Torque Enable", "Torque Enable", fast=False).read()
            off = reply.valid & (reply.data[:, 0] == 0)
            joints = [joint for joint, done in zip(joints, off, strict=True) if not done]
            if not joints:
                break
            bus.sync_write(self._ids_of(joints), "Torque Enable", 0)
        give_up_s = self._clock.now_s() + _OFF_S
        silent = joints  # those behind a silent servo stay silent in a group read
        while silent and self._clock.now_s() < give_up_s:
            silent = [joint for joint in silent if not self._is_off(bus, ids[joint], give_up_s)]
        confirmed = self._ids_of(joint for joint in on_it if joint not in silent)
        if confirmed:
            bus.sync_write(confirmed, "Bus Watchdog", 0)
            # the port may be closed right behind it: a reply shows that the packet has arrived
            bus.block(confirmed, "Bus Watchdog", "Bus Watchdog", fast=False).read()
        return silent

    def _is_off(self, bus: DynamixelBus, servo_id: int, give_up_s: float) -> bool:
        """Ask a servo alone to switch its torque off; whether it confirms that, in time."""
        if self._clock.now_s() >= give_up_s:
            return False
        try:
            bus.write(servo_id, "Torque Enable", 0, tries=1)
        except BusError:
            return False
        return True

    def read(self) -> JointState:
        """Read all joints once; voltages and temperatures in every 16th call and when overdue.

        Where no joint could be read nothing else is asked: that is put off to the next call.

        Raises:
            BusError: a servo has lost its torque or a setting (it has rebooted, or another program
                has written to it), or its watchdog has stopped it or is not armed.
            PortError: the port is gone.

        """
        self._sent_at_s = self._clock.now_s()
        reply = self._cycle.read()
        if self._fast_reads and not self._cycle.fast:
            self._report_plain_reads()
        read = reply.valid_count
        losses = self._losses.update(read, len(reply.valid))
        if losses is not None:
            self.on_event(losses)
        measured_at_s = self._take(reply)
        imu = None
        if read > 0:  # else what is asked beside it waits, too, and the state grows stale
            self._reads += 1
            is_alone = not self._read_slow(measured_at_s)
            self._check_liveness(has_time=is_alone and reply.complete)
            imu = None if self._imu is None else self._imu.read(self.on_event)
        state = self._readings.state(self._clock.now_s())
        if imu is not None:
            state = state._replace(imu=imu)
        self.on_state(state)
        return state

    def _read_slow(self, measured_at_s: float) -> bool:
        """Read voltages and temperatures, if it is their turn or they are overdue; if they were."""
        its_turn = (self._reads - 1) % SLOW_EVERY == 0
        if not its_turn and measured_at_s - self._readings.slow_at_s <= _SLOW_S:
            return False
        reply = self._slow.read()
        self._sent_at_s = self._clock.now_s() - self._slow.since_sent_s
        self._readings.update_slow(reply, self._sent_at_s)
        return True

    def _take(self, reply: GroupReadReply, *, again: bool = False) -> float:
        """Take in a group read of the state, or one more in this cycle; when it was measured, s."""
        measured_at_s = self._clock.now_s() - self._cycle.since_sent_s
        for joint in self._readings.update(reply, measured_at_s, again=again):
            self._read_alarm(int(joint))
        return measured_at_s

    def _check_liveness(self, *, has_time: bool) -> None:
        """Check torque, watchdogs, settings; where a servo tells an alarm, that is the reason.

        An alarm that switches a servo off may come between the group read and the check.

        Args:
            has_time: the state is all that was read in this cycle, and all servos replied.

        """
        if not self._armed or self._liveness is None or self._readings.alert:
            return
        try:
            asked = self._liveness.check(self._reads - 1, has_time=has_time)
            if asked is not None:
                self._sent_at_s = self._clock.now_s() - asked.since_sent_s
        except BusError:
            self._take(self._cycle.read(), again=True)
            if not self._readings.alert:
                raise

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
        self._cycle: GroupCycle = bus.cycle(ids, fast=fast)
        self._slow: GroupCycle = bus.slow_cycle(ids, fast=fast)
        table = bus.table_of(ids[0])
        self._position_name = table.state_names[-1]
        names = IDENTITY, _GOAL, self._position_name
        self._own = {name: table.register(name) for name in names}
        self._identified: GroupCycle = bus.block(ids, names[0], names[-1], fast=False)
        self._fast_reads = fast

    def _budget(self, *, fast: bool) -> WireBudget:
        return robot_budget(self.robot, self._port.getBaudRate(), fast=fast)

    def _report_plain_reads(self) -> None:
        """Tell that fast reads were given up, and whether the wire still carries the rate."""
        self._fast_reads = False
        line = (
            f"fast sync reads given up after {FAST_FAILURES} failures in a row, plain from now on"
        )
        if len(self._bus.parts) > 1:
            line = f"{', '.join(self._cycle.given_up_on)}: {line}"
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
        self._goal_rad = goal_rad
        return goals

    def _expect(self, name: str, values: Sequence[int]) -> None:
        """Compare a register of all servos with what was written to it.

        Raises:
            BusError: a servo holds something else, or does not reply.

        """
        expected = dict(enumerate(values))
        check = RegisterCheck.of(self._bus, self.robot, name, expected, fast=False)
        differing, _ = check.compare(ask_again=self._bus)
        for joint, got in differing.items():
            raise BusError(
                f"{self.robot.joint_label(joint)}: {name} is {got} after {expected[joint]} was "
                "written to all"
            )

    def _first_state(self) -> JointState:
        for _ in range(_FIRST_READS):
            state = self.read()
            if state.valid.all() and state.slow_age_s.max() <= _SLOW_S:
                return state
            self._reads = 0  # so that the slow state is read again, too
        silent = ", ".join(map(self.robot.joint_label, np.flatnonzero(~state.valid).tolist()))
        raise BusError(f"{silent or 'all servos'}: group read fails, pings do not")

    def _read_alarm(self, joint: int) -> None:
        servo_id = self.robot.servo_ids[joint]
        try:
            self._readings.update_alarm(joint, self._bus.read(servo_id, "Hardware Error Status"))
        except BusError:
            return  # the error byte carries the alert already; read again in the next cycle


class _Losses:
    """Replies that are lost again and again, or of all servos: the line is bad, not a servo."""

    def __init__(self) -> None:
        self._began: deque[int] = deque()  # numbers of reads, each the first of a loss
        self._reads = 0
        self._whole, self._any, self._shown = True, True, False

    def update(self, read: int, joints: int) -> str | None:
        """Count a read; a line for the user, the first time that there is reason for one.

        Args:
            read: number of joints that were read.
            joints: of all.

        """
        self._reads += 1
        whole, some = read == joints, read > 0
        if self._whole and not whole:
            self._began.append(self._reads)
        nobody = not (some or self._any)
        self._whole, self._any = whole, some
        while self._began and self._began[0] <= self._reads - _LOSS_READS:
            self._began.popleft()
        if self._shown or not (nobody or len(self._began) >= _LOSSES):
            return None
        self._shown = True
        span = self._reads - self._began[0] + 1
        found = f"replies got lost {_LOSSES} times within {span} reads:"
        if nobody:
            found = "no servo was read in two reads in a row: no power,"
        return (
            f"{found} noise, a loose plug, another program on the line, or a computer that is too "
            "busy; see snakewalk doctor"
        )
