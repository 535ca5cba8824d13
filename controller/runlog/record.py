"""A run as its log describes it: one table for each topic, rows in order of time."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields, replace
from functools import partial
from importlib.metadata import version
from typing import Any, NamedTuple, Self

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.heightfield import HeightField
from snakewalk.config.loader import digest
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.config.world import WorldConfig
from snakewalk.controller.runlog.column import Json, Table
from snakewalk.controller.runlog.encode import array, exact, floats, number, thinned
from snakewalk.controller.runlog.evidence import PoseEvidence, evidence_of_old_log
from snakewalk.controller.runlog.topics import (
    FORMAT,
    BatteryTable,
    CycleTable,
    EventTable,
    FrictionTable,
    ImuTable,
    PathTable,
    PoseSourceTable,
    PoseTable,
    QposTable,
    ShadowTable,
    SlowTable,
    WalkTable,
    WaypointTable,
)


class MotorEnergy(NamedTuple):
    """Energy of all motors since they were switched on; NaN where nothing adds it up."""

    electrical_j: float = float("nan")
    """Consumed energy; energy that a motor returns is lost, not deducted. Without the servos'
    electronics."""
    mechanical_j: float = float("nan")
    """Net work at the shafts."""


POSE_CHECK = "pose check"
"""Backend of a log that contains only the poses of a source, before torque."""


@dataclass(frozen=True, slots=True)
class Winding:
    """Constants of a motor that give electrical power from current and speed."""

    resistance_ohm: float
    back_emf_v_s: float
    """Volts at one radian a second of the output shaft."""


@dataclass(frozen=True, slots=True)
class PlanSummary:
    """Figures of the plan."""

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
    """Heading of the head link."""
    joint_rad: Floats
    """(J,) joint angles of the pose, rad."""


@dataclass(frozen=True, slots=True)
class Header:
    """Software and configuration of a run."""

    run: RunConfig
    robot: RobotConfig
    world: WorldConfig
    backend: str
    plan: PlanSummary
    pose_evidence: PoseEvidence
    """Evidence of the poses of the log."""
    ground: HeightField | None = None
    """Thinned height field; None on a flat floor."""
    torque_constant_n_m_a: float = float("nan")
    winding: Winding | None = None
    """Winding of the robot's servos; None if the log does not state it."""
    initial_pose: InitialPose | None = None
    """Pose in which the simulated robot was put on the ground; None on servos."""
    software: str = field(default_factory=partial(version, "snakewalk"))
    config_hash: str = ""
    """Digest of run, robot and world; set when the log is read."""
    port_is_pseudo_terminal: bool | None = None
    """Whether the servos answered on a pseudo-terminal, as a served simulation does; None where
    the log does not say it."""

    def row(self) -> Json:
        """Row of ``ConfigTable``; the ground is thinned."""
        plan = self.plan
        pose = self.initial_pose
        ground = self.ground
        return {
            "format": FORMAT,
            "software": self.software,
            "backend": self.backend,
            "config_hash": digest(self.run, self.robot, self.world),
            "seed": self.run.seed,
            "run": self.run.model_dump(mode="json"),
            "robot": self.robot.model_dump(mode="json"),
            "world": self.world.model_dump(mode="json"),
            "torque_constant_n_m_a": number(self.torque_constant_n_m_a),
            "winding": None if self.winding is None else asdict(self.winding),
            "laid": None
            if pose is None
            else {"heading_rad": float(pose.heading_rad), "joint_rad": exact(pose.joint_rad)},
            "plan": {
                "path_m": floats(plan.path_m),
                "waypoints_m": floats(plan.waypoints_m),
                "waypoint_radius_m": number(plan.waypoint_radius_m),
                "predicted_speed_m_s": number(plan.predicted_speed_m_s),
                "states": dict(plan.states or {}),
            },
            "ground": None if ground is None else thinned(ground),
            "evidence": {
                "pose": self.pose_evidence.row(),
                "port_is_pseudo_terminal": self.port_is_pseudo_terminal,
            },
        }

    @classmethod
    def of(cls, row: Mapping[str, Any]) -> Self:
        """Header of a row of ``ConfigTable``.

        Raises:
            KeyError: the row lacks a field.
            pydantic.ValidationError: the configuration is not of this version.

        """
        plan = row["plan"]
        ground = row["ground"]
        winding = row.get("winding")
        pose = row.get("laid")
        run = RunConfig.model_validate(row["run"])
        robot = RobotConfig.model_validate(row["robot"])
        evidence = row.get("evidence")
        return cls(
            software=row["software"],
            backend=row["backend"],
            config_hash=row["config_hash"],
            run=run,
            robot=robot,
            world=WorldConfig.model_validate(row["world"]),
            plan=PlanSummary(
                path_m=array(plan["path_m"]),
                waypoints_m=array(plan["waypoints_m"]).reshape(-1, 2),
                waypoint_radius_m=plan["waypoint_radius_m"],
                predicted_speed_m_s=float(array(plan["predicted_speed_m_s"])),
                states=plan["states"],
            ),
            ground=None if ground is None else _field(ground),
            torque_constant_n_m_a=float(array(row["torque_constant_n_m_a"])),
            winding=None if winding is None else Winding(**winding),
            initial_pose=None
            if pose is None
            else InitialPose(pose["heading_rad"], array(pose["joint_rad"])),
            pose_evidence=PoseEvidence.of(evidence["pose"])
            if evidence is not None
            else evidence_of_old_log(run, row["backend"], robot.imu is not None),
            port_is_pseudo_terminal=None
            if evidence is None
            else evidence["port_is_pseudo_terminal"],
        )


