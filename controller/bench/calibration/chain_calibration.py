"""Calibration: the joint of each servo, its direction, zero and range.

Initially only IDs and models are known. One joint at a time moves slowly, with a small goal
current, through a ``SafeLink``; the others hold. An observer names the joint that moved. A range
ends where a servo pushes with its full permitted current and does not turn.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Protocol

import numpy as np

from snakewalk.config.errors import InputError
from snakewalk.config.joint_names import joint_label
from snakewalk.config.loader import checked
from snakewalk.config.robot import JointConfig, RobotConfig
from snakewalk.config.robot.register_bounds import half_range_rad
from snakewalk.config.servo_catalogue import servo_model
from snakewalk.controller.bench.calibration.progress import (
    CalibrationProgress,
    JointRange,
    Journal,
    SeenBend,
)
from snakewalk.controller.bench.calibration.slow_motions import (
    BUS_TRIES,
    RANGE_RAD,
    CalibrationBench,
)
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.bus.feetech_bus import FeetechBus
from snakewalk.drivers.bus.feetech_scan import find_feetech
from snakewalk.drivers.port.byte_port import BytePort
from snakewalk.drivers.protocol.control_table import model_of

CURRENT_A = 0.3
"""Goal current by default, A: an XM430 turns with an eighth of its stall torque (ours)."""
BEYOND_RAD = 0.25
"""Angle beyond the robot's limit up to which the sweep looks for a stop (ours)."""
MARGIN_RAD = 0.1
"""Distance of the limit from the stop; the simulator's stops are as far beyond limits (ours)."""
LEAST_LIMIT_RAD = 0.1
"""A joint with less range is of no use (ours)."""
_SCANS = 3
"""Scans until the bus has as many servos as the robot has joints (ours)."""
_PROBES = 6
"""Probes until a servo's replies are single and complete. Two servos with one ID never reach it, a
busy line soon (ours)."""


class Observer(Protocol):
    """A person or a program that sees the robot."""

    def which(
        self, servo_id: int, wiggle: Callable[[], None], joint_of_id: Mapping[int, int]
    ) -> SeenBend:
        """Name the joint that a servo moves; ``wiggle`` moves it, as often as needed.

        ``joint_of_id`` has the IDs of the joints found before.
        """
        ...

    def straighten(self) -> None:
        """Lay the body straight and level; torque is off meanwhile."""
        ...


@dataclass(frozen=True, slots=True)
class ChainCalibration:
    """Results as a robot and in words."""

    robot: RobotConfig
    ranges: tuple[JointRange, ...]
    """Range of each joint, head first; empty if no range was swept."""
    notes: tuple[str, ...]
    """Joints to look at: those with less range than the others, or without a stop."""


def find_servos(
    port: BytePort, latency_s: float, count: int | None = None, *, feetech: bool = False
) -> dict[int, str]:
    """Model of each servo on the bus, by ID.

    Args:
        port: the line.
        latency_s: how long adapter and driver may hold bytes back.
        count: number of servos to expect; with fewer or more the bus is scanned again.
        feetech: whether the servos speak Feetech's protocol.

    Raises:
        InputError: two servos share an ID, or all servos that reply are of another make.
        ControlTableError: a servo is of a model that is not known.
        PortError: the port is gone.

    """
    bus: DynamixelBus = DynamixelBus(port, latency_s=latency_s, tries=BUS_TRIES)
    scan = partial(_models, bus)
    if feetech:
        bus = FeetechBus(port, latency_s=latency_s, tries=BUS_TRIES)
        scan = partial(_feetech_models, port, latency_s)
    servos = scan()
    for _ in range(_SCANS - 1):
        if count is None or len(servos) == count:
            break
        servos |= scan()
    if not servos:
        _reject_another_make(port, latency_s, feetech=feetech)
    shared = [str(servo_id) for servo_id in sorted(servos) if not _has_unique_id(bus, servo_id)]
    if shared:
        raise InputError(
            f"{port.name}: replies of ID {', '.join(shared)} come doubled or damaged: two servos "
            "share it, or the line is bad; connect one alone and give it another ID: snakewalk "
            "bus set --new-id"
        )
    return dict(sorted(servos.items()))


def _models(bus: DynamixelBus) -> dict[int, str]:
    return {servo_id: model_of(reply.model_number) for servo_id, reply in bus.scan().items()}


def _feetech_models(port: BytePort, latency_s: float) -> dict[int, str]:
    feetech_servos = find_feetech(port, (port.getBaudRate(),), latency_s=latency_s)
    return {servo.servo_id: servo.model for servo in feetech_servos}


