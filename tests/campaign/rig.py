"""A chain of simulated servos under faults, and a witness who knows what is true.

The witness stamps every reading: during cycle k the servo of row j reports a current that encodes
(k, j), with the sign of its true current, so a value from another cycle or another servo is known
at sight. And it reads every packet
on the wire, so a goal beyond a limit is seen where it counts.
"""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from snakewalk.config.faults import FaultPlan
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import SafetyConfig
from snakewalk.drivers.bus.chain_bus import GroupCycle
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.chain.liveness import SLOW_EVERY
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.chain.start_up import IDENTITY
from snakewalk.drivers.protocol.packet import Instruction, InstructionPacket
from snakewalk.drivers.protocol.parser import PacketParser
from snakewalk.drivers.protocol.registers import REVERSE, ServoUnits
from snakewalk.drivers.safety.limits import SafetyLimits
from snakewalk.drivers.safety.recovery import Policy, Recovery
from snakewalk.drivers.safety.safe_link import SafeLink
from snakewalk.drivers.types import JointState
from snakewalk.sim.faults.fault_player import FaultPlayer
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant
from tests.oracles.raw_positions import raw_positions

ROBOT = RobotConfig(name="campaign", joint_axes="ypypyp")
SAFETY = SafetyConfig()
PATIENCE_S = 1.0
JOINTS = ROBOT.joint_count
TICK_RAD = 2 * np.pi / 4096
HELD_RAD = 0.02
HOLD_S = 0.05
"""From where its joints are read to where the goals that hold them are on the line, s, at most."""
NOTICED_CYCLES = 4 * SLOW_EVERY
"""A register is compared every third round at the latest; one more for an answer that is lost."""
_STAMPS = 60
_GOALS = (116).to_bytes(2, "little") + (4).to_bytes(2, "little")
_SYNC_READS = (Instruction.SYNC_READ, Instruction.FAST_SYNC_READ)
_TORQUE = (64).to_bytes(2, "little") + (1).to_bytes(2, "little")


@dataclass
class Witness:
    """What must not happen, counted."""

    beyond_limit: int = 0
    """Goals on the wire beyond a joint limit, or farther ahead of the joint than allowed and not on
    their way back to it."""
    too_fast: int = 0
    """Goals on the wire that move faster than allowed, unless to where the joint is or just was."""
    old: int = 0
    """Values taken for new that are of another cycle."""
    foreign: int = 0
    """Values taken for one servo's that are another's."""
    not_held: int = 0
    """Values that changed, or grew younger, without having been read."""
    raced: int = 0
    """Goals beyond a limit that another program wrote between the last reading of the goals and
    torque. No order of packets prevents it, so it is counted and is no violation."""
    complaints: list[str] = field(default_factory=list)

    @property
    def violations(self) -> int:
        """All of them."""
        return self.beyond_limit + self.too_fast + self.old + self.foreign + self.not_held


def _covers_goals(params: bytes) -> bool:
    """Whether a group read of these parameters contains Goal Position."""
    first, count = int.from_bytes(params[:2], "little"), int.from_bytes(params[2:4], "little")
    return first <= 116 and first + count >= 120


def rows_by_id(bank: ServoBank) -> np.ndarray | None:
    """(J,) rows of the servos that have the joints' IDs; None where two have one."""
    ids = bank["ID"].tolist()
    if sorted(ids) != sorted(ROBOT.servo_ids):
        return None
    return np.array([ids.index(servo) for servo in ROBOT.servo_ids])


Change = tuple[tuple[int, ...], str]
"""A joint, and the register of its servo that is not as the chain has set it; or joints whose
servos have exchanged IDs, and ``IDENTITY``."""


