"""Register values of other programs, against those that a run expects.

Factory values and those of a run give no finding. A run sets most others and reports them; the
doctor names them for users of other programs.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from snakewalk.config.robot import RobotConfig
from snakewalk.controller.console.finding import Finding, Grade, shown_subject
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.chain.chain_settings import chain_settings
from snakewalk.drivers.chain.fingerprint import (
    COMPARED,
    fixed_faults,
    present,
    set_register,
)
from snakewalk.drivers.chain.joint_codec import JointUnits
from snakewalk.drivers.chain.start_up import (
    ALL_REPLY,
    IDENTITY,
    identity_fault,
    pose_faults,
)
from snakewalk.drivers.protocol import feetech
from snakewalk.drivers.protocol.registers import (
    CURRENT_POSITION_MODE,
    POSITION_MODE,
    REVERSE,
    SECONDARY_ID_LIMIT,
    SHUTDOWN_ALARMS,
    TIME_PROFILE,
    TORQUE_ON_BY_GOAL,
    WATCHDOG_TRIPPED,
)

_GAINS = (
    "Position P Gain",
    "Position I Gain",
    "Position D Gain",
    "Feedforward 1st Gain",
    "Feedforward 2nd Gain",
)
_PROFILE = ("Profile Acceleration", "Profile Velocity")
_READ = ("Present Position", "Registered Instruction", "Present Current", "Present Velocity")
"""Registers read besides the marked ones."""
_SECONDARY_SERVO = 0x02
"""Bit of Drive Mode(10): the servo follows another one by a sync cable."""
_IDLE_A = 0.1
"""Current without torque that only a broken sensor shows (ours)."""
_BY_A_RUN = "a run sets it; other programs are affected"


@dataclass(frozen=True, slots=True)
class ServoRegisters:
    """Registers of one servo of the robot, by name; those that its firmware lacks are missing."""

    servo_id: int
    joint: int
    values: Mapping[str, int]


def read_registers(bus: DynamixelBus, robot: RobotConfig, servo_id: int) -> ServoRegisters:
    """Read what the checks need.

    Raises:
        NoAnswerError: nobody answered.
        PortError: the port is gone.

    """
    facts = bus.table_of(servo_id).facts
    names = [*present(_READ, facts), *facts.marked("set", *COMPARED)]
    values = bus.read_each(servo_id, names, names)
    return ServoRegisters(servo_id, robot.servo_ids.index(servo_id), values)


def register_findings(
    servos: Sequence[ServoRegisters], robot: RobotConfig, units: JointUnits
) -> list[Finding]:
    """Every register that is not as a factory or a run leaves it; one line if all are."""
    checks = _Checks(servos, robot, units)
    findings = [finding for finding in checks.all() if finding is not None]
    if not any(finding.check != "pose" for finding in findings):
        findings.append(
            Finding("settings", "ok", "all registers have the values of a factory or a run")
        )
    return findings


class _Checks:
    """The checks of the registers of a chain."""

    def __init__(
        self, servos: Sequence[ServoRegisters], robot: RobotConfig, units: JointUnits
    ) -> None:
        self._servos = servos
        self._robot = robot
        self._units = units
        self._full = units.full_pwm.tolist()
        first = servos[0].joint if servos else 0
        self._facts = robot.servo_records[first]
        """Record of a model on this port; the others have the same registers."""

    def all(self) -> list[Finding | None]:
        """Findings in the order of their weight; None where all is well."""
        facts = self._facts
        all_reply = ALL_REPLY
        shutdown = SHUTDOWN_ALARMS
        if facts.is_feetech:
            all_reply = 1
            shutdown = feetech.shutdown_alarms(facts)
        return [
            self._pose(),
            self._fixed_registers(),
            self._exchanged_servos(),
            self._secondary(),
            self._current_limit(),
            self._no_current(),
            self._finding_on_servos(
                "status return level",
                "warn",
                lambda servo: servo.values.get("Status Return Level", all_reply) != all_reply,
                "to writes",
                verb="do not reply",
                remedy=f"a run sets {self._entry('Status Return Level')} to {all_reply}; other "
                "programs get no reply",
            ),
            self._homing(),
            self._bits(
                "drive mode",
                "Drive Mode",
                REVERSE,
                "have a reversed direction",
                "is this intended?",
            ),
            self._bits(
                "drive mode", "Drive Mode", TORQUE_ON_BY_GOAL, "switch torque on at any goal"
            ),
            self._bits("drive mode", "Drive Mode", TIME_PROFILE, "have time-based profiles"),
            self._bits(
                "drive mode",
                "Drive Mode",
                _SECONDARY_SERVO,
                "follow another servo's sync cable",
                "set Drive Mode(10) bit 1 to 0, unless it is a dual joint",
            ),
            self._bits(
                "startup configuration",
                "Startup Configuration",
                0xFF,
                "have torque or old RAM values again as soon as there is power",
            ),
            self._finding_on_servos(
                "shutdown",
                "warn",
                lambda servo: servo.values.get("Shutdown", shutdown) & shutdown != shutdown,
                f"on, overloaded or overheated: {self._entry('Shutdown')} is masked",
                verb="stay",
            ),
            *self._pwm(),
            *self._limits(),
            self._unusual("operating mode", ("Operating Mode",)),
            self._unusual("gains", _GAINS),
            self._unusual("profile", _PROFILE),
            *self._watchdog(),
            *self._usual_registers(),
        ]

    def _fixed_registers(self) -> Finding | None:
        """Registers that must have one value for the scale and the direction of positions."""
        faults = [
            (f"{self._robot.joint_label(servo.joint)}: {text}", remedy)
            for servo in self._servos
            for text, remedy in fixed_faults(
                servo.servo_id, servo.values, self._robot.servo_records[servo.joint]
            )
        ]
        if not faults:
            return None
        return Finding("position scale", "fail", *map("; ".join, zip(*faults, strict=True)))

    def _usual_registers(self) -> list[Finding | None]:
        """Other registers that shape the motion or protect a servo, against a new servo's."""
        names = dict.fromkeys(
            name
            for servo in self._servos
            for name in self._robot.servo_records[servo.joint].marked("usual")
        )
        return [self._not_factory(name) for name in names]

    def _entry(self, name: str) -> str:
        row = self._facts.registers.get(name)
        return name if row is None else f"{name}({row.address})"

    def _pwm(self) -> list[Finding | None]:
        """Limits and goals of the PWM that make a servo weak."""
        full = self._full
        shown = " or ".join(map(str, dict.fromkeys(full[servo.joint] for servo in self._servos)))
        return [
            self._finding_on_servos(
                "PWM limit",
                "fail",
                lambda servo: servo.values.get("PWM Limit") == 0,
                f"move: {self._entry('PWM Limit')} is 0",
                verb="cannot",
                remedy=f"set it to {shown}",
            ),
            self._finding_on_servos(
                "PWM limit",
                "warn",
                lambda servo: (
                    0 < servo.values.get("PWM Limit", full[servo.joint]) < full[servo.joint]
                ),
                f"a {self._entry('PWM Limit')} below {shown}: weak and slow",
                remedy=f"set it to {shown}, unless it is intended",
            ),
            self._finding_on_servos(
                "goal PWM",
                "warn",
                lambda servo: (
                    servo.values.get("Goal PWM", full[servo.joint])
                    < servo.values.get("PWM Limit", full[servo.joint])
                ),
                f"a {self._entry('Goal PWM')} below its limit: weak or without power",
            ),
        ]

    def _limits(self) -> list[Finding | None]:
        """Limits, goals and sensors that other programs and faults leave behind."""
        units = self._units
        rows = self._facts.registers
        low, high = (rows[f"{end} Position Limit"].address for end in ("Max", "Min"))
        return [
            self._finding_on_servos(
                "position limits",
                "warn",
                lambda servo: (
                    servo.values.get("Min Position Limit", 0) > units.limits_raw[servo.joint][0]
                    or servo.values.get("Max Position Limit", math.inf)
                    < units.limits_raw[servo.joint][1]
                ),
                f"position limits ({low}, {high}) within the joint's range",
            ),
            self._weak_pitch_joints(
                "goal current",
                "warn",
                "Goal Current",
                f"a {self._entry('Goal Current')} below the robot's current limit: weak",
            ),
            self._finding_on_servos(
                "registered instruction",
                "warn",
                lambda servo: servo.values.get("Registered Instruction") == 1,
                "a registered write waiting: the next Action moves or changes it",
                remedy="switch its power off, on",
            ),
            self._finding_on_servos(
                "current sensor",
                "warn",
                lambda servo: (
                    servo.values.get("Torque Enable") == 0
                    and abs(servo.values.get("Present Current", 0))
                    > units.current_raw(servo.joint, _IDLE_A)
                ),
                "a current without torque: its sensor is off",
                remedy="limits by current do not hold for it: exchange the servo",
            ),
        ]

    def _not_factory(self, register: str) -> Finding | None:
        servos = [
            (
                f"{self._robot.joint_label(servo.joint)}: {register} {value}, factory {usual}",
                set_register(servo.servo_id, register, usual),
            )
            for servo in self._servos
            if (value := servo.values.get(register)) is not None
            and (usual := self._factory(servo, register, value)) != value
        ]
        if not servos:
            return None
        texts, commands = map("; ".join, zip(*servos, strict=True))
        return Finding(register.lower(), "warn", texts, f"is this intended? if not: {commands}")

    def _watchdog(self) -> list[Finding | None]:
        return [
            self._finding_on_servos(
                "watchdog",
                "warn",
                lambda servo: servo.values.get("Bus Watchdog") == WATCHDOG_TRIPPED,
                "been stopped by the bus watchdog: goals are refused",
                remedy="a run clears it: Bus Watchdog(98) = 0",
            ),
            self._finding_on_servos(
                "watchdog",
                "warn",
                lambda servo: 0 < servo.values.get("Bus Watchdog", 0) < WATCHDOG_TRIPPED,
                "an armed bus watchdog: another program runs, or was killed",
                remedy="end it; a run clears Bus Watchdog(98)",
            ),
        ]

    def _finding_on_servos(
        self,
        check: str,
        grade: Grade,
        is_bad: Callable[[ServoRegisters], bool],
        what: str,
        *,
        verb: str = "have",
        remedy: str = _BY_A_RUN,
    ) -> Finding | None:
        """Finding on the servos for which ``is_bad``; None if all are good."""
        bad = [servo.servo_id for servo in self._servos if is_bad(servo)]
        if not bad:
            return None
        subject = shown_subject(bad, verb, self._robot.label_of_servo)
        return Finding(check, grade, f"{subject} {what}", remedy)

    def _bits(
        self, check: str, register: str, bits: int, verb: str, remedy: str = _BY_A_RUN
    ) -> Finding | None:
        first, _, rest = verb.partition(" ")
        return self._finding_on_servos(
            check,
            "warn",
            lambda servo: bool(servo.values.get(register, 0) & bits),
            f"{rest}: {register} is not 0",
            verb=first,
            remedy=remedy,
        )

    def _pose(self) -> Finding | None:
        angles = np.zeros(self._robot.joint_count)
        for servo in self._servos:
            raw = servo.values["Present Position"]
            angles[servo.joint] = self._units.position_rad(servo.joint, raw)
        faults = pose_faults(self._robot, angles)
        if faults:
            bend_faults = "; ".join(fault.partition(": bend")[0] for fault in faults)
            return Finding("pose", "fail", bend_faults, faults[0].partition("limit of ")[2])
        return Finding("pose", "ok", "every joint stands within its limits")

    def _exchanged_servos(self) -> Finding | None:
        """Servos that moved other joints in the last run, if their power stayed on since."""
        robot = self._robot
        others = [
            f"{robot.joint_label(servo.joint)} was {robot.joint_label(servo.values[IDENTITY] - 1)}"
            for servo in self._servos
            if identity_fault(robot, servo.joint, servo.values.get(IDENTITY, 0)) is not None
        ]
        if not others:
            return None
        remedy = "have IDs been exchanged since? snakewalk bus set; else a run sets it"
        return Finding("joint order", "warn", f"in the last run {', '.join(others)}", remedy)

    def _secondary(self) -> Finding | None:
        shadows = [
            f"{self._robot.joint_label(servo.joint)} obeys ID {servo.values[name]} as well"
            for servo in self._servos
            for name in ("Secondary(Shadow) ID", "Secondary ID")
            if servo.values.get(name, 255) <= SECONDARY_ID_LIMIT
            and servo.values[name] != servo.servo_id
        ]
        if not shadows:
            return None
        remedy = "a run switches it off; until then it moves with the other's goals"
        return Finding("secondary ID", "fail", "; ".join(shadows), remedy)

    def _current_limit(self) -> Finding | None:
        return self._weak_pitch_joints(
            "current limit",
            "fail",
            "Current Limit",
            f"a {self._entry('Current Limit')} below the robot's current limit",
            "snakewalk bus set --current-limit, or a lower pitch_current_limit_a",
        )

    def _no_current(self) -> Finding | None:
        """Joints without a limit in the robot's file; a run checks the others."""
        return self._finding_on_servos(
            "current limit",
            "warn",
            lambda servo: (
                self._robot.all_axes[servo.joint] != "p" and servo.values.get("Current Limit") == 0
            ),
            f"a {self._entry('Current Limit')} of 0: no torque in modes that control the current",
            remedy="snakewalk bus set --current-limit",
        )

    def _weak_pitch_joints(
        self, check: str, grade: Grade, register: str, what: str, remedy: str = _BY_A_RUN
    ) -> Finding | None:
        """Pitch joints with a register of their current below the robot's limit."""
        robot = self._robot
        units = self._units
        return self._finding_on_servos(
            check,
            grade,
            lambda servo: (
                robot.all_axes[servo.joint] == "p"
                and servo.values.get(register, math.inf)
                < units.current_raw(servo.joint, robot.current_limits_a[servo.joint])
            ),
            what,
            remedy=remedy,
        )

    def _homing(self) -> Finding | None:
        step_rad = self._units.rad_per_position
        moved = [
            f"{self._robot.joint_label(servo.joint)} by {offset * step_rad[servo.joint]:+.2f} rad"
            for servo in self._servos
            if (offset := servo.values.get("Homing Offset", 0))
        ]
        if not moved:
            return None
        entry = self._entry("Homing Offset")
        remedy = f"a run leaves it: is each joint straight at 0? if not, {entry} = 0"
        return Finding("homing offset", "warn", f"the zero is moved: {', '.join(moved)}", remedy)

    def _unusual(self, check: str, registers: Sequence[str]) -> Finding | None:
        """Registers that are neither the factory's nor the run's."""
        unusual_values = []
        for servo in self._servos:
            run = {
                s.register: s
                for s in chain_settings(
                    self._robot, self._units, servo.joint, self._full[servo.joint]
                )
            }
            for name in registers:
                value = servo.values.get(name)
                if value is None:
                    continue
                usual = {self._factory(servo, name, value)}
                usual |= {run[name].value} if name in run else set()
                if check == "operating mode":
                    usual |= {POSITION_MODE, CURRENT_POSITION_MODE}
                if value not in usual:
                    unusual_values.append(f"{self._robot.joint_label(servo.joint)}: {name} {value}")
        return (
            Finding(check, "warn", "; ".join(unusual_values), _BY_A_RUN) if unusual_values else None
        )

    def _factory(self, servo: ServoRegisters, name: str, value: int) -> int:
        """Value of a new servo's register; ``value`` if the model's file does not give it."""
        facts = self._robot.servo_records[servo.joint]
        return value if facts.motor is None else facts.registers[name].initial
