"""Rows to tables: lists of JSON objects become arrays with one entry for each row."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import fields, replace
from itertools import chain, pairwise
from pathlib import Path
from sys import intern
from typing import Any, TypeVar, cast, get_type_hints

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.runlog.column import (
    ANY,
    JOINT,
    LINK,
    REQUIRED,
    ROWS,
    Column,
    StoredColumn,
    Table,
)
from snakewalk.controller.runlog.encode import array
from snakewalk.controller.runlog.evidence import Kind
from snakewalk.controller.runlog.record import Event, Header, RunRecord
from snakewalk.controller.runlog.topics import (
    ConfigTable,
    EventTable,
    PathTable,
    WaypointTable,
)

Row = Mapping[str, Any]
T = TypeVar("T", bound=Table)
_TABLES: Mapping[str, type[Table]] = {
    name: kind
    for name, kind in get_type_hints(RunRecord).items()
    if isinstance(kind, type) and issubclass(kind, Table)
}
"""Tables of a record, by attribute."""


_PARTS = 4
"""Parts of a table that stay in memory (ours): 5 minutes at 50 Hz."""


class RowPacker:
    """Turns rows into arrays while a long log is read, after the row of its configuration.

    A row needs ten times the memory of its arrays. The arrays of a long table go into unnamed
    files in ``folder``.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.parts: dict[type[Table], list[Table]] = {}
        """Tables of the rows so far, in their order."""
        self._kinds = {kind.topic.name: kind for kind in _TABLES.values()}
        self._sizes: dict[str, int] = {}

    def pack(self, topic: str, rows: dict[str, list[dict[str, Any]]]) -> None:
        """Move the rows of a topic to ``parts`` if there are many.

        Rows that are not of this version stay; ``record_of`` reports them.

        Raises:
            OSError: the disk is full.

        """
        kind = self._kinds.get(topic)
        if kind is None or len(rows[topic]) < ROWS or not rows[ConfigTable.topic.name]:
            return
        with suppress(LookupError, TypeError, ValueError, AttributeError):
            self._sizes = self._sizes or _sizes(Header.of(rows[ConfigTable.topic.name][0]))
            part = table_of(kind, rows[topic], self._sizes)
            parts = self.parts.setdefault(kind, [])
            parts.append(part)
            rows[topic] = []
            if len(parts) >= _PARTS:
                parts[:] = [_joined_table(parts, self.folder)]


def _sizes(header: Header) -> dict[str, int]:
    return {JOINT: header.robot.joint_count, LINK: header.robot.link_count}


def record_of(
    rows: Mapping[str, Sequence[Row]],
    *,
    complete: bool,
    note: str,
    header: Header | None = None,
    parts: Mapping[type[Table], Sequence[Table]] | None = None,
) -> RunRecord:
    """Build the record from rows by topic; the first ``ConfigTable`` row is the header's.

    ``header`` replaces it, for example if the rows contain none. ``parts`` are the tables of
    earlier rows.

    Raises:
        KeyError: a row lacks a field.
        ValueError: parts have different shapes.
        pydantic.ValidationError: the configuration is not of this version.

    """
    if header is None:
        header = Header.of(rows[ConfigTable.topic.name][0])
    sizes = _sizes(header)
    earlier = parts or {}

    def table(kind: type[T]) -> T:
        last = rows.get(kind.topic.name, ())
        parts = [*earlier.get(kind, ())]
        if last or not parts:
            parts.append(table_of(kind, last, sizes))
        return cast(T, _joined_table(parts) if len(parts) > 1 else parts[0])

    paths = table(PathTable)
    changed = table(WaypointTable)
    events = table(EventTable)
    waypoints = (
        (0.0, header.plan.waypoints_m),
        *zip(changed.time_s.tolist(), changed.waypoints_m, strict=True),
    )
    tables: dict[str, Any] = {name: table(kind) for name, kind in _TABLES.items()}
    confirmed = tables["pose_source"].is_confirmed
    if len(confirmed) and not confirmed[-1]:
        evidence = replace(header.pose_evidence, kind=Kind.UNCONFIRMED)
        header = replace(header, pose_evidence=evidence)
    return RunRecord(
        header=_with_waypoints(header, waypoints) if len(waypoints) > 1 else header,
        paths=(
            (0.0, header.plan.path_m),
            *zip(paths.time_s.tolist(), paths.points_m, strict=True),
        ),
        waypoints=waypoints,
        events=tuple(
            Event(*columns)
            for columns in zip(
                events.time_s.tolist(), events.level, events.kind, events.text, strict=True
            )
        ),
        complete=complete,
        note=note,
        **tables,
    )


