"""A log's channels as flat tables: one number a cell, units in the columns' names; CSV, Parquet."""

import csv
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from snakewalk.controller.runlog.record import RunRecord

Cells = NDArray[Any] | Sequence[str]
_XYZ: Final = ("x", "y", "z")


@dataclass(frozen=True, slots=True)
class FlatTable:
    """One channel of a log, a row each time it was written."""

    name: str
    """Of the channel, as in the log: ``cycle``, ``pose``, ..."""
    columns: dict[str, Cells]
    """As many cells in each as the table has rows; the first is ``time_s``. NaN is unknown."""

    @property
    def row_count(self) -> int:
        """Rows of the table."""
        return len(self.columns["time_s"])


def flat_tables(record: RunRecord) -> list[FlatTable]:
    """Make a table of each channel that has rows; joints and links are counted from the head."""
    cycle, slow, pose, walk, qpos, imu, shadow = (
        *(record.cycle, record.slow, record.pose, record.walk),
        *(record.qpos, record.imu, record.shadow),
    )
    tables = [
        FlatTable(
            "cycle",
            {
                "time_s": cycle.time_s,
                **_per_joint("asked", "rad", cycle.asked_rad),
                **_per_joint("sent", "rad", cycle.sent_rad),
                **_per_joint("yield", "rad", cycle.yield_rad),
                **_per_joint("measured", "rad", cycle.measured_rad),
                **_per_joint("velocity", "rad_s", cycle.velocity_rad_s),
                **_per_joint("current", "a", cycle.current_a),
                **_per_joint("age", "s", cycle.age_s),
                **_per_joint("valid", "", cycle.valid),
                **_per_joint("error", "", cycle.error),
                "deadline_s": cycle.deadline_s,
                "lateness_s": cycle.lateness_s,
                "wire_busy_s": cycle.wire_busy_s,
                "electrical_j": cycle.electrical_j,
                "mechanical_j": cycle.mechanical_j,
                "verdict": cycle.verdict,
                "reason": cycle.reason,
                "joints": [" ".join(map(str, joints)) for joints in cycle.joints],
            },
        ),
        FlatTable(
            "slow",
            {
                "time_s": slow.time_s,
                **_per_joint("temperature", "c", slow.temperature_c),
                **_per_joint("voltage", "v", slow.voltage_v),
                **_per_joint("hardware_error", "", slow.hardware_error),
            },
        ),
        FlatTable(
            "pose",
            {
                "time_s": pose.time_s,
                **_vector("head", pose.head_m),
                **_rotation(pose.rotation),
                **{
                    name: cells
                    for link in range(pose.links_m.shape[1])
                    for name, cells in _vector(f"link{link}", pose.links_m[:, link]).items()
                },
                **_vector("centre", pose.centre_m),
                "speed_m_s": pose.speed_m_s,
                "predicted_speed_m_s": pose.predicted_speed_m_s,
                "pulse_m_s": pose.pulse_m_s,
                "path_s_m": pose.path_s_m,
                "target": pose.target,
            },
        ),
        FlatTable(
            "walk",
            {
                "time_s": walk.time_s,
                "state": walk.state,
                "visited": walk.visited,
                "heading_error_rad": walk.heading_error_rad,
                "ramp_rad": walk.ramp_rad,
                "candidates": walk.candidates,
                "eta_q": walk.eta_q,
            },
        ),
        FlatTable(
            "qpos",
            {
                "time_s": qpos.time_s,
                **{f"qpos{k}": qpos.qpos[:, k] for k in range(qpos.qpos.shape[1])},
            },
        ),
        FlatTable(
            "imu",
            {
                "time_s": imu.time_s,
                **_rotation(imu.rotation),
                **{f"rate_{axis}_rad_s": imu.rate_rad_s[:, k] for k, axis in enumerate(_XYZ)},
                "age_s": imu.age_s,
            },
        ),
        FlatTable(
            "shadow",
            {
                "time_s": shadow.time_s,
                **_per_joint("position", "rad", shadow.position_rad),
                **_per_joint("current", "a", shadow.current_a),
            },
        ),
        _paths(record),
        _waypoints(record),
        FlatTable(
            "event",
            {
                "time_s": np.array([event.time_s for event in record.events]),
                "level": [event.level for event in record.events],
                "kind": [event.kind for event in record.events],
                "text": [event.text for event in record.events],
            },
        ),
    ]
    return [table for table in tables if table.row_count]


def write_csv(table: FlatTable, path: Path) -> int:
    """Write a table as CSV with a line of names; every digit is kept, unknown cells are empty.

    Returns how many rows it has, without the names.
    """
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(table.columns)
        writer.writerows(zip(*(_texts(cells) for cells in table.columns.values()), strict=True))
    return table.row_count


def write_parquet(table: FlatTable, path: Path) -> int:
    """Write a table as Parquet; unknown cells are null. Needs pyarrow. Returns its rows."""
    import pyarrow as pa  # noqa: PLC0415  an extra
    from pyarrow import parquet  # noqa: PLC0415

    columns = {
        name: pa.array(cells, from_pandas=True)  # NaN becomes null
        for name, cells in table.columns.items()
    }
    parquet.write_table(pa.table(columns), path)
    return table.row_count


def _per_joint(quantity: str, unit: str, values: NDArray[Any]) -> dict[str, Cells]:
    """Columns ``quantity_jointK_unit`` of values (T, J)."""
    end = f"_{unit}" if unit else ""
    return {f"{quantity}_joint{k}{end}": values[:, k] for k in range(values.shape[1])}


def _vector(name: str, values: NDArray[Any]) -> dict[str, Cells]:
    """Columns of positions (T, 3)."""
    return {f"{name}_{axis}_m": values[:, k] for k, axis in enumerate(_XYZ)}


def _rotation(values: NDArray[Any]) -> dict[str, Cells]:
    """Columns of matrices (T, 3, 3)."""
    return {f"rotation_{k // 3}{k % 3}": values[:, k // 3, k % 3] for k in range(9)}


def _paths(record: RunRecord) -> FlatTable:
    """All points of all paths, each with the time from which its path was in force."""
    times = [np.full(len(points), time_s) for time_s, points in record.paths]
    points = np.concatenate([_with_height(points) for _, points in record.paths])
    return FlatTable("path", {"time_s": np.concatenate(times), **_vector("point", points)})


def _waypoints(record: RunRecord) -> FlatTable:
    """All waypoints, from 1, of each time from which others were in force."""
    counts = [len(points) for _, points in record.waypoints]
    points = np.concatenate([points for _, points in record.waypoints])
    columns: dict[str, Cells] = {
        "time_s": np.repeat([time_s for time_s, _ in record.waypoints], counts),
        "number": np.concatenate([np.arange(1, count + 1) for count in counts]),
        "point_x_m": points[:, 0],
        "point_y_m": points[:, 1],
    }
    return FlatTable("waypoints", columns)


def _with_height(points_m: NDArray[Any]) -> NDArray[Any]:
    """(n, 3) points; a path on paper has no height."""
    height = np.full((len(points_m), 3 - points_m.shape[1]), np.nan)
    return np.hstack([points_m, height])


def _texts(cells: Cells) -> Iterator[str]:
    """Cells as CSV shows them: the shortest text that gives a number back."""
    for cell in cells.tolist() if isinstance(cells, np.ndarray) else cells:
        if isinstance(cell, bool):
            yield "true" if cell else "false"
        else:
            yield "" if isinstance(cell, float) and math.isnan(cell) else str(cell)
