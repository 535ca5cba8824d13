"""Rows to tables: lists of JSON objects become arrays with one entry a row."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from snakewalk.config.arrays import Floats, Ints
from snakewalk.config.heightfield import HeightField
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.config.world import WorldConfig
from snakewalk.controller.runlog.record import (
    CycleTable,
    Event,
    FrictionTable,
    Header,
    ImuTable,
    InitialPose,
    PlanSummary,
    PoseTable,
    QposTable,
    RunRecord,
    ShadowTable,
    SlowTable,
    WalkTable,
    Winding,
)

Row = Mapping[str, Any]


def record_of(
    rows: Mapping[str, Sequence[Row]], *, complete: bool, note: str, header: Header | None = None
) -> RunRecord:
    """Build the record from rows by topic; the first ``/config`` counts, unless there is a header.

    Raises:
        KeyError: a row lacks a field.
        pydantic.ValidationError: the configuration is not of this version.

    """
    if header is None:
        header = _header(rows["/config"][0])
    joints = header.robot.joint_count
    replanned = tuple(
        (float(r["time_s"]), _floats([r], "points_m")[0]) for r in rows.get("/path", ())
    )
    changed = tuple(
        (float(r["time_s"]), _array(r["waypoints_m"]).reshape(-1, 2))
        for r in rows.get("/waypoints", ())
    )
    waypoints = ((0.0, header.plan.waypoints_m), *changed)
    return RunRecord(
        header=_with_waypoints(header, waypoints) if changed else header,
        cycle=_cycle(rows.get("/cycle", ()), joints),
        slow=_slow(rows.get("/slow", ()), joints),
        pose=_pose(rows.get("/pose", ()), header.robot.link_count),
        walk=_walk(rows.get("/walk", ())),
        friction=_friction(rows.get("/friction", ())),
        qpos=_qpos(rows.get("/qpos", ())),
        shadow=_shadow(rows.get("/shadow", ()), joints),
        imu=_imu(rows.get("/imu", ())),
        paths=((0.0, header.plan.path_m), *replanned),
        waypoints=waypoints,
        events=tuple(
            Event(float(r["time_s"]), r["level"], r["kind"], r["text"])
            for r in rows.get("/event", ())
        ),
        complete=complete,
        note=note,
    )


def _with_waypoints(header: Header, waypoints: Sequence[tuple[float, Floats]]) -> Header:
    """Return a header whose plan has the last waypoints, and since when each was in force."""
    set_s = [0.0] * len(waypoints[0][1])
    for (_, before_m), (time_s, after_m) in pairwise(waypoints):
        same = 0
        while same < min(len(before_m), len(after_m)) and (before_m[same] == after_m[same]).all():
            same += 1
        set_s = set_s[:same] + [time_s] * (len(after_m) - same)
    plan = replace(header.plan, waypoints_m=waypoints[-1][1], set_s=np.array(set_s))
    return replace(header, plan=plan)


def _header(row: Row) -> Header:
    plan, ground = row["plan"], row["ground"]
    return Header(
        software=row["software"],
        backend=row["backend"],
        config_hash=row["config_hash"],
        seed=row["seed"],
        run=RunConfig.model_validate(row["run"]),
        robot=RobotConfig.model_validate(row["robot"]),
        world=WorldConfig.model_validate(row["world"]),
        plan=PlanSummary(
            path_m=_array(plan["path_m"]),
            waypoints_m=_array(plan["waypoints_m"]).reshape(-1, 2),
            waypoint_radius_m=plan["waypoint_radius_m"],
            predicted_speed_m_s=float(_array(plan["predicted_speed_m_s"])),
            states=plan["states"],
        ),
        ground=None
        if ground is None
        else HeightField(
            _array(ground["z_m"]), ground["spacing_m"], ground["x0_m"], ground["y0_m"]
        ),
        torque_constant_n_m_a=float(_array(row["torque_constant_n_m_a"])),
        winding=None if row.get("winding") is None else Winding(**row["winding"]),
        initial_pose=None
        if row.get("laid") is None
        else InitialPose(row["laid"]["heading_rad"], _array(row["laid"]["joint_rad"])),
    )


def _cycle(rows: Sequence[Row], joints: int) -> CycleTable:
    def per_joint(name: str) -> Floats:
        return _floats(rows, name, joints)

    return CycleTable(
        time_s=_floats(rows, "time_s"),
        asked_rad=per_joint("asked_rad"),
        sent_rad=per_joint("sent_rad"),
        yield_rad=_array([r.get("yield_rad") or [None] * joints for r in rows]).reshape(-1, joints),
        measured_rad=per_joint("measured_rad"),
        velocity_rad_s=per_joint("velocity_rad_s"),
        current_a=per_joint("current_a"),
        age_s=per_joint("age_s"),
        valid=np.array([r["valid"] for r in rows], dtype=bool).reshape(len(rows), joints),
        error=_ints(rows, "error", joints),
        deadline_s=_floats(rows, "deadline_s"),
        lateness_s=_floats(rows, "lateness_s"),
        wire_busy_s=_floats(rows, "wire_busy_s"),
        electrical_j=_array([r.get("electrical_j") for r in rows]),
        mechanical_j=_array([r.get("mechanical_j") for r in rows]),
        verdict=tuple(r["verdict"] for r in rows),
        reason=tuple(r["reason"] for r in rows),
        joints=tuple(tuple(r["joints"]) for r in rows),
    )


def _slow(rows: Sequence[Row], joints: int) -> SlowTable:
    return SlowTable(
        time_s=_floats(rows, "time_s"),
        temperature_c=_floats(rows, "temperature_c", joints),
        voltage_v=_floats(rows, "voltage_v", joints),
        hardware_error=_ints(rows, "hardware_error", joints),
    )


def _shadow(rows: Sequence[Row], joints: int) -> ShadowTable:
    return ShadowTable(
        time_s=_floats(rows, "time_s"),
        position_rad=_floats(rows, "position_rad", joints),
        current_a=_floats(rows, "current_a", joints),
    )


def _imu(rows: Sequence[Row]) -> ImuTable:
    return ImuTable(
        time_s=_floats(rows, "time_s"),
        rotation=_floats(rows, "rotation", 9).reshape(-1, 3, 3),
        rate_rad_s=_floats(rows, "rate_rad_s", 3),
        age_s=_floats(rows, "age_s"),
    )


def _pose(rows: Sequence[Row], links: int) -> PoseTable:
    unknown = [[None] * 3] * links
    known = [r["links_m"] if r["links_m"] is not None else unknown for r in rows]
    return PoseTable(
        time_s=_floats(rows, "time_s"),
        head_m=_floats(rows, "head_m", 3),
        rotation=_floats(rows, "rotation", 9).reshape(-1, 3, 3),
        links_m=_array(known).reshape(len(rows), links, 3),
        centre_m=_floats(rows, "centre_m", 3),
        speed_m_s=_floats(rows, "speed_m_s"),
        predicted_speed_m_s=_floats(rows, "predicted_speed_m_s"),
        pulse_m_s=_floats(rows, "pulse_m_s"),
        path_s_m=_floats(rows, "path_s_m"),
        target=_ints(rows, "target"),
    )


def _walk(rows: Sequence[Row]) -> WalkTable:
    return WalkTable(
        time_s=_floats(rows, "time_s"),
        state=_ints(rows, "state"),
        visited=_ints(rows, "visited"),
        heading_error_rad=_floats(rows, "heading_error_rad"),
        ramp_rad=_floats(rows, "ramp_rad"),
        candidates=_ints(rows, "candidates"),
        eta_q=_floats(rows, "eta_q"),
    )


def _friction(rows: Sequence[Row]) -> FrictionTable:
    return FrictionTable(
        time_s=_floats(rows, "time_s"),
        along=_floats(rows, "along"),
        across=_floats(rows, "across"),
        along_95=_floats(rows, "along_95", 2),
        across_95=_floats(rows, "across_95", 2),
    )


def _qpos(rows: Sequence[Row]) -> QposTable:
    width = len(rows[0]["qpos"]) if rows else 0
    return QposTable(_floats(rows, "time_s"), _floats(rows, "qpos", width))


def _array(values: Any) -> Floats:
    return np.array(values, dtype=float)  # None becomes NaN


def _floats(rows: Sequence[Row], name: str, width: int | None = None) -> Floats:
    values = _array([r[name] for r in rows])
    return values if width is None else values.reshape(len(rows), width)


def _ints(rows: Sequence[Row], name: str, width: int | None = None) -> Ints:
    values: Ints = np.array([r[name] for r in rows], dtype=np.int64)
    return values if width is None else values.reshape(len(rows), width)
