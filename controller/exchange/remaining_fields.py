"""Fields of a log that no well-known message of an export contains."""

from collections.abc import Collection, Iterator, Mapping
from typing import Any

import numpy as np

from snakewalk.controller.runlog.column import Column, Table
from snakewalk.controller.runlog.record import RunRecord

TIME = "time_s"
Shown = Mapping[type[Table], Collection[str]]
"""Fields that well-known messages contain, by table."""


def remaining_fields(record: RunRecord, shown: Shown) -> Iterator[tuple[Table, dict[str, Column]]]:
    """Tables that have rows, and their fields that no well-known message contains.

    A field is left out if it is unknown in every row.
    """
    for table in record.tables():
        columns = {
            name: column
            for name, column in table.topic.columns.items()
            if name not in shown.get(type(table), ())
            and name != TIME
            and _has_value(getattr(table, name))
        }
        if columns:
            yield table, columns


def _has_value(values: Any) -> bool:
    """Whether a field has a value in any row."""
    if isinstance(values, np.ndarray) and values.dtype.kind == "f":
        return bool(np.isfinite(values).any())
    return len(values) > 0
