"""The chain of servos as a joint link: radians to raw goals, raw blocks to a ``JointState``."""

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from snakewalk.config.arrays import Floats, Int32s
from snakewalk.config.robot import RobotConfig
from snakewalk.drivers.bus.budget import WireBudget, plain_reads_text, robot_budget
from snakewalk.drivers.bus.chain_bus import ChainBus, GroupCycle
from snakewalk.drivers.bus.control_cycle import FAST_FAILURES, CycleCounters
from snakewalk.drivers.bus.group_read import GroupReadReply
from snakewalk.drivers.chain.alarm_reader import AlarmReader
from snakewalk.drivers.chain.chain_settings import limitations
from snakewalk.drivers.chain.fingerprint import Fingerprint
from snakewalk.drivers.chain.fingerprint_file import FingerprintFile
from snakewalk.drivers.chain.goal_check import GoalCheck
from snakewalk.drivers.chain.identified_read import IdentifiedRead, check_stillness
from snakewalk.drivers.chain.imu_reader import ImuReader
from snakewalk.drivers.chain.joint_codec import GoalEncoder, JointUnits, Readings
from snakewalk.drivers.chain.liveness import SLOW_EVERY, LivenessCheck, RegisterCheck
from snakewalk.drivers.chain.lost_replies import LostReplies
from snakewalk.drivers.chain.motion_sensors import MotionSensors
from snakewalk.drivers.chain.recheck import MOVED_RAD, Recheck, recheck
from snakewalk.drivers.chain.register_rows import RegisterRows
from snakewalk.drivers.chain.silence_cause import silence_cause
from snakewalk.drivers.chain.soft_hold import limit_currents
from snakewalk.drivers.chain.start_up import (
    Inspection,
    ServoSettings,
    check_pose,
    configure,
    enable_replies,
    inspect,
    taken_over,
)
from snakewalk.drivers.chain.temperature_sensors import TemperatureSensors
from snakewalk.drivers.chain.torque_off import TorqueOff
from snakewalk.drivers.clock import Clock
from snakewalk.drivers.errors import BusError, ChainError, DriverError
from snakewalk.drivers.protocol.registers import (
    WATCHDOG,
    WATCHDOG_TICKS_MAX,
    WATCHDOG_UNIT_S,
    ServoUnits,
)
from snakewalk.drivers.types import JointCommand, JointState

_GOAL = "Goal Position"
_SLOW_AGE_S = 1.0
"""Age from which voltages and temperatures are read in every cycle until they come (ours)."""
_FIRST_READS = 5
"""Tries to get one complete reply at the start (ours)."""
_HOLD_READS = 2
"""Reads in which the servos may report their positions before they hold (ours)."""
_SETTLE_READS, _SETTLED_RAD = 50, 0.01
"""Reads for which a start waits for limp joints, every 20 ms, and the largest difference of two
readings of a joint at rest (ours)."""
STILL_RAD = 0.1
"""Largest distance of a joint from the position that it holds; farther is another joint (ours)."""