class ChangeWatch:
    """Whether a chain notices that registers of its servos are not as it has set them.

    A change counts while torque is on and the servo is read. It is noticed where what the chain
    says names joint and register, before ``NOTICED_CYCLES`` such cycles have passed; an end for
    another reason is none.
    """

    def __init__(self, chain: ServoChain, bank: ServoBank) -> None:
        self.reports: list[str] = []
        """What the chain and its recovery have said since the beginning."""
        self._cold: dict[int, int] = {}
        """Cycles in a row in which the temperature of a joint read 0 and was not reported."""
        self._cold_reported: set[int] = set()
        self.lines: list[str] = []
        """What the chain and its recovery have said since the last cycle."""
        self._chain, self._bank = chain, bank
        self._cycles: dict[Change, int] = {}
        self._pending: set[Change] = set()
        self._recoveries = 0
        self.noticed = self.ended_otherwise = 0
        self.unnoticed: list[str] = []
        chain.on_event = self.report
        make_check = chain._check

        def watched(check: Callable[..., GroupCycle | None], has_time: bool) -> None:
            self._pending |= self._changed()
            make_check(check, has_time)

        chain._check = watched  # type: ignore[method-assign]

    def report(self, line: str) -> None:
        """Keep a line of the chain or of its recovery."""
        self.lines.append(line)
        self.reports.append(line)

    def restart(self) -> None:
        """Begin again: the chain has been set up."""
        self._cycles.clear()
        self._pending.clear()
        self._cold.clear()
        self.lines.clear()

    def look(self, valid: np.ndarray, link: SafeLink) -> None:
        """Count what has changed, after a cycle; ``valid`` (J,) which joints were read."""
        if link.tripped is not None or link.recoveries != self._recoveries:
            self.end(link)
        changed = self._changed()
        self._cycles = {
            each: self._cycles.get(each, 0) + bool(valid[list(each[0])].any()) for each in changed
        }
        for joints, register in [c for c, k in self._cycles.items() if k == NOTICED_CYCLES]:
            self.unnoticed.append(f"unnoticed: {register} of {', '.join(map(str, joints))}")
        self._pending = {each for each in changed if self._cycles[each] < NOTICED_CYCLES}
        self._look_for_cold_sensors(valid)
        self.lines.clear()

    def _look_for_cold_sensors(self, valid: np.ndarray) -> None:
        """Count temperatures that read 0: the sensor of each joint is reported once."""
        rows = rows_by_id(self._bank)
        if rows is None:
            return
        is_cold = valid & (self._bank["Present Temperature"][rows] == 0)
        self._cold = {joint: count for joint, count in self._cold.items() if is_cold[joint]}
        for joint in set(np.flatnonzero(is_cold).tolist()) - self._cold_reported:
            if any(f"{ROBOT.joint_label(joint)}: temperature " in x for x in self.reports):
                self._cold_reported.add(joint)
                self.noticed += 1
                continue
            self._cold[joint] = self._cold.get(joint, 0) + 1
            if self._cold[joint] == NOTICED_CYCLES:
                self.unnoticed.append(f"unnoticed: temperature of {joint} reads 0")

    def end(self, link: SafeLink) -> None:
        """Count the changes that there were when the link latched, or was brought back."""
        lines = [*self.lines, link.tripped or ""]
        for change in self._pending:
            if any(self._is_named(change, line) for line in lines):
                self.noticed += 1
            else:
                self.ended_otherwise += 1
        self.restart()
        self._recoveries = link.recoveries

    def _is_named(self, change: Change, line: str) -> bool:
        joints, register = change
        # of exchanged servos, registers are another joint's, too
        whats = ("exchanged", "another program") if register == IDENTITY else (register,)
        names = map(ROBOT.joint_label, joints)
        return any(name in line for name in names) and any(what in line for what in whats)

    def _changed(self) -> set[Change]:
        """Those of the servos that have the joints' IDs; none where two have one."""
        bank, rows = self._bank, rows_by_id(self._bank)
        if rows is None:
            return set()
        found: set[Change] = set()
        exchanged = []
        for joint in np.flatnonzero(bank["Torque Enable"][rows] == 1).tolist():
            expected = dict(self._chain._configured.get(joint, {}))
            expected |= self._chain._fingerprints.get(joint, {})
            expected["Bus Watchdog"] = self._chain._watchdog_ticks
            if self._chain._goal_check._sent:
                expected["Goal Position"] = int(self._chain._goal_check._sent[-1][joint])
            row = rows[joint]
            other = {name for name, each in expected.items() if int(bank[name][row]) != each}
            if IDENTITY in other:
                exchanged.append(joint)
            else:
                found |= {((joint,), name) for name in other}
        if exchanged:
            found.add((tuple(exchanged), IDENTITY))
        return found