def _reject_another_make(port: BytePort, latency_s: float, *, feetech: bool) -> None:
    """Reject a bus on which only servos of another make reply.

    Raises:
        InputError: names them.

    """
    if feetech:
        others = _models(DynamixelBus(port, latency_s=latency_s, tries=BUS_TRIES))
    else:
        others = _feetech_models(port, latency_s)
    if others:
        model = next(iter(others.values()))
        ids = ", ".join(map(str, others))
        raise InputError(
            f"{port.name}: the servos that reply (ID {ids}) are {model}, of another make than the "
            f"robot's; name a robot by --robot whose servos have model = {model!r}"
        )


def _has_unique_id(bus: DynamixelBus, servo_id: int) -> bool:
    probes = (bus.probe(servo_id) for _ in range(_PROBES))
    return any(probe.answered and not probe.doubled and not probe.damaged for probe in probes)


def unknown_chain(like: RobotConfig, servos: Mapping[int, str], current_a: float) -> RobotConfig:
    """Chain of all servos in the order of their IDs, each free over its whole turn, none strong.

    Raises:
        InputError: there are not as many servos as the robot has joints.

    """
    if len(servos) != like.joint_count:
        shown = ", ".join(map(str, servos)) or "none"
        raise InputError(
            f"robot {like.name} has {like.joint_count} joints, the bus {len(servos)} servos (ID "
            f"{shown}): connect all of the robot's, and no others, or name another robot"
        )
    joints = tuple(
        JointConfig(
            axis="p",  # whatever it is: pitch joints have a goal current
            id=servo_id,
            model=model,
            name=f"servo_{servo_id}",
            limit_rad=min(RANGE_RAD, half_range_rad(servo_model(model))),
            position_p_gain=like.servo.position_p_gain,
            current_limit_a=current_a,
        )
        for servo_id, model in sorted(servos.items())
    )
    return like.model_copy(update={"joint_axes": "p" * len(joints), "joints": joints})


@dataclass(frozen=True, slots=True)
class CalibrationSettings:
    """Settings of a calibration."""

    latency_s: float = 0.004
    """Longest delay of bytes by adapter and driver."""
    current_a: float = CURRENT_A
    """Goal current of every servo."""
    sweep: bool = True
    """Whether to search for the ends of the ranges."""


def calibrate(
    port: BytePort,
    like: RobotConfig,
    observer: Observer,
    *,
    name: str,
    settings: CalibrationSettings = CalibrationSettings(),
    stop_requested: Callable[[], str | None] = lambda: None,
    on_progress: Callable[[str], None] = lambda step: None,
    journal: Journal | None = None,
) -> ChainCalibration:
    """Calibrate the chain on ``port``.

    Args:
        port: the line.
        like: a robot with the same axes and links; its IDs, signs and zeros do not matter.
        observer: the observer that sees the robot.
        name: of the robot that is found.
        settings: latency, current, and whether to sweep the ranges.
        stop_requested: returns why the safe link has to latch, or None.
        on_progress: gets a line for each step.
        journal: of an interrupted calibration, which continues; saved after each answer and range.

    Raises:
        InputError: the servos are not the robot's, a joint does not move, two servos seem to move
            the same joint, or a joint cannot have the range that the robot wants.
        DriverError: a servo does not do what an instruction asks, or safety has latched.

    """
    journal = journal or Journal(CalibrationProgress(joint_axes=like.joint_axes))
    on_progress("search for servos")
    servos = find_servos(port, settings.latency_s, like.joint_count, feetech=like.is_feetech)
    journal.known.check_servos(servos, "--resume")
    unknown = unknown_chain(like, servos, settings.current_a)
    bench = CalibrationBench(port, unknown, settings.latency_s, stop_requested, on_progress)
    journal.note(servos=servos)
    steps = _Steps(like, bench, on_progress, journal)
    for row, servo_id in enumerate(unknown.servo_ids):
        if servo_id not in journal.known.bends:
            steps.ask(observer, servo_id, partial(bench.wiggle, row))
    bench.name_joints([steps.label(servo_id) for servo_id in unknown.servo_ids])
    if not journal.known.zeros_rad:
        on_progress("lay the body straight")
        observer.straighten()
        straight_rad = dict(zip(unknown.servo_ids, bench.where_rad().tolist(), strict=True))
        journal.note(zeros_rad=straight_rad)
    if settings.sweep:
        steps.sweep(unknown.servo_ids)
    return _composed_calibration(like, name, unknown, journal.known, sweep=settings.sweep)