def table_of(kind: type[T], rows: Sequence[Row], sizes: Mapping[str, int]) -> T:
    """Build the table of a topic; ``sizes`` are the numbers of joints and links.

    Raises:
        KeyError: a row lacks a field that has no default.

    """
    columns = kind.topic.columns
    return kind(
        **{
            field.name: _cells(field.name, columns[field.name], rows, sizes)
            for field in fields(kind)  # type: ignore[arg-type]
        }
    )


def _joined_table(parts: Sequence[T], folder: Path | None = None) -> T:
    """Return the table of all parts; arrays go into files in ``folder``, if it is given."""
    columns = [part.stored_columns() for part in parts]
    cells: dict[str, Any] = {}
    for name, first in columns[0].items():
        others = [values[name] for values in columns[1:]]
        if not isinstance(first, np.ndarray | StoredColumn):
            cells[name] = type(first)(chain(first, *others))
        elif folder is None and isinstance(first, np.ndarray):
            cells[name] = np.concatenate([first, *others])
        else:
            stored = first if isinstance(first, StoredColumn) else StoredColumn(folder, first)
            for values in others:
                stored.append(values)
            cells[name] = stored
    return type(parts[0])(**cells)


def _cells(name: str, column: Column, rows: Sequence[Row], sizes: Mapping[str, int]) -> Any:
    if column.default is REQUIRED:
        values = [row[name] for row in rows]
    else:
        values = [row.get(name, column.default) for row in rows]
    if column.kind == "points":
        return [_points(value, column) for value in values]
    if column.kind == "text":
        return tuple(map(intern, values))
    if column.kind == "joints":
        return tuple(map(tuple, values))
    sizes = {**sizes, ANY: len(values[0]) if column.shape == (ANY,) and values else 0}
    shape = [sizes[size] if isinstance(size, str) else size for size in column.shape]
    if column.default is None and column.shape:
        unknown = np.full(shape, None).tolist()
        values = [unknown if value is None else value for value in values]
    kind = {"integer": np.int64, "flag": np.bool_}.get(column.kind, np.float64)
    return np.array(values, dtype=kind).reshape(len(rows), *shape)


def _points(value: Any, column: Column) -> Floats:
    """Points of a row; an empty list has as many coordinates as the column says."""
    coordinates = column.shape[1]
    points = array(value)
    return points.reshape(-1, coordinates) if isinstance(coordinates, int) else points


def _with_waypoints(header: Header, waypoints: Sequence[tuple[float, Floats]]) -> Header:
    """Return a header whose plan has the last waypoints, each with the time it came into force."""
    set_s = [0.0] * len(waypoints[0][1])
    for (_, before_m), (time_s, after_m) in pairwise(waypoints):
        common_count = 0
        while (
            common_count < min(len(before_m), len(after_m))
            and (before_m[common_count] == after_m[common_count]).all()
        ):
            common_count += 1
        set_s = set_s[:common_count] + [time_s] * (len(after_m) - common_count)
    plan = replace(header.plan, waypoints_m=waypoints[-1][1], set_s=np.array(set_s))
    return replace(header, plan=plan)