class Rig:
    """Line, chain and safe link, with faults and a witness."""

    def __init__(self, plan: FaultPlan, policy: Policy) -> None:
        self.line = SimLine(
            ServoBank(ROBOT.servo_ids, baud=1_000_000), BenchPlant(JOINTS), usb_latency_s=1e-3
        )
        self.bus = DynamixelBus(self.line, latency_s=0.003)
        self.chain = ServoChain(self.bus, ROBOT, watchdog_s=SAFETY.watchdog_s)
        self.witness = Witness()
        self.limits = SafetyLimits.from_config(ROBOT, SAFETY)
        self.changes = ChangeWatch(self.chain, self.line.bank)
        recovery = Recovery(
            self.chain,
            policy=policy,
            patience_s=PATIENCE_S,
            limit=10**6,
            overload_reboots=10**6 if policy == "resume" else 0,
            on_event=self.changes.report,
        )
        self.link = SafeLink(self.chain, self.limits, self.line.clock, recovery)
        self.player = FaultPlayer(self.line, plan)
        self.clashing = any(fault.kind in ("clash", "exchange") for fault in plan.fault)
        self._units = ServoUnits.of(self.bus.table.facts)
        self._low, self._high = self._raw_limits()
        self._cycle = 0
        self._goals_at_read: np.ndarray | None = None
        """Goals when the host read them last; None if it has written goals since."""
        self._seen: JointState | None = None
        self._was_rad: deque[tuple[float, np.ndarray]] = deque()
        """When, and where the servos of the joints were then."""
        self._sent: np.ndarray | None = None
        self._sent_at_s = 0.0
        self._steady = False
        self._recoveries = 0
        self._faked_current = np.zeros(JOINTS, np.bool_)
        """(J,) joints whose current was faked in a reply of this cycle."""
        self._stamp_readings()
        self.line.taps.append(self._overhear)

    def read(self) -> JointState:
        """One read under the witness's eyes."""
        self._cycle += 1
        self._faked_current[:] = False
        before = self._seen
        state = self.link.read()
        self._seen = state
        self.changes.look(state.valid, self.link)
        # a recovery reads as well, also one while goals are written
        self._steady = self._steady and self.link.recoveries == self._recoveries
        self._recoveries = self.link.recoveries
        self._check_values(state, before if self._steady else None)
        self._steady = True
        return state

    def restart(self) -> None:
        """Forget what was held: the chain has been enabled again."""
        self._seen, self._sent, self._steady = None, None, False
        self.changes.restart()

    def cool_down(self) -> None:
        """Let half an hour pass, for the motors alone."""
        self.line.firmware.protection.heat(np.arange(JOINTS), 30.0)

    @property
    def safe(self) -> bool:
        """Whether every motor is off, or held by a watchdog that has run out."""
        self.line.settle()
        off = (self.line.bank["Torque Enable"] == 0) | ~self.line.firmware.powered
        held = self.line.bank["Bus Watchdog"] == 0xFF
        return bool((off | held).all())

    def _raw_limits(self) -> tuple[np.ndarray, np.ndarray]:
        half = np.array(ROBOT.limit_rad)
        return raw_positions(self._units, -half), raw_positions(self._units, half)

    def _stamp_readings(self) -> None:
        firmware, bank = self.line.firmware, self.line.bank
        plain = firmware.refresh_motion
        rows = np.arange(JOINTS)

        def stamped() -> None:
            plain()
            sign = np.where(bank["Present Current"] < 0, -1, 1)
            stamp = self._cycle % _STAMPS * 8 + rows + 1
            bank["Present Current"][:] = np.where(firmware.no_output, 0, sign * stamp)
            firmware._readings.apply()
            self._faked_current |= self._is_faked("Present Current")

        firmware.refresh_motion = stamped  # type: ignore[method-assign]

    def _check_values(self, state: JointState, before: JointState | None) -> None:
        stamp = np.rint(np.abs(state.current_a) / self._units.a_per_current).astype(int)
        ok = state.valid & (stamp > 0)  # without an output stage there is no current to stamp
        ok &= ~self._faked_current
        old = ok & ((stamp - 1) // 8 != self._cycle % _STAMPS)
        foreign = ok & ~old & ((stamp - 1) % 8 != np.arange(JOINTS)) & (not self.clashing)
        self._sin("old", old)
        self._sin("foreign", foreign)
        if before is not None:
            held = (
                (state.position_rad == before.position_rad)
                & (state.current_a == before.current_a)
                & (state.age_s > before.age_s)
            )
            self._sin("not_held", ~state.valid & ~held)

    def _here_rad(self) -> np.ndarray:
        """(J,) where the servo of each joint is, by its own zero and direction."""
        bank = self.line.bank
        direction = np.where(bank["Drive Mode"] & REVERSE, -1.0, 1.0)
        zero_rad = bank["Homing Offset"] * TICK_RAD
        return self._joints(direction * self.line.firmware.plant.position_rad + zero_rad)

    def _overhear(self, time_s: float, from_host: bool, data: bytes) -> None:
        self._was_rad.append((time_s, self._here_rad()))
        while self._was_rad[0][0] < time_s - HOLD_S:
            self._was_rad.popleft()
        if not from_host:
            return
        for packet in PacketParser().feed(data):
            if not isinstance(packet, InstructionPacket):
                continue
            if packet.instruction in _SYNC_READS and _covers_goals(packet.params):
                self._goals_at_read = self.line.bank["Goal Position"].copy()
            if packet.instruction != Instruction.SYNC_WRITE:
                continue
            if packet.params[:4] == _GOALS:
                self._goals_at_read = None
                block = np.frombuffer(packet.params, np.uint8, offset=4).reshape(-1, 5)
                self._check_goals(time_s, block[:, 1:].copy().view("<i4")[:, 0])
            elif packet.params[:4] == _TORQUE and packet.params[5]:
                self._check_torque_on()

    def _joints(self, values: np.ndarray) -> np.ndarray:
        """(J,) of what each servo has, that of the servo of each joint."""
        rows = rows_by_id(self.line.bank)
        return values[slice(None) if rows is None else rows].copy()

    def _check_torque_on(self) -> None:
        """Judge the goals that servos without torque hold when it comes on."""
        goal = self._units.position_rad(self._joints(self.line.bank["Goal Position"]))
        limp = self._joints(self.line.bank["Torque Enable"]) == 0
        far = np.abs(goal - self._here_rad()) > self.limits.goal_lead_rad + TICK_RAD
        before = self._goals_at_read
        now = self.line.bank["Goal Position"]
        later = self._joints(np.zeros_like(limp) if before is None else now != before)
        self.witness.raced += int((far & limp & later).sum())
        self._sin("beyond_limit", far & limp & ~later & ~self._is_faked("Present Position"))

    def _check_goals(self, time_s: float, raw: np.ndarray) -> None:
        goal = self._units.position_rad(raw)
        self._sin("beyond_limit", (raw < self._low) | (raw > self._high))
        here = self._here_rad()
        known = here if self._seen is None else self._seen.position_rad
        ahead = np.minimum(np.abs(goal - known), np.abs(goal - here))
        last = self._sent
        far = ahead > self.limits.goal_lead_rad + TICK_RAD
        torque = self._joints(self.line.bank["Torque Enable"]) == 1
        far &= torque  # without it a goal counts when torque comes on
        if last is not None:  # the rate may let it come no nearer at once
            far &= np.abs(goal - known) >= np.abs(last - known)
        far &= ~self._is_faked("Present Position")
        self._sin("beyond_limit", far)
        if last is not None and self._steady:
            dt_s = min(time_s - self._sent_at_s, self.limits.stale_limit_s) + 2e-3
            fast = np.abs(goal - last) > self.limits.goal_rate_rad_s * dt_s + TICK_RAD
            # a chain that was interrupted holds: its goals are where its joints are, or just were
            where = [rad for _, rad in self._was_rad]
            held = np.minimum.reduce([np.abs(goal - each) for each in where]) < HELD_RAD
            self._sin("too_fast", fast & ~held & torque & ~self._is_faked("Present Position"))
        self._sent, self._sent_at_s = goal, time_s

    def _is_faked(self, register: str) -> np.ndarray:
        """(J,) joints whose servos show a constant value: a hold can only use what they show."""
        rows = self.line.firmware._readings._values.get(register, {})
        return self._joints(np.isin(np.arange(JOINTS), list(rows)))

    def _sin(self, kind: str, bad: np.ndarray) -> None:
        if bad.any():
            count = int(bad.sum())
            setattr(self.witness, kind, getattr(self.witness, kind) + count)
            joints = np.flatnonzero(bad).tolist()
            self.witness.complaints.append(
                f"{kind}: joints {joints}, cycle {self._cycle}, {self.line.clock.now_s():.4f} s"
            )
