"""Calibration: which servo is which joint, which way round, where straight is, and how far it goes.

Nothing is known of the chain but its servos' IDs and models. Every motion passes a ``SafeLink``
around a chain of all servos in current-based position mode with a small goal current: one joint
moves, slowly, the others hold where they are. Somebody who sees the robot says what has moved; the
ends of the range are where a servo pushes with all that it is allowed and does not turn.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from typing import Literal, Protocol

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.joint_names import joint_label
from snakewalk.config.loader import checked
from snakewalk.config.robot import JointConfig, RobotConfig
from snakewalk.config.run import SafetyConfig
from snakewalk.controller.kinematics.smoothstep import cubic
from snakewalk.controller.runtime.loop import ticks
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.errors import BusError, SafetyTrippedError
from snakewalk.drivers.port.byte_port import BytePort
from snakewalk.drivers.protocol.control_table import model_of
from snakewalk.drivers.safety.limits import SafetyLimits
from snakewalk.drivers.safety.safe_link import SafeLink
from snakewalk.drivers.types import JointCommand, JointState

WIGGLE_RAD = 0.25
"""How far a joint is wiggled (ours)."""
WIGGLE_S = 0.8
"""How long the way there takes, and the way back (ours)."""
CURRENT_A = 0.3
"""Goal current by default, A: an XM430 turns with an eighth of its stall torque (ours)."""
MOVED_SHARE = 0.5
"""A joint that makes less of its wiggle is held or has no power (ours)."""
SWEEP_RAD_S = 1.0
"""Speed of the sweep (ours)."""
BEYOND_RAD = 0.25
"""How far beyond the limit of the robot the sweep looks for a stop (ours)."""
STOP_LAG_RAD = 0.1
"""A joint that is so far behind its goal, and pushes ... (ours)."""
STOP_EFFORT = 0.8
"""... with this share of its goal current, for ... (ours)."""
STOP_S = 0.2
"""... so long, s, has met its stop (ours)."""
REST_S = 0.3
"""How long a joint may come to rest before the next moves, s (ours)."""
MARGIN_RAD = 0.1
"""How far before a stop the limit is set; the simulator's stops are as far beyond limits (ours)."""
LEAST_LIMIT_RAD = 0.1
"""A joint with less range is of no use (ours)."""
_RANGE_RAD = 3.1
_CYCLE_S = 0.02
_READS = 5


@dataclass(frozen=True, slots=True)
class SeenBend:
    """What somebody saw when a servo was wiggled."""

    joint: int
    """Which joint moved, counted from 0 at the head."""
    direction: Literal[1, -1]
    """1: first it bent the head side to the left (yaw), or lifted it (pitch); -1: the other way."""


class Observer(Protocol):
    """Somebody, or something, that sees the robot."""

    def which(
        self, servo_id: int, wiggle: Callable[[], None], known: Mapping[int, int]
    ) -> SeenBend:
        """Say which joint a servo moves; ``wiggle`` moves it, as often as it is called.

        ``known`` are the joints that have been found already, with their servos' IDs.
        """
        ...

    def straighten(self) -> None:
        """Lay the body straight and level; torque is off meanwhile."""
        ...


@dataclass(frozen=True, slots=True)
class JointRange:
    """Where a joint met its stops."""

    low_rad: float | None
    """None: not within ``BEYOND_RAD`` of the robot's limit."""
    high_rad: float | None


@dataclass(frozen=True, slots=True)
class ChainCalibration:
    """What was found, as a robot and in words."""

    robot: RobotConfig
    ranges: tuple[JointRange, ...]
    """Of each joint, head first; empty if no range was swept."""
    notes: tuple[str, ...]
    """What a person should look at: joints with less range than the others, or without a stop."""


