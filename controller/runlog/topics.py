"""Topics of a log: a table class for each, which describes its rows.

Writer, reader, tables, exports and curves follow from this list. Unknown numbers are null in the
log and NaN here. Times are those of the run's clock (simulated or monotonic), never the date.

A new field needs a default, because older logs lack it. ``FORMAT`` rises when a field changes its
meaning.
"""

from collections.abc import Sequence
from functools import partial
from typing import Annotated, Any

from snakewalk.config.arrays import Bools, Floats, Ints
from snakewalk.controller.runlog.column import (
    ANY,
    JOINT,
    LINK,
    Column,
    Curve,
    Panel,
    Table,
    registered_tables,
    topic,
)

FORMAT = 1
NAN = float("nan")
FLAT_V = 0.15
"""Span up to which a supply holds no information (ours)."""
FLAT_C = 1.0
"""Span up to which a temperature holds no information (ours)."""
Flags = Bools
Texts = tuple[str, ...]
_TIME = Column("clock of the run, s", "exact", is_known=True)
_per_joint = partial(Column, shape=(JOINT,))
_optional = partial(Column, default=NAN)


@topic("/config", watched="all")
class ConfigTable(Table):
    """Configuration of the run: one row, the first of the log."""

    format: Annotated[int, Column("version of this format", "integer")]
    software: Annotated[str, Column("snakewalk's version", "text")]
    backend: Annotated[str, Column("'sim', or the serial port of the metal", "text")]
    config_hash: Annotated[str, Column("digest of run, robot and world", "text")]
    seed: Annotated[int, Column("of every random choice", "integer")]
    run: Annotated[Any, Column("RunConfig", "object")]
    robot: Annotated[Any, Column("RobotConfig", "object")]
    world: Annotated[Any, Column("WorldConfig", "object")]
    torque_constant_n_m_a: Annotated[float, Column("at the output shaft")]
    winding: Annotated[Any, Column("resistance_ohm, back_emf_v_s", "object", default=None)]
    laid: Annotated[Any, Column("heading_rad of the head, joint_rad", "object", default=None)]
    plan: Annotated[
        Any,
        Column("path_m, waypoints_m, waypoint_radius_m, predicted_speed_m_s, ...", "object"),
    ]
    ground: Annotated[Any, Column("thinned height field; null: flat", "object", default=None)]
    evidence: Annotated[
        Any, Column("pose: kind and source; port_is_pseudo_terminal", "object", default=None)
    ]


@topic("/cycle", is_fast=True)
class CycleTable(Table):
    """Control cycles."""

    time_s: Annotated[Floats, _TIME]
    asked_rad: Annotated[
        Floats,
        _per_joint(
            "(J,) what the motion wanted, exact",
            "exact",
            curves=(Curve(Panel.JOINT_ANGLE, "asked", "grey"),),
        ),
    ]
    """Goals of the motion, after compliance."""
    sent_rad: Annotated[
        Floats,
        _per_joint(
            "(J,) what safety let through, exact",
            "exact",
            curves=(Curve(Panel.JOINT_ANGLE, "sent", "amber"),),
        ),
    ]
    """Goals after safety."""
    yield_rad: Annotated[
        Floats,
        _per_joint("(J,) by compliance, in asked_rad", default=None, is_printed_alone=True),
    ]
    """Share of ``asked_rad`` that is due to compliance; NaN without compliance."""
    measured_rad: Annotated[
        Floats,
        _per_joint("(J,)", curves=(Curve(Panel.JOINT_ANGLE, "measured", "blue", gaps="valid"),)),
    ]
    velocity_rad_s: Annotated[Floats, _per_joint("(J,)")]
    current_a: Annotated[
        Floats,
        _per_joint(
            "(J,)",
            curves=(
                Curve(Panel.CURRENT, "highest joint", "red", joints="largest", magnitude=True),
                Curve(Panel.CURRENT, "mean of joints", "sky", joints="mean", magnitude=True),
                Curve(Panel.JOINT_CURRENT, "current", "purple"),
            ),
        ),
    ]
    age_s: Annotated[Floats, _per_joint("(J,) since last read")]
    valid: Annotated[Flags, _per_joint("(J,) whether this cycle's read succeeded", "flag")]
    error: Annotated[Ints, _per_joint("(J,) error byte of the last status packet", "integer")]
    deadline_s: Annotated[Floats, Column("when the cycle was due", "exact", is_known=True)]
    lateness_s: Annotated[
        Floats,
        Column(
            "how late it began",
            is_known=True,
            curves=(
                Curve(
                    Panel.CYCLE,
                    "began late",
                    "amber",
                    scale=1e3,
                    flat=0.0,
                    constant="no cycle began late",
                ),
            ),
        ),
    ]
    wire_busy_s: Annotated[
        Floats,
        _optional(
            "time its bytes took on the wire",
            curves=(Curve(Panel.CYCLE, "on the wire", "blue", scale=1e3),),
        ),
    ]
    electrical_j: Annotated[
        Floats, _optional("consumed by all motors so far; energy that they return is lost")
    ]
    """Electrical energy since the start (``MotorEnergy``); NaN on servos, which do not measure
    it."""
    mechanical_j: Annotated[Floats, _optional("net work at all shafts so far")]
    verdict: Annotated[Texts, Column("", "text", default="pass", choices=("pass", "clamp", "veto"))]
    reason: Annotated[Texts, Column("of a clamp or veto", "text", default="")]
    joints: Annotated[
        Sequence[tuple[int, ...]],
        Column("joints it concerns", "joints", (ANY,), default=()),
    ]