class ServoChain:
    """Joints of ``robot`` on ``bus``; implements ``JointLink``.

    Pass on a ``SafeLink`` around it, never the chain itself.
    """

    def __init__(
        self,
        bus: ChainBus,
        robot: RobotConfig,
        *,
        watchdog_s: float = 0.2,
        rate_hz: float | None = None,
        fingerprint_file: FingerprintFile | None = None,
        can_hold: bool = False,
    ) -> None:
        """Prepare; nothing is sent before ``enable``.

        Args:
            bus: servos of the robot's models.
            robot: IDs, limits, gains.
            watchdog_s: the servos stop after this time without an instruction.
            rate_hz: control cycles per second, checked against the wire; None: unchecked.
            fingerprint_file: compared with the servos at each ``enable``; None: not compared.
            can_hold: ``hold_softly`` may be called, so every joint has a current limit.

        Raises:
            ControlTableError: a model lacks a register or unit of the cycle, or has it elsewhere.

        """
        self.robot = robot
        self.inspection: Inspection | None = None
        """Servos that the last ``enable`` found."""
        self.on_event: Callable[[str], None] = lambda line: None
        """Function that gets a line on each changed setting, and on each fault that does not end a
        run."""
        self.on_state: Callable[[JointState], None] = lambda state: None
        """Function that gets each state that was read."""
        self._bus = bus
        self._port = bus.port_of(robot.servo_ids[0])
        self._clock = self._port.clock
        tables = [bus.table_of(servo_id) for servo_id in robot.servo_ids]
        scales = [ServoUnits.of(table.facts) for table in tables]
        self._units = JointUnits.of(robot, scales, can_hold=can_hold)
        # rounded up: at least the requested time
        ticks = math.ceil(watchdog_s / WATCHDOG_UNIT_S - 1e-9)
        self._watchdog_ticks = min(WATCHDOG_TICKS_MAX, max(1, ticks))
        self._watchdog_s = self._watchdog_ticks * WATCHDOG_UNIT_S
        self._watchdogs = {
            joint: self._watchdog_ticks for joint, table in enumerate(tables) if WATCHDOG in table
        }
        """Ticks of the watchdog of each joint that has one."""
        self._configured: dict[int, Mapping[str, int]] = {}
        self._fingerprints: dict[int, Fingerprint] = {}
        self._liveness: LivenessCheck | None = None
        self._rate_hz = rate_hz
        self._file = fingerprint_file
        self._goals = GoalEncoder(self._units)
        self._readings = Readings(tables, self._units)
        self._prepare_reads(fast=True)
        self._imu = None if robot.imu is None else ImuReader(bus, robot.imu)
        self._reads = 0
        self._due: bool | None = None
        """Check of the newest read: whether its cycle has time to repeat one; None: it is made."""
        self._is_called = False
        """Whether ``check_servos`` was called since the last read; the next read leaves it out."""
        self._losses = LostReplies()
        self._alarms = AlarmReader(bus, robot, self._readings)
        self._sensors = TemperatureSensors.of(robot)
        self._motion_sensors = MotionSensors(robot)
        self._torque_off = TorqueOff(bus, robot, self._clock, self._watchdog_s)
        self._armed = False
        self._sent_at_s = -math.inf
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
        """Faults on the wire so far."""
        return self._cycle.counters

    @property
    def fast(self) -> bool:
        """Whether fast sync reads are in use."""
        return self._cycle.fast

    def enable(self) -> JointState:
        """Check and set up all servos, goal = present, torque on, watchdog armed.

        Raises:
            ChainError: the servos are not the robot's, have an alarm, are beyond a limit, or differ
                from the fingerprint file.
            ConfigError: the fingerprint file is broken.
            BudgetError: the wire cannot carry the rate with the reads of these firmwares.
            BusError: a servo does not follow an instruction; torque is off again.
            PortError: the port is gone.

        """
        replies = enable_replies(self._bus, self.robot)
        self.inspection = inspect(self._bus, self.robot, replies=replies)
        if self.inspection.faults:
            raise ChainError([str(fault) for fault in self.inspection.faults])
        if self._imu is not None:
            self._imu.find()
        if self._rate_hz is not None:
            self._budget(fast=self.inspection.fast_reads).check(self._rate_hz)
        for line in (
            *limitations(self.robot),
            *taken_over(self.inspection.servos, self.robot, self._units),
        ):
            self.on_event(line)
        self._note(configure(self._bus, self.robot, self._units, None, self.on_event))
        if self._file is not None:
            ids = self.robot.servo_ids
            by_id = {ids[joint]: value for joint, value in self._fingerprints.items()}
            for line in self._file.check(self.robot, by_id):
                self.on_event(line)
        self._prepare_reads(fast=self.inspection.fast_reads)
        return self._begin()

    def recheck(self, believed_rad: Floats) -> Recheck:
        """Compare the chain after an interruption with its earlier state; moves nothing.

        ``believed_rad`` (J,) are the last credible angles.

        Raises:
            BusError: a servo does not reply.
            PortError: the port is gone.

        """
        return recheck(
            self._bus,
            self.robot,
            self._units,
            self.inspection,
            self._configured,
            self._fingerprints,
            believed_rad,
        )

    def resume(self, state_check: Recheck) -> JointState:
        """Continue after an interruption: torque that is on stays on, nothing moves.

        Servos that lost torque or settings are set up again. For the others the watchdog is
        cleared, and the goal becomes the present position.

        Raises:
            ChainError: ``state_check`` has a fault, a joint has moved since, or a servo does not
                identify itself.
            BusError: a servo does not follow an instruction; torque is off again.
            PortError: the port is gone.

        """
        if state_check.faults:
            raise ChainError([str(fault) for fault in state_check.faults])
        self._note(configure(self._bus, self.robot, self._units, state_check.reset, self.on_event))
        return self._begin(state_check.position_rad)

    def _note(self, settings: Mapping[int, ServoSettings]) -> None:
        self._configured |= {joint: setting.ram for joint, setting in settings.items()}
        self._fingerprints |= {joint: setting.fingerprint for joint, setting in settings.items()}

    def _begin(self, found_rad: Floats | None = None) -> JointState:
        """Read the first state, hold and arm the watchdogs; torque is off if that fails."""
        self._reads = 0
        self._due = None
        self._armed = False
        self._alarms.clear()
        check_pose(self.robot, self._first_state().position_rad)
        try:
            here_rad = self._identified.positions_rad(_FIRST_READS, ask_again=True)
            before_rad = here_rad if found_rad is None else found_rad
            check_stillness(self.robot, here_rad, before_rad, MOVED_RAD)
            return self._hold_and_arm(here_rad)
        except BaseException:
            self.disable()
            raise

    def reboot(self, joint: int) -> None:
        """Restart a joint's servo, which clears its alarm; it is limp until ``resume``.

        Raises:
            BusError: it does not reply, or refuses.
            PortError: the port is gone.

        """
        self._bus.reboot(self.robot.servo_ids[joint])

    def reopen(self) -> None:
        """Close and open the lost ports.

        Raises:
            PortError: one is still missing.

        """
        self._bus.reopen()

    def hold(self) -> None:
        """Set the goals to the present positions.

        A joint keeps its goal if its servo does not report position and identity in one reply.

        Raises:
            PortError: the port is gone.

        """
        here_rad = self._identified.positions_rad(_HOLD_READS)
        self._send_goals(np.where(np.isfinite(here_rad), here_rad, self._goal_rad))

    def _hold_and_arm(self, here_rad: Floats) -> JointState:
        """Goal = present, torque on, watchdog armed, each read back; return the state."""
        bus = self._bus
        ids = self.robot.servo_ids
        watched = [ids[joint] for joint in self._watchdogs]
        if watched:
            self._torque_off.is_watched = False
            bus.sync_write(watched, WATCHDOG, 0)  # goals follow at once, else an old goal counts
        for is_last in (False, True):
            goals = self._send_goals(here_rad)
            if watched:  # before torque, which is never on without it
                bus.sync_write(watched, WATCHDOG, self._watchdog_ticks)
                self._expect(WATCHDOG, self._watchdogs)
                self._torque_off.is_watched = True
            # read last: meanwhile another program may have written goals, or exchanged IDs
            now_rad, reported_goals = self._identified.positions_and_goals(
                _FIRST_READS, ask_again=True
            )
            if is_last or not np.abs(now_rad - here_rad).max() > 0.5 * STILL_RAD:
                break
            here_rad = self._settled(now_rad)
        check_stillness(self.robot, now_rad, here_rad, STILL_RAD)
        for joint in np.flatnonzero(reported_goals != goals).tolist():
            raise BusError(
                f"{self.robot.joint_label(joint)}: Goal Position is {reported_goals[joint]:.0f} "
                f"after {goals[joint]} was written to all"
            )
        bus.sync_write(ids, "Torque Enable", 1)
        self._expect("Torque Enable", dict.fromkeys(range(len(ids)), 1))
        self._liveness = self._new_liveness()
        self._armed = True
        self._sent_at_s = self._clock.now_s()
        state = self.read()
        check_stillness(self.robot, state.position_rad, here_rad, STILL_RAD)
        return state

    def _settled(self, here_rad: Floats) -> Floats:
        """Angles (J,) after limp joints have come to rest, or after a while."""
        for _ in range(_SETTLE_READS):
            before_rad = here_rad
            self._clock.sleep_until_s(self._clock.now_s() + 0.02)
            here_rad = self._identified.positions_rad(_FIRST_READS, ask_again=True)
            if np.abs(here_rad - before_rad).max() <= _SETTLED_RAD:
                break
        return here_rad

    def _new_liveness(self) -> LivenessCheck:
        return LivenessCheck(
            self._bus,
            self.robot,
            self._configured,
            self._fingerprints,
            self._watchdogs,
            self._goal_check,
            fast=self._fast_reads,
            rad_per_position=lambda joint: float(self._units.rad_per_position[joint]),
        )

    def hold_softly(self, current_a: Floats) -> None:
        """Hold the present positions with currents of at most ``current_a`` (J,).

        Reads still feed the watchdogs and compare settings.

        Raises:
            BusError: a servo cannot limit its current, or does not confirm it.
            PortError: the port is gone.

        """
        self.hold()
        self._configured = limit_currents(
            self._bus, self.robot, self._units, self._configured, current_a
        )
        self._liveness = self._new_liveness()
        self._sent_at_s = self._clock.now_s()

    def disable(self) -> None:
        """Switch off torque, then the watchdog, on every servo, even if others fail.

        Raises:
            BusError: servos did not confirm; their watchdog stays armed and stops them.
            PortError: a port does not come back; the watchdog stops its servos.

        """
        self._armed = False
        self._torque_off.send()

    def read(self) -> JointState:
        """Read all joints once; voltages and temperatures in every 16th call and when overdue.

        If no joint was read, the other requests wait for the next call. Calls ``check_servos`` if
        the caller has not done so since the last read.

        Raises:
            BusError: a servo has another goal than the one sent to it; raised by ``check_servos``.
                Or the pause since the last packet was long enough to stop the servos.
            PortError: the port is gone.

        """
        self._check_pause()
        self._sent_at_s = self._clock.now_s()
        stalled_s = self.counters.stalled_s
        reply = self._cycle.read()
        if self.counters.stalled_s > stalled_s:  # its values are old, or nobody waited for them
            self._check_pause()
            reply = self._cycle.read()
        if self._fast_reads and not self._cycle.fast:
            self._report_plain_reads()
        read = reply.valid_count
        losses = self._losses.update(read, len(reply.valid), self.counters)
        if losses is not None:
            self.on_event(losses)
        measured_at_s = self._decode_state(reply)
        imu = None
        if read > 0:  # else the additional reads wait, and the state grows stale
            self._reads += 1
            has_time = not self._read_slow(measured_at_s) and reply.complete
            if self._liveness is not None and self._check(self._liveness.check_goals, has_time):
                has_time = False
            self._due = has_time
            if not self._is_called:
                self._make_due_check()
            self._is_called = False
            imu = None if self._imu is None else self._imu.read(self.on_event)
        state = self._readings.state(self._clock.now_s())
        state = state._replace(imu=imu, stalled_s=self.counters.stalled_s)
        self.on_state(state)
        return state

    def _read_slow(self, measured_at_s: float) -> bool:
        """Read voltages and temperatures if due; return whether they were."""
        is_slow_cycle = (self._reads - 1) % SLOW_EVERY == 0
        if not is_slow_cycle and measured_at_s - self._readings.slow_at_s <= _SLOW_AGE_S:
            return False
        reply = self._slow.read()
        self._sent_at_s = self._clock.now_s() - self._slow.since_sent_s
        self._readings.update_slow(reply, self._sent_at_s)
        readings = self._readings
        for line in self._sensors.update(readings.temperature_c, readings.current_a, measured_at_s):
            self.on_event(line)
        return True

    def _decode_state(self, reply: GroupReadReply, *, again: bool = False) -> float:
        """Decode a group read of the state; return its time, s."""
        measured_at_s = self._clock.now_s() - self._cycle.since_sent_s
        alerted = self._readings.update(reply, measured_at_s, again=again)
        lines = self._motion_sensors.update(
            self._readings.motion, self._goal_rad, reply.valid, measured_at_s
        )
        for line in (*self._alarms.update(alerted), *lines):
            self.on_event(line)
        return measured_at_s

    def check_servos(self) -> None:
        """Check torque, watchdogs and settings of the servos, one register per cycle.

        Call it after the goals of a cycle. A read without a reply skips the check.

        Raises:
            BusError: a servo has lost torque or a setting (reboot, or another program), or its
                watchdog has stopped it or is not armed.
            PortError: the port is gone.

        """
        self._is_called = True
        self._make_due_check()

    def _make_due_check(self) -> None:
        has_time = self._due
        self._due = None
        if has_time is not None and self._liveness is not None:
            self._check(self._liveness.check, has_time)

    def _check(self, check: Callable[..., GroupCycle | None], has_time: bool) -> bool:
        """Make a check; return whether all servos were read.

        If an alarm switched a servo off since the group read, the error states the alarm.
        """
        if not self._armed or self._readings.alert:
            return False
        asked = None
        try:
            asked = check(self._reads - 1, has_time=has_time)
        except BusError:
            self._decode_state(self._cycle.read(), again=True)
            if not self._readings.alert:
                raise
        if asked is not None:
            self._sent_at_s = self._clock.now_s() - asked.since_sent_s
        return asked is not None

    def write(self, command: JointCommand) -> None:
        """Send goal positions within the joint limits.

        Raises:
            ValueError: a goal is not finite.
            BusError: the pause since the last packet was long enough to stop the servos.
            PortError: the port is gone.

        """
        self._check_pause()
        self._send_goals(command.goal_rad)
        self._check_pause()
        self._sent_at_s = self._clock.now_s()

    def _check_pause(self) -> None:
        pause_s = self._clock.now_s() - self._sent_at_s
        if self._armed and pause_s > self._watchdog_s:
            raise BusError(
                f"{pause_s:.2f} s without a packet: this program did not run; the bus watchdog "
                f"({self._watchdog_s:g} s) has stopped the servos that have one"
            )

    def explain(self, joint: int) -> str | None:
        """Read a joint's servo again; return the cause in its registers or its goal, or None."""
        try:
            cause = None if self._liveness is None else self._liveness.explain(joint)
            return cause or self._goal_check.explain(joint)
        except DriverError:
            return None

    def explain_silence(self, joints: Sequence[int]) -> str | None:
        """Ask the servos of joints without a reply again; return the cause, or None."""
        try:
            return silence_cause(self._bus, self.robot, joints)
        except DriverError:
            return None

    def _prepare_reads(self, *, fast: bool) -> None:
        bus = self._bus
        ids = self.robot.servo_ids
        self._cycle: GroupCycle = bus.cycle(ids, fast=fast)
        self._slow: GroupCycle = bus.slow_cycle(ids, fast=fast)
        labels = [*map(self.robot.joint_label, range(self.robot.joint_count))]
        goals = bus.block(ids, _GOAL, _GOAL, fast=fast)
        self._goal_check = GoalCheck(labels, goals, RegisterRows.of(bus, ids, _GOAL))
        self._identified = IdentifiedRead(bus, self.robot, self._units)
        self._fast_reads = fast

    def _budget(self, *, fast: bool) -> WireBudget:
        return robot_budget(self.robot, self._port.getBaudRate(), fast=fast)

    def _report_plain_reads(self) -> None:
        self._fast_reads = False
        ports = self._cycle.given_up_on if len(self._bus.parts) > 1 else ()
        budget = self._budget(fast=False)
        self.on_event(plain_reads_text(budget, self._rate_hz, FAST_FAILURES, ports))

    def _send_goals(self, goal_rad: Floats) -> Int32s:
        goals = self._goals.encode(goal_rad)
        self._cycle.write_goals(goals)
        self._goal_check.note_write(goals)
        self._goal_rad = goal_rad
        return goals

    def _expect(self, name: str, expected: Mapping[int, int]) -> None:
        """Compare a register with the values written to the servos of some joints.

        Raises:
            BusError: a servo differs, or does not reply.

        """
        check = RegisterCheck.of(self._bus, self.robot, name, expected, fast=False)
        differing, _ = check.compare(ask_again=self._bus)
        for joint, goal in differing.items():
            raise BusError(
                f"{self.robot.joint_label(joint)}: {name} is {goal} after {expected[joint]} was "
                "written to all"
            )

    def _first_state(self) -> JointState:
        for _ in range(_FIRST_READS):
            state = self.read()
            if state.valid.all() and state.slow_age_s.max() <= _SLOW_AGE_S:
                return state
            self._reads = 0  # so that the slow state is read again
        silent = ", ".join(map(self.robot.joint_label, np.flatnonzero(~state.valid).tolist()))
        raise BusError(f"{silent or 'all servos'}: group read fails, pings do not")