def find_servos(port: BytePort, latency_s: float) -> dict[int, str]:
    """Model of each servo on the bus, by ID.

    Raises:
        InputError: two servos share an ID.
        ControlTableError: a servo is of a model that is not known.
        PortError: the port is gone.

    """
    bus = DynamixelBus(port, latency_s=latency_s)
    found = bus.scan()
    probes = [bus.probe(each) for each in found]
    shared = [str(probe.servo_id) for probe in probes if probe.doubled or probe.damaged]
    if shared:
        raise InputError(
            f"{port.name}: replies of ID {', '.join(shared)} come doubled or damaged: two servos "
            "share it, or the line is bad; connect one alone and give it another ID: snakewalk "
            "bus set --new-id"
        )
    return {servo_id: model_of(reply.model_number) for servo_id, reply in found.items()}


def unknown_chain(like: RobotConfig, servos: Mapping[int, str], current_a: float) -> RobotConfig:
    """Chain of all servos in the order of their IDs, each free over its whole turn, none strong.

    Raises:
        InputError: there are not as many servos as the robot has joints.

    """
    if len(servos) != like.joint_count:
        shown = ", ".join(map(str, servos)) or "none"
        raise InputError(
            f"robot {like.name} has {like.joint_count} joints, the bus {len(servos)} servos (ID "
            f"{shown}): connect all of the robot's, and no others, or say another robot"
        )
    joints = tuple(
        JointConfig(
            axis="p",  # whatever it is: pitch joints have a goal current
            id=servo_id,
            model=model,
            limit_rad=_RANGE_RAD,
            position_p_gain=like.servo.position_p_gain,
            current_limit_a=current_a,
        )
        for servo_id, model in sorted(servos.items())
    )
    return like.model_copy(update={"joint_axes": "p" * len(joints), "joints": joints})


def calibrate(
    port: BytePort,
    like: RobotConfig,
    observer: Observer,
    *,
    name: str,
    latency_s: float = 0.004,
    current_a: float = CURRENT_A,
    sweep: bool = True,
    stop_requested: Callable[[], str | None] = lambda: None,
    on_progress: Callable[[str], None] = lambda step: None,
) -> ChainCalibration:
    """Find out everything about the chain on ``port``.

    Args:
        port: the line.
        like: a robot with the same axes and links; its IDs, signs and zeros do not matter.
        observer: who sees the robot.
        name: of the robot that is found.
        latency_s: how long adapter and driver may hold bytes back.
        current_a: goal current of every servo.
        sweep: whether the ends of the ranges are looked for.
        stop_requested: returns why the safe link has to latch, or None.
        on_progress: gets a line for each step.

    Raises:
        InputError: the servos are not the robot's, a joint does not move, two servos seem to move
            the same joint, or a joint cannot have the range that the robot wants.
        DriverError: a servo does not do what an instruction asks, or safety has latched.

    """
    on_progress("who is on the bus")
    servos = find_servos(port, latency_s)
    unknown = unknown_chain(like, servos, current_a)
    bench = _Bench(port, unknown, latency_s, stop_requested)
    seen: dict[int, int] = {}
    signs: dict[int, Literal[1, -1]] = {}
    for row, servo_id in enumerate(unknown.servo_ids):
        on_progress(f"ID {servo_id}: which joint")
        bend = observer.which(
            servo_id,
            partial(bench.wiggle, row),
            {joint: unknown.servo_ids[other] for joint, other in seen.items()},
        )
        if not 0 <= bend.joint < like.joint_count or bend.joint in seen:
            raise InputError(
                f"ID {servo_id}: the joint that moved, number {bend.joint + 1} from the head, is "
                f"known already or not of {like.name}"
            )
        seen[bend.joint], signs[bend.joint] = row, bend.direction
    on_progress("straight")
    observer.straighten()
    straight = bench.where_rad()
    rows = [seen[joint] for joint in range(like.joint_count)]
    ranges: list[JointRange] = []
    if sweep:
        with bench.straight(straight) as push:
            for joint, row in enumerate(rows):
                label = joint_label(like.joint_names[joint], unknown.servo_ids[row])
                on_progress(f"range of {label}")
                reach_rad = like.limit_rad[joint] + BEYOND_RAD
                high = push(row, signs[joint], reach_rad)
                low = push(row, -signs[joint], reach_rad)
                ranges.append(JointRange(None if low is None else -low, high))
    return _found(like, name, unknown, rows, signs, straight, ranges)


