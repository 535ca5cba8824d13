"""Topics of a log as flat tables for CSV and Parquet: one number in a cell, units in the names."""

import csv
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snakewalk.config.arrays import Floats
from snakewalk.config.units import end_of
from snakewalk.controller.runlog.column import ANY, JOINT, LINK, ROWS, Column, Table, release
from snakewalk.controller.runlog.encode import encode
from snakewalk.controller.runlog.evidence import PoseEvidence
from snakewalk.controller.runlog.record import Header, RunRecord
from snakewalk.controller.runlog.topics import ConfigTable, FrictionTable, PoseTable, WalkTable

Cells = NDArray[Any] | Sequence[str]
_XYZ = ("x", "y", "z")
_BOUNDS = ("low", "high")
_OF_THE_POSE = (PoseTable, WalkTable, FrictionTable)
"""Tables whose numbers depend on the pose; each of their rows states its evidence."""


@dataclass(frozen=True, slots=True)
class FlatTable:
    """A topic of a log, with a row for each of its rows, points or keys."""

    name: str
    """Name of the topic without its slash: ``cycle``, ``pose``, ..."""
    columns: dict[str, Cells]
    """Cells of each column; the first column is ``time_s``. NaN is unknown."""

    @property
    def row_count(self) -> int:
        """Rows of the table."""
        return len(self.columns["time_s"])


def flat_tables(record: RunRecord) -> list[FlatTable]:
    """Return a table of each topic that has rows."""
    joints = record.header.robot.joint_names
    evidence = record.header.pose_evidence
    tables = [
        FlatTable(
            table.topic.table_name,
            _columns(table, joints)
            | (_evidence(evidence, len(table.time_s)) if isinstance(table, _OF_THE_POSE) else {}),
        )
        for table in record.tables()
        if len(table.time_s)
    ]
    return [_config(record.header), *(table for table in tables if table.row_count)]


def write_csv(table: FlatTable, path: Path) -> int:
    """Write a table as CSV with a line of names; every digit is kept, unknown cells are empty.

    Returns the number of rows, without the names.
    """
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(table.columns)
        for start in range(0, table.row_count, ROWS):  # a long log is not in memory as texts
            parts = (cells[start : start + ROWS] for cells in table.columns.values())
            writer.writerows(zip(*map(_texts, parts), strict=True))
            release(table.columns.values())
    return table.row_count


def write_parquet(table: FlatTable, path: Path) -> int:
    """Write a table as Parquet; unknown cells are null. Needs pyarrow. Returns its rows."""
    import pyarrow.parquet  # noqa: PLC0415  an extra

    columns = {
        name: pyarrow.array(cells, from_pandas=True)  # NaN becomes null
        for name, cells in table.columns.items()
    }
    pyarrow.parquet.write_table(pyarrow.table(columns), path)
    return table.row_count


def _columns(table: Table, joints: Sequence[str]) -> dict[str, Cells]:
    """Columns of a table of a robot with these joints."""
    cells: dict[str, Cells] = {}
    for name, column in table.topic.columns.items():
        values = getattr(table, name)
        if column.kind == "points":
            cells = _points(cells, values, 3 if column.shape[1] == ANY else 2)
        elif column.kind == "joints":
            cells[name] = [" ".join(joints[k] for k in indices) for indices in values]
        elif column.shape:
            flat = values.reshape(len(values), -1)
            names = cell_names(name, column, flat.shape[1], joints)
            cells |= {column_name: flat[:, k] for k, column_name in enumerate(names)}
        else:
            cells[name] = values
    return cells


def _evidence(evidence: PoseEvidence, rows: int) -> dict[str, Cells]:
    """Columns that state how the poses are known; they are the same in every row."""
    uncertainties = {
        "pose_position_sd_m": evidence.position_m,
        "pose_heading_sd_rad": evidence.heading_rad,
    }
    return {
        "pose_evidence": [str(evidence.kind)] * rows,
        "pose_source": [evidence.source] * rows,
        **{
            name: np.full(rows, np.nan if value is None else value)
            for name, value in uncertainties.items()
        },
    }


def cell_names(name: str, column: Column, width: int, joints: Sequence[str]) -> list[str]:
    """Names of the ``width`` numbers in a row of an array; the unit is the end of each name."""
    end = end_of(name)
    stem = name.removesuffix(end)
    match column.shape:
        case (shape,) if shape == JOINT:
            parts = [f"_{joint}" for joint in joints]
        case (shape, 3) if shape == LINK:
            stem = "link"
            parts = [f"{k // 3}_{_XYZ[k % 3]}" for k in range(width)]
        case (3, 3):
            parts = [f"_{k // 3}{k % 3}" for k in range(9)]
        case (3,):
            parts = [f"_{axis}" for axis in _XYZ]
        case (2,):
            parts = [f"_{bound}" for bound in _BOUNDS]
        case (shape,) if shape == ANY:
            parts = [str(k) for k in range(width)]
        case _:
            raise TypeError(f"{name}: no names for the cells of shape {column.shape}")
    return [f"{stem}{part}{end}" for part in parts]


def _points(cells: Mapping[str, Cells], lists: Sequence[Floats], width: int) -> dict[str, Cells]:
    """A row for each point, counted from 1 in its list; a point without a height has NaN."""
    counts = [len(points) for points in lists]
    points = np.concatenate(
        [
            np.zeros((0, width)),
            *(
                np.hstack([row_list, np.full((len(row_list), width - row_list.shape[1]), np.nan)])
                for row_list in lists
            ),
        ]
    )
    return {
        **{name: np.repeat(np.asarray(values), counts) for name, values in cells.items()},
        "number": np.concatenate([np.zeros(0, int), *(np.arange(1, n + 1) for n in counts)]),
        **{f"point_{_XYZ[k]}_m": points[:, k] for k in range(width)},
    }


def _config(header: Header) -> FlatTable:
    """Keys and values of the configuration; lists of numbers as JSON."""
    keys, values = zip(*_leaves("", header.row()), strict=True)
    columns: dict[str, Cells] = {"time_s": np.zeros(len(keys)), "key": keys, "value": values}
    return FlatTable(ConfigTable.topic.table_name, columns)


def _leaves(key: str, value: Any) -> Iterator[tuple[str, str]]:
    """Dotted keys of texts, numbers and lists of numbers."""
    if isinstance(value, dict):
        for name, inner in value.items():
            yield from _leaves(f"{key}.{name}" if key else name, inner)
    elif isinstance(value, list) and any(isinstance(inner, dict | list) for inner in value):
        for number, inner in enumerate(value):
            yield from _leaves(f"{key}.{number}", inner)
    else:
        yield key, value if isinstance(value, str) else encode(value)


def _texts(cells: Cells) -> Iterator[str]:
    """Cells as CSV shows them: the shortest text that gives a number back."""
    for cell in cells.tolist() if isinstance(cells, np.ndarray) else cells:
        if isinstance(cell, bool):
            yield "true" if cell else "false"
        else:
            yield "" if isinstance(cell, float) and math.isnan(cell) else str(cell)