@topic("/slow", only_changes=True)
class SlowTable(Table):
    """Values that servos report slowly: a row for each change."""

    time_s: Annotated[Floats, _TIME]
    temperature_c: Annotated[
        Floats,
        _per_joint(
            "(J,)",
            curves=(Curve(Panel.HEAT, "hottest servo", "red", joints="largest", flat=FLAT_C),),
        ),
    ]
    voltage_v: Annotated[
        Floats,
        _per_joint(
            "(J,)",
            curves=(Curve(Panel.SUPPLY, "lowest supply", "amber", joints="least", flat=FLAT_V),),
        ),
    ]
    hardware_error: Annotated[Ints, _per_joint("(J,) register 70", "integer")]
    stalled_s: Annotated[
        Floats, _optional("so far by which reads ended late because the computer paused")
    ]


@topic("/shadow", is_fast=True)
class ShadowTable(Table):
    """Replies of a simulated chain to the same goals; times are those of the cycles."""

    time_s: Annotated[Floats, _TIME]
    position_rad: Annotated[
        Floats, _per_joint("(J,) of a simulated chain that gets the same goals")
    ]
    current_a: Annotated[Floats, _per_joint("(J,) of it")]


@topic("/imu", is_fast=True)
class ImuTable(Table):
    """Measurements of the robot's IMU; times are those of the cycles."""

    time_s: Annotated[Floats, _TIME]
    rotation: Annotated[
        Floats,
        Column(
            "(9,) rows of the rotation matrix of the link of the IMU; any heading", shape=(3, 3)
        ),
    ]
    """Rotation of the IMU's link; the heading has an unknown offset and drifts."""
    rate_rad_s: Annotated[
        Floats, Column("(3,) about the link's forward, left and up axes", shape=(3,))
    ]
    age_s: Annotated[Floats, Column("since it was measured", is_known=True)]


@topic("/pose", is_fast=True)
class PoseTable(Table):
    """Pose of the body, and progress."""

    time_s: Annotated[Floats, _TIME]
    head_m: Annotated[Floats, Column("(3,) centre of the head link in the world", shape=(3,))]
    rotation: Annotated[
        Floats, Column("(9,) rows of the rotation matrix of the head link", shape=(3, 3))
    ]
    """Head link in the world."""
    links_m: Annotated[Floats, Column("(L, 3) centres of the links", shape=(LINK, 3), default=None)]
    """Positions of the links; NaN where unknown."""
    centre_m: Annotated[Floats, Column("(3,) centre of mass", shape=(3,))]
    speed_m_s: Annotated[
        Floats,
        _optional(
            "forward speed of the links, mean over the body",
            curves=(Curve(Panel.SPEED, "links, along themselves", "sky"),),
        ),
    ]
    predicted_speed_m_s: Annotated[
        Floats,
        _optional("by the velocity model", curves=(Curve(Panel.SPEED, "predicted", "amber"),)),
    ]
    pulse_m_s: Annotated[
        Floats,
        _optional(
            "speed u at which the shape travels along the body",
            curves=(Curve(Panel.SPEED, "pulse", "grey"),),
        ),
    ]
    path_s_m: Annotated[Floats, _optional("arc length reached on the path")]
    target: Annotated[Ints, Column("index of the next waypoint", "integer", default=0)]