class _Bench:
    """Motions of one servo of an unknown chain; torque is off between them."""

    def __init__(
        self,
        port: BytePort,
        robot: RobotConfig,
        latency_s: float,
        stop_requested: Callable[[], str | None],
    ) -> None:
        self._robot = robot
        self._stop_requested = stop_requested
        self._clock = port.clock
        bus = DynamixelBus(port, robot.models_by_id, latency_s=latency_s)
        self._chain = ServoChain(bus, robot)
        self._limits = SafetyLimits.from_config(robot, SafetyConfig())

    @contextmanager
    def _link(self) -> Iterator[tuple[SafeLink, Floats]]:
        """A safe link with torque on, and the pose that it holds; torque is off behind it."""
        stop = self._stop_requested
        with SafeLink(self._chain, self._limits, self._clock, stop_requested=stop) as link:
            yield link, np.array(link.enable().position_rad)

    def where_rad(self) -> Floats:
        """Where the servos are; their torque is off, and stays off.

        Raises:
            BusError: a servo does not reply.

        """
        for _ in range(_READS):
            state = SafeLink(self._chain, self._limits, self._clock).read()
            if state.valid.all():
                return state.position_rad
        silent = np.array(self._robot.servo_ids)[~state.valid].tolist()
        raise BusError(f"no reply from ID {', '.join(map(str, silent))}")

    def wiggle(self, row: int) -> None:
        """Turn one servo a little in its positive direction and back.

        Raises:
            InputError: it does not move.
            DriverError: safety has latched.

        """
        with self._link() as (link, here):
            most = 0.0
            for time_s, state in self._cycles(link, 2.0 * WIGGLE_S):
                most = max(most, float(state.position_rad[row] - here[row]))
                share = cubic(max(0.0, min(time_s, 2.0 * WIGGLE_S - time_s)) / WIGGLE_S)
                self._write(link, here, row, here[row] + WIGGLE_RAD * share)
        if most < MOVED_SHARE * WIGGLE_RAD:
            raise InputError(
                f"ID {self._robot.servo_ids[row]}: moved by {most:.2f} of {WIGGLE_RAD:g} rad: is "
                "it held, or too weak for what it carries? hang the robot up, or give --current"
            )

    @contextmanager
    def straight(self, straight_rad: Floats) -> Iterator[Callable[[int, int, float], float | None]]:
        """Hold the body straight; gives a function that pushes one joint: see ``_push``."""
        with self._link() as (link, here):
            for row, zero_rad in enumerate(straight_rad):
                self._go(link, here, row, float(here[row]), float(zero_rad))
            yield partial(self._push, link, here)

    def _push(
        self, link: SafeLink, here: Floats, row: int, side: int, reach_rad: float
    ) -> float | None:
        """Bend one joint one way and back; how far it went, rad, if it met a stop.

        A stop is where the servo pushes with all that it may and does not follow any more.
        """
        zero_rad = float(here[row])
        # the servo knows one turn only
        reach_rad = min(reach_rad, _RANGE_RAD - abs(zero_rad))
        stop, pushing_s, last_s, goal = None, 0.0, 0.0, zero_rad
        least_a = STOP_EFFORT * self._robot.current_limits_a[row]
        for time_s, state in self._cycles(link, reach_rad / SWEEP_RAD_S + STOP_S):
            far = side * (goal - float(state.position_rad[row]))
            pushes = far > STOP_LAG_RAD and side * float(state.current_a[row]) >= least_a
            pushing_s = pushing_s + time_s - last_s if pushes else 0.0
            last_s = time_s
            if pushing_s >= STOP_S:
                stop = side * (float(state.position_rad[row]) - zero_rad)
                break
            if not pushes:
                ahead = side * (goal - zero_rad) + SWEEP_RAD_S * _CYCLE_S
                goal = zero_rad + side * min(ahead, reach_rad)
            self._write(link, here, row, goal)
        self._go(link, here, row, goal, zero_rad)
        return stop

    def _go(self, link: SafeLink, here: Floats, row: int, start: float, end: float) -> None:
        """Move one servo evenly, and let it come to rest."""
        last_s = abs(end - start) / SWEEP_RAD_S
        for time_s, _ in self._cycles(link, last_s + REST_S):
            share = min(time_s / last_s, 1.0) if last_s > 0.0 else 1.0
            self._write(link, here, row, start + share * (end - start))
        here[row] = end

    def _cycles(self, link: SafeLink, seconds: float) -> Iterator[tuple[float, JointState]]:
        """Time since the first cycle and the state, at 50 Hz.

        Raises:
            SafetyTrippedError: safety has latched.

        """
        start_s = self._clock.now_s()
        for tick in ticks(self._clock, _CYCLE_S, start_s + seconds):
            state = link.read()
            if link.tripped is not None:
                raise SafetyTrippedError(link.tripped)
            yield tick.deadline_s - start_s, state

    def _write(self, link: SafeLink, here: Floats, row: int, goal_rad: float) -> None:
        goals = here.copy()
        goals[row] = goal_rad
        link.write(JointCommand(self._clock.now_s(), goals))