def _field(ground: dict[str, Any]) -> HeightField:
    colour = ground.get("colour")
    return HeightField(
        array(ground["z_m"]),
        ground["spacing_m"],
        ground["x0_m"],
        ground["y0_m"],
        colour=None if colour is None else np.array(colour, dtype=np.uint8),
    )


@dataclass(frozen=True, slots=True)
class Event:
    """An event of the run."""

    time_s: float
    level: str
    kind: str
    text: str


@dataclass(frozen=True, slots=True)
class RunRecord:
    """All contents of a log."""

    header: Header
    cycle: CycleTable
    slow: SlowTable
    pose: PoseTable
    walk: WalkTable
    friction: FrictionTable
    battery: BatteryTable
    qpos: QposTable
    shadow: ShadowTable
    imu: ImuTable
    pose_source: PoseSourceTable
    paths: tuple[tuple[float, Floats], ...]
    """Paths in force from a time on; the first is the plan's, at 0."""
    waypoints: tuple[tuple[float, Floats], ...]
    """Times from which waypoints are in force, and the waypoints (w, 2)."""
    events: tuple[Event, ...]
    complete: bool
    """Whether the file was closed properly."""
    note: str
    """Missing part, if the plan was incomplete; empty otherwise."""

    def tables(self) -> tuple[Table, ...]:
        """Tables of all topics but ``ConfigTable``; those of the plan begin at 0 s."""
        events = self.events
        values = [getattr(self, field.name) for field in fields(self)]
        return (
            *(value for value in values if isinstance(value, Table)),
            PathTable(np.array([s for s, _ in self.paths]), [m for _, m in self.paths]),
            WaypointTable(np.array([s for s, _ in self.waypoints]), [m for _, m in self.waypoints]),
            EventTable(
                np.array([event.time_s for event in events]),
                *(tuple(getattr(e, name) for e in events) for name in ("level", "kind", "text")),
            ),
        )

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

    @property
    def torque_on_s(self) -> float:
        """Time at which torque was switched on; 0 if it was not."""
        return next((event.time_s for event in self.events if event.kind == "start"), 0.0)

    @property
    def duration_s(self) -> float:
        """Time from torque on to torque off, or to the last row of a log that breaks off."""
        stops = [event.time_s for event in self.events if event.kind == "stop"]
        return (stops[-1] if stops else self.end_s) - self.torque_on_s

    def between(self, first_s: float, last_s: float) -> Self:
        """Return the record with the rows of its tables from one time to another."""
        parts: dict[str, Any] = {}
        for entry in fields(self):
            table = getattr(self, entry.name)
            if isinstance(table, Table):
                past_s = np.nextafter(last_s, np.inf)
                rows = slice(*np.searchsorted(table.time_s, (first_s, past_s)))
                names = table.topic.columns
                columns = {name: getattr(table, name)[rows] for name in names}
                parts[entry.name] = table.with_columns(**columns)
        return replace(self, **parts)

    def from_torque_on(self) -> Self:
        """Return the record with times that count from the moment torque was switched on.

        The times of a log count from the moment the connection was opened.
        """
        start_s = self.torque_on_s
        if start_s == 0.0:
            return self
        moved: dict[str, Any] = {}
        for entry in fields(self):
            table = getattr(self, entry.name)
            if isinstance(table, Table):
                moved[entry.name] = _rows_before(table, start_s)
        plan = self.header.plan
        if plan.set_s is not None:
            plan = replace(plan, set_s=plan.set_s - start_s)
        return replace(
            self,
            **moved,
            header=replace(self.header, plan=plan),
            paths=tuple((time_s - start_s, points_m) for time_s, points_m in self.paths),
            waypoints=tuple((time_s - start_s, points_m) for time_s, points_m in self.waypoints),
            events=tuple(replace(event, time_s=event.time_s - start_s) for event in self.events),
        )


_TIMES = ("time_s", "deadline_s", "arrival_s")
"""Fields of tables that are points in time."""


def _rows_before(table: Table, start_s: float) -> Table:
    names = [name for name in _TIMES if hasattr(table, name)]
    return table.with_columns(**{name: getattr(table, name) - start_s for name in names})