@topic("/pose_source", is_optional=True, watched="newest")
class PoseSourceTable(Table):
    """State of an external pose source; times are those of the cycles."""

    time_s: Annotated[Floats, _TIME]
    age_s: Annotated[Floats, _optional("since the newest pose that was used was measured")]
    position_sd_m: Annotated[Floats, _optional("standard deviation of the head's position")]
    heading_sd_rad: Annotated[Floats, _optional("standard deviation of its heading")]
    latency_s: Annotated[Floats, Column("estimated delay that the stamps do not show")]
    sequence: Annotated[Ints, Column("of the newest pose that was used", "integer", default=-1)]
    arrival_s: Annotated[Floats, _optional("when the newest pose arrived")]
    fault: Annotated[Texts, Column("why the pose is not trusted", "text", default="")]
    is_confirmed: Annotated[
        Ints, Column("1 while the source agrees with the joints, otherwise 0", "integer", default=1)
    ]


@topic("/path", watched="all")
class PathTable(Table):
    """Paths that replaced the plan's, each in force from its time."""

    time_s: Annotated[Floats, _TIME]
    points_m: Annotated[
        Sequence[Floats], Column("(n, 2 or 3) a path laid again", "points", (ANY, ANY))
    ]


@topic("/waypoints", watched="all")
class WaypointTable(Table):
    """Waypoints that replaced those in force."""

    time_s: Annotated[Floats, _TIME]
    waypoints_m: Annotated[
        Sequence[Floats],
        Column("(w, 2) in force from now on, those reached first", "points", (ANY, 2)),
    ]


@topic("/walk", watched="")
class WalkTable(Table):
    """Decisions of the walk."""

    time_s: Annotated[Floats, _TIME]
    state: Annotated[Ints, Column("index into the library", "integer")]
    visited: Annotated[Ints, Column("distinct states so far", "integer")]
    heading_error_rad: Annotated[Floats, Column("before the ramp")]
    ramp_rad: Annotated[Floats, Column("bend added to cancel it")]
    candidates: Annotated[Ints, Column("states within the heading tolerance", "integer")]
    eta_q: Annotated[Floats, _optional("quasi-static gain of the state")]
    carrier_rad: Annotated[
        Floats, _optional("amplitude of the wide wave on which the state rides; 0: none")
    ]


@topic("/friction")
class FrictionTable(Table):
    """Friction under the body, estimated during the run."""

    time_s: Annotated[Floats, _TIME]
    along: Annotated[
        Floats,
        Column(
            "friction along the body, forward, as found so far",
            is_known=True,
            curves=(Curve(Panel.FRICTION, "along the body", "blue"),),
        ),
    ]
    across: Annotated[
        Floats,
        Column(
            "across it", is_known=True, curves=(Curve(Panel.FRICTION, "across the body", "amber"),)
        ),
    ]
    along_95: Annotated[Floats, Column("(2,) interval of 95 %", shape=(2,))]
    across_95: Annotated[Floats, Column("(2,)", shape=(2,))]


@topic("/battery")
class BatteryTable(Table):
    """Supply over time: a row for each second."""

    time_s: Annotated[Floats, _TIME]
    voltage_v: Annotated[Floats, _optional("highest that a servo measures")]
    current_a: Annotated[
        Floats,
        _optional(
            "drawn by the whole chain, estimated",
            curves=(Curve(Panel.CHAIN, "drawn, estimated", "purple"),),
        ),
    ]
    charge_ah: Annotated[Floats, _optional("drawn since the start, estimated")]
    winding_c: Annotated[Floats, _per_joint("(J,) temperature of the winding, estimated")]


@topic("/event", watched="all")
class EventTable(Table):
    """Events."""

    time_s: Annotated[Floats, _TIME]
    level: Annotated[Texts, Column("", "text", choices=("info", "warning", "error"))]
    kind: Annotated[Texts, Column("start, stop, waypoint, trip, alarm, fallback, ...", "text")]
    text: Annotated[Texts, Column("for people", "text")]


@topic("/qpos", watched="")
class QposTable(Table):
    """Generalised positions of the simulation, for film and replay."""

    time_s: Annotated[Floats, _TIME]
    qpos: Annotated[Floats, Column("generalised position of the simulation", shape=(ANY,))]


TABLES = registered_tables()
"""Table of each topic, in the order of the log's channels."""
