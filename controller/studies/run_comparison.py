"""Comparison of runs: their numbers, differences of their configurations, and their curves."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.metrics.path_error import ground_speed_m_s, path_error_m
from snakewalk.controller.metrics.summary import RunSummary, largest, summary
from snakewalk.controller.metrics.tracking import tracking_errors
from snakewalk.controller.metrics.verdict import RunVerdict, verdict
from snakewalk.controller.runlog.record import RunRecord


@dataclass(frozen=True, slots=True)
class ComparedRun:
    """Extract of a log, which may be large."""

    name: str
    """Name that distinguishes the run from the others."""
    summary: RunSummary
    verdict: RunVerdict
    settings: Mapping[str, Any]
    """Values of run, robot and world by dotted key, with the bus and the software."""
    pose: str
    """Evidence of the run's poses: ``measured by simulator``."""
    waypoints_m: Floats
    """(w, 2) waypoints of the run, m."""
    waypoint_radius_m: float
    centre_m: Floats
    """(P, 2) track of the centre of mass."""
    pose_s: Floats
    """(P,) times of the values from poses:"""
    path_error_m: Floats
    """(P,) distances from the path, m."""
    speed_m_s: Floats
    """(P,) speeds of the centre of mass over the ground, m/s."""
    cycle_s: Floats
    """(T,) times of the values from control cycles:"""
    current_a: Floats
    """(T,) of the joint with the highest, without its sign."""
    tracking_rms_rad: Floats
    """(T,) over the joints, measured minus sent."""


def compared_run(record: RunRecord, name: str) -> ComparedRun:
    """Return the compared parts of a record."""
    header = record.header
    pose = record.pose
    cycle = record.cycle
    settings: dict[str, Any] = {"bus": header.backend, "software": header.software}
    for table, config in (("run", header.run), ("robot", header.robot), ("world", header.world)):
        settings |= flat(config.model_dump(mode="json"), table)
    squares, count, _ = tracking_errors(cycle).T
    numbers = summary(record)
    return ComparedRun(
        name=name,
        summary=numbers,
        verdict=verdict(record, numbers),
        settings=settings,
        pose=header.pose_evidence.text,
        waypoints_m=header.plan.waypoints_m,
        waypoint_radius_m=header.plan.waypoint_radius_m,
        centre_m=pose.centre_m[:, :2],
        pose_s=pose.time_s,
        path_error_m=path_error_m(record),
        speed_m_s=ground_speed_m_s(pose),
        cycle_s=cycle.time_s,
        current_a=largest(cycle.current_a),
        tracking_rms_rad=np.sqrt(squares / np.where(count, count, np.nan)),
    )


def log_names(logs: Sequence[Path]) -> list[str]:
    """Distinct names of logs: the folder of ``log.mcap``, else the file, else the path."""
    short = [log.absolute().parent.name if log.stem == "log" else log.stem for log in logs]
    twice = {name for name, count in Counter(short).items() if count > 1}
    return [str(log) if name in twice else name for log, name in zip(logs, short, strict=True)]


def differing(runs: Sequence[ComparedRun]) -> dict[str, list[Any]]:
    """Settings that are not the same in all runs, a value a run; None where one has no such key."""
    keys = dict.fromkeys(key for run in runs for key in run.settings)
    values = {key: [run.settings.get(key) for run in runs] for key in keys}
    return {key: row for key, row in values.items() if any(value != row[0] for value in row)}


def flat(table: Mapping[Any, Any], name: str = "") -> dict[str, Any]:
    """Values of a table and of the tables in it by dotted key; rows are numbered from 0."""
    flat_values: dict[str, Any] = {}
    for key, value in table.items():
        where = f"{name}.{key}".removeprefix(".")
        if isinstance(value, Mapping):
            flat_values |= flat(value, where)
        elif isinstance(value, list) and any(isinstance(row, Mapping) for row in value):
            flat_values |= flat(dict(enumerate(value)), where)
        else:
            flat_values[where] = value
    return flat_values
