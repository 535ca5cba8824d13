"""A run as its log tells it: one table a topic, rows in order of time, NaN where nothing is known.

T, S, H, P, W, F count the rows of a topic; J joints, L links.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from snakewalk.config.arrays import Floats, Ints
from snakewalk.config.heightfield import HeightField
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.config.world import WorldConfig


class MotorEnergy(NamedTuple):
    """Energy of all motors since they were switched on; NaN where nothing adds it up."""

    electrical_j: float = float("nan")
    """Taken in; what a motor gives back is lost, not deducted. Without the servos' electronics."""
    mechanical_j: float = float("nan")
    """Net work at the shafts."""


@dataclass(frozen=True, slots=True)
class Winding:
    """Constants of a motor that give electrical power from current and speed."""

    resistance_ohm: float
    back_emf_v_s: float
    """Volts at one radian a second of the output shaft."""


@dataclass(frozen=True, slots=True)
class PlanSummary:
    """What the plan promises."""

    path_m: Floats
    """(n, 2) or (n, 3) points of the path that the run starts with."""
    waypoints_m: Floats
    """(w, 2); of a run whose waypoints were set on the way, those in force at its end."""
    waypoint_radius_m: float
    predicted_speed_m_s: float = float("nan")
    set_s: Floats | None = None
    """(w,) times since when each waypoint was in force; None: all from the start."""
    states: Mapping[str, int] | None = None
    """Counts of the state library, e.g. ``{"recorded": 40, "random": 160, "refused": 71}``."""


@dataclass(frozen=True, slots=True)
class InitialPose:
    """Pose in which a simulated robot was put on the ground."""

    heading_rad: float
    """Of the head link."""
    joint_rad: Floats
    """(J,)"""


@dataclass(frozen=True, slots=True)
class Header:
    """What ran, with what."""

    software: str
    backend: str
    config_hash: str
    seed: int
    run: RunConfig
    robot: RobotConfig
    world: WorldConfig
    plan: PlanSummary
    ground: HeightField | None
    """Thinned; None on a flat floor."""
    torque_constant_n_m_a: float
    winding: Winding | None
    """Of the robot's servos; None where the log does not say it."""
    initial_pose: InitialPose | None
    """None on metal."""


@dataclass(frozen=True, slots=True)
class CycleTable:
    """Control cycles."""

    time_s: Floats
    """(T,)"""
    asked_rad: Floats
    """(T, J) what the motion wanted, after compliance."""
    sent_rad: Floats
    """(T, J) what safety let through."""
    yield_rad: Floats
    """(T, J) by which compliance moved what was asked; NaN where nothing yields."""
    measured_rad: Floats
    """(T, J)"""
    velocity_rad_s: Floats
    """(T, J)"""
    current_a: Floats
    """(T, J)"""
    age_s: Floats
    """(T, J)"""
    valid: NDArray[np.bool_]
    """(T, J)"""
    error: Ints
    """(T, J) error byte."""
    deadline_s: Floats
    """(T,)"""
    lateness_s: Floats
    """(T,)"""
    wire_busy_s: Floats
    """(T,)"""
    electrical_j: Floats
    """(T,) ``MotorEnergy`` since the start; NaN on metal, where no servo adds it up."""
    mechanical_j: Floats
    """(T,)"""
    verdict: tuple[str, ...]
    """T of pass, clamp, veto."""
    reason: tuple[str, ...]
    joints: tuple[tuple[int, ...], ...]
    """Joints that a verdict concerns."""


@dataclass(frozen=True, slots=True)
class SlowTable:
    """Slow round: a row for each change."""

    time_s: Floats
    """(S,)"""
    temperature_c: Floats
    """(S, J)"""
    voltage_v: Floats
    """(S, J)"""
    hardware_error: Ints
    """(S, J)"""


@dataclass(frozen=True, slots=True)
class ShadowTable:
    """What a simulated chain answered to the same goals; no rows where none ran beside."""

    time_s: Floats
    """(H,) those of the cycles"""
    position_rad: Floats
    """(H, J)"""
    current_a: Floats
    """(H, J)"""


@dataclass(frozen=True, slots=True)
class ImuTable:
    """What the robot's IMU said; no rows where it has none."""

    time_s: Floats
    """(I,) those of the cycles"""
    rotation: Floats
    """(I, 3, 3) of the link that it sits in; its heading begins anywhere, and drifts."""
    rate_rad_s: Floats
    """(I, 3) about the link's forward, left and up axes."""
    age_s: Floats
    """(I,)"""


@dataclass(frozen=True, slots=True)
class PoseTable:
    """Where the body was."""

    time_s: Floats
    """(P,)"""
    head_m: Floats
    """(P, 3)"""
    rotation: Floats
    """(P, 3, 3) head link in the world."""
    links_m: Floats
    """(P, L, 3); NaN where unknown."""
    centre_m: Floats
    """(P, 3) centre of mass."""
    speed_m_s: Floats
    """(P,) forward speed of the links."""
    predicted_speed_m_s: Floats
    """(P,)"""
    pulse_m_s: Floats
    """(P,) u, at which the shape travels along the body."""
    path_s_m: Floats
    """(P,) arc length reached on the path."""
    target: Ints
    """(P,) index of the next waypoint."""


@dataclass(frozen=True, slots=True)
class WalkTable:
    """Decisions of the walk."""

    time_s: Floats
    """(W,)"""
    state: Ints
    """(W,)"""
    visited: Ints
    """(W,) distinct states so far."""
    heading_error_rad: Floats
    """(W,)"""
    ramp_rad: Floats
    """(W,)"""
    candidates: Ints
    """(W,)"""
    eta_q: Floats
    """(W,)"""


@dataclass(frozen=True, slots=True)
class FrictionTable:
    """Friction under the body, as the run found it."""

    time_s: Floats
    """(F,)"""
    along: Floats
    """(F,)"""
    across: Floats
    """(F,)"""
    along_95: Floats
    """(F, 2) interval of 95 %."""
    across_95: Floats
    """(F, 2)"""


@dataclass(frozen=True, slots=True)
class QposTable:
    """Generalised positions of the simulation."""

    time_s: Floats
    """(Q,)"""
    qpos: Floats
    """(Q, nq)"""


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened."""

    time_s: float
    level: str
    kind: str
    text: str


@dataclass(frozen=True, slots=True)
class RunRecord:
    """Everything that a log holds."""

    header: Header
    cycle: CycleTable
    slow: SlowTable
    pose: PoseTable
    walk: WalkTable
    friction: FrictionTable
    qpos: QposTable
    shadow: ShadowTable
    imu: ImuTable
    paths: tuple[tuple[float, Floats], ...]
    """Paths in force from a time on; the first is the plan's, at 0."""
    waypoints: tuple[tuple[float, Floats], ...]
    """The same of waypoints (w, 2)."""
    events: tuple[Event, ...]
    complete: bool
    """Whether the file was closed properly."""
    note: str
    """What is missing, if it was not; empty otherwise."""

    def waypoints_at(self, time_s: float) -> Floats:
        """Waypoints (w, 2) in force at a time."""
        return [points_m for since_s, points_m in self.waypoints if since_s <= time_s][-1]

    @property
    def period_s(self) -> float:
        """Length of a control cycle."""
        return 1.0 / self.header.run.cycle_hz

    @property
    def end_s(self) -> float:
        """Time of the last row."""
        ends = [t.time_s[-1] for t in (self.cycle, self.pose, self.walk) if len(t.time_s)]
        ends += [e.time_s for e in self.events[-1:]]
        return float(max(ends, default=0.0))