def _found(
    like: RobotConfig,
    name: str,
    unknown: RobotConfig,
    rows: Sequence[int],
    signs: Mapping[int, Literal[1, -1]],
    straight: Floats,
    ranges: Sequence[JointRange],
) -> ChainCalibration:
    """Put together the robot and the notes.

    Raises:
        InputError: a joint has no range to speak of, or its servo's turn ends within it.

    """
    joints, faults, notes = [], [], []
    stopless = [k for k, r in enumerate(ranges) if r.low_rad is None or r.high_rad is None]
    for joint, row in enumerate(rows):
        limit = like.limit_rad[joint]
        said = joint_label(like.joint_names[joint], unknown.servo_ids[row])
        if ranges:
            stops = [
                abs(stop)
                for stop in (ranges[joint].low_rad, ranges[joint].high_rad)
                if stop is not None
            ]
            if stops and min(stops) - MARGIN_RAD < limit - 0.02:
                limit = round(min(stops) - MARGIN_RAD, 3)
                notes.append(f"{said}: stops at {_both(ranges[joint])}: its limit is {limit:g} rad")
            elif joint in stopless and len(stopless) <= len(ranges) // 2:
                notes.append(
                    f"{said}: stops at {_both(ranges[joint])}: no stop where other joints have one"
                )
        if limit < LEAST_LIMIT_RAD:
            faults.append(f"{said}: only {limit + MARGIN_RAD:.2f} rad to its stop: free it")
            continue
        model = unknown.servo_models[row]
        found = {
            "id": unknown.servo_ids[row],
            "model": None if model == like.servo.model else model,
            "sign": signs[joint],
            "zero_rad": round(float(straight[row]), 5),
        }
        if limit != like.limit_rad[joint]:
            found["limit_rad"] = limit
        own = like.joints[joint] if like.joints else JointConfig()
        joints.append(own.model_copy(update=found))
    if faults:
        raise InputError(faults)
    keys = {"name": name, "joints": tuple(joints)}
    # checked again: a zero and a limit together may leave the servo's turn
    robot = checked(RobotConfig, like.model_copy(update=keys).model_dump(), f"robot {name}")
    return ChainCalibration(robot, tuple(ranges), tuple(notes))


def _both(found: JointRange) -> str:
    ends = (found.low_rad, found.high_rad)
    return " and ".join("none" if end is None else f"{end:+.2f} rad" for end in ends)