@dataclass
class _Steps:
    """Steps of a calibration, each of which adds to the progress."""

    like: RobotConfig
    bench: CalibrationBench
    on_progress: Callable[[str], None]
    journal: Journal

    @property
    def known(self) -> CalibrationProgress:
        return self.journal.known

    def label(self, servo_id: int) -> str:
        return joint_label(self.like.joint_names[self.known.bends[servo_id].joint], servo_id)

    def ask(self, observer: Observer, servo_id: int, wiggle: Callable[[], None]) -> None:
        """Ask which joint a servo moves.

        Raises:
            InputError: the joint is known already, or the robot does not have it.

        """
        self.on_progress(f"ID {servo_id}: which joint")
        parent_by_joint = {bend.joint: other for other, bend in self.known.bends.items()}
        bend = observer.which(servo_id, wiggle, parent_by_joint)
        if not 0 <= bend.joint < self.like.joint_count or bend.joint in parent_by_joint:
            raise InputError(
                f"ID {servo_id}: the joint that moved, number {bend.joint + 1} from the head, is "
                f"assigned already, or {self.like.name} has no such joint"
            )
        self.journal.note(bends={**self.known.bends, servo_id: bend})

    def sweep(self, servo_ids: Sequence[int]) -> None:
        """Find the ends of each joint's range, from the head on."""
        rows = {servo_id: row for row, servo_id in enumerate(servo_ids)}
        in_order = sorted(servo_ids, key=lambda servo_id: self.known.bends[servo_id].joint)
        straight_rad = np.array([self.known.zeros_rad[servo_id] for servo_id in servo_ids])

        stops: dict[tuple[int, int], float | None] = {}

        def push_each() -> None:
            with self.bench.straight(straight_rad) as push:
                for servo_id in [
                    next_id for next_id in in_order if next_id not in self.known.ranges
                ]:
                    bend = self.known.bends[servo_id]
                    row = rows[servo_id]
                    reach_rad = self.like.limit_rad[bend.joint] + BEYOND_RAD
                    for side in 1, -1:
                        servo_and_side = servo_id, side
                        if servo_and_side not in stops:
                            self.on_progress(f"range of {self.label(servo_id)}")
                            record_stop = partial(stops.__setitem__, servo_and_side)
                            push(row, side * bend.direction, reach_rad, record_stop)
                    low, high = stops[servo_id, -1], stops[servo_id, 1]
                    ends = JointRange(low_rad=None if low is None else -low, high_rad=high)
                    self.journal.note(ranges={**self.known.ranges, servo_id: ends})

        if len(self.known.ranges) < len(in_order):
            self.bench.retried(push_each, lambda: len(stops))


def _composed_calibration(
    like: RobotConfig,
    name: str,
    unknown: RobotConfig,
    progress: CalibrationProgress,
    *,
    sweep: bool,
) -> ChainCalibration:
    """Compose the robot and the notes.

    Raises:
        InputError: a joint has no range to speak of, or its servo's turn ends within it.

    """
    joints = []
    faults = []
    notes = []
    rows = {progress.bends[servo_id].joint: row for row, servo_id in enumerate(unknown.servo_ids)}
    ids = [unknown.servo_ids[rows[joint]] for joint in range(like.joint_count)]
    ranges = [progress.ranges[servo_id] for servo_id in ids] if sweep else []
    stopless = [k for k, r in enumerate(ranges) if r.low_rad is None or r.high_rad is None]
    for joint, servo_id in enumerate(ids):
        limit = like.limit_rad[joint]
        said = joint_label(like.joint_names[joint], servo_id)
        if ranges:
            stops = [
                abs(stop)
                for stop in (ranges[joint].low_rad, ranges[joint].high_rad)
                if stop is not None
            ]
            if stops and min(stops) - MARGIN_RAD < limit - 0.02:
                limit = round(min(stops) - MARGIN_RAD, 3)
                notes.append(
                    f"{said}: stops at {_range_text(ranges[joint])}: its limit is {limit:g} rad"
                )
            elif joint in stopless and len(stopless) <= len(ranges) // 2:
                notes.append(
                    f"{said}: stops at {_range_text(ranges[joint])}: "
                    "no stop where other joints have one"
                )
        if limit < LEAST_LIMIT_RAD:
            faults.append(f"{said}: only {limit + MARGIN_RAD:.2f} rad to its stop: free it")
            continue
        model = progress.servos[servo_id]
        joint_changes = {
            "id": servo_id,
            "model": None if model == like.servo.model else model,
            "sign": progress.bends[servo_id].direction,
            "zero_rad": round(progress.zeros_rad[servo_id], 5),
        }
        if limit != like.limit_rad[joint]:
            joint_changes["limit_rad"] = limit
        joint_config = like.joints[joint] if like.joints else JointConfig()
        joints.append(joint_config.model_copy(update=joint_changes))
    if faults:
        raise InputError(faults)
    keys = {"name": name, "joints": tuple(joints)}
    # checked again: a zero and a limit together may leave the servo's turn
    robot = checked(RobotConfig, like.model_copy(update=keys).model_dump(), f"robot {name}")
    return ChainCalibration(robot, tuple(ranges), tuple(notes))


def _range_text(joint_range: JointRange) -> str:
    ends = (joint_range.low_rad, joint_range.high_rad)
    return " and ".join("none" if end is None else f"{end:+.2f} rad" for end in ends)
