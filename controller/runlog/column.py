"""Fields of a log: type, shape, digits, and the curve of a field.

``topics`` annotates each field of a table class with a ``Column``, which writer, reader, exports
and curves read.
"""

import json
import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, fields
from enum import StrEnum
from mmap import ACCESS_READ, MADV_DONTNEED, mmap
from pathlib import Path
from tempfile import TemporaryFile, gettempdir
from typing import (
    Any,
    ClassVar,
    Literal,
    Self,
    TypeVar,
    dataclass_transform,
    get_args,
    get_type_hints,
)

import numpy as np

from snakewalk.config.arrays import Floats

Json = dict[str, Any]
Kind = Literal["exact", "rounded", "integer", "flag", "text", "joints", "points", "object"]
"""``exact`` floats keep every digit, ``rounded`` ones six decimals; ``joints`` are indices of some
joints, ``points`` lists of coordinates, ``object`` is any JSON."""
Watched = Literal["all", "newest", ""]
JOINT = "joint"
LINK = "link"
ANY = "any"
"""Sizes that differ from robot to robot, and from row to row."""
_JSON_TYPES = {
    "integer": "integer",
    "joints": "integer",
    "flag": "boolean",
    "text": "string",
}
REQUIRED = object()


class Panel(StrEnum):
    """Panels of curves, in the order in which pages show them; title with unit."""

    SPEED = "speed, m/s"
    CURRENT = "current, A"
    CYCLE = "time in a cycle, ms"
    HEAT = "hottest servo, °C"
    SUPPLY = "lowest supply, V"
    CHAIN = "whole chain, A"
    FRICTION = "estimated friction"
    JOINT_ANGLE = "joint's angle, rad"
    """Angle of the joint that the reader of the page selects."""
    JOINT_CURRENT = "joint's current, A"

    @property
    def is_of_one_joint(self) -> bool:
        """Whether the panel shows the joint that the reader of the page selects."""
        return self in (Panel.JOINT_ANGLE, Panel.JOINT_CURRENT)

    @property
    def unit(self) -> str:
        """Unit of the values; empty without one."""
        return self.partition(", ")[2]


@dataclass(frozen=True, slots=True)
class Curve:
    """A curve of a field over time."""

    panel: Panel
    name: str
    colour: str
    """Name of a colour of the report's palette."""
    joints: Literal["", "largest", "least", "mean"] = ""
    """Value that is drawn of a field with a value for each joint."""
    magnitude: bool = False
    """Whether the sign is left out."""
    scale: float = 1.0
    """Factor from the field's unit to the panel's."""
    flat: float | None = None
    """Span up to which the values are constant: the page then states the value in words."""
    constant: str = ""
    """Words for constant values; default: name, median and unit."""
    gaps: str = ""
    """Field of the same topic that is false where the curve has a gap."""


@dataclass(frozen=True, slots=True)
class Column:
    """A field of a topic. Its unit is the end of its name."""

    description: str
    """Description of the field in the topic's JSON schema."""
    kind: Kind = "rounded"
    shape: tuple[str | int, ...] = ()
    """Shape of one row: numbers, ``JOINT``, ``LINK`` or ``ANY``."""
    default: Any = REQUIRED
    """Value of a row that lacks the field, written now or read from an older log."""
    is_known: bool = False
    """Whether a single number is never null."""
    is_printed_alone: bool = False
    """Whether the digits of an array do not depend on unknown numbers in other arrays."""
    choices: tuple[str, ...] = ()
    """All texts that the field can have, if it is one of a few."""
    curves: tuple[Curve, ...] = ()

    @property
    def schema(self) -> Json:
        """JSON schema of the field."""
        if self.choices:
            return {"enum": list(self.choices)}
        name = _JSON_TYPES.get(self.kind, "number")
        kind: str | list[str] = name
        if self.kind == "points":
            kind = "array"
        elif self.kind == "object":
            kind = "object" if self.default is REQUIRED else ["object", "null"]
        elif self.shape and self.default is None:
            kind = ["array", "null"]
        elif self.shape:
            items = {"type": [name, "null"]}
            return {"type": "array", "items": items, "description": self.description}
        elif name == "number" and not self.is_known:
            kind = [name, "null"]
        return {"type": kind, "description": self.description}


@dataclass(frozen=True, slots=True)
class Topic:
    """Properties of a topic as a whole."""

    name: str
    """Begins with a slash."""
    columns: Mapping[str, Column]
    is_fast: bool
    """Whether rows are printed with a fixed number of digits, which is quicker."""
    only_changes: bool
    """Whether a row that differs from the last one only in time is left out."""
    is_optional: bool
    """Whether a log has the topic only if it has a row."""
    watched: Watched
    """Rows that a page and a ROS node receive: all, the newest, or none."""

    @property
    def table_name(self) -> str:
        """Name of an exported table."""
        return self.name.removeprefix("/")

    @property
    def schema_name(self) -> str:
        """Name under which the topic's schema is registered."""
        return f"snakewalk.{self.table_name.capitalize()}"

    @property
    def schema(self) -> bytes:
        """JSON schema (draft 7) of a row."""
        properties = {name: column.schema for name, column in self.columns.items()}
        return json.dumps(
            {"title": self.schema_name, "type": "object", "properties": properties},
            separators=(",", ":"),
        ).encode()


def storage_folder(path: Path) -> Path:
    """Return the folder for the columns of a long file: its own, because /tmp may be in memory."""
    return path.parent if os.access(path.parent, os.W_OK) else Path(gettempdir())


class StoredColumn:
    """A column of a long log in an unnamed file; only the rows that are used are in memory."""

    def __init__(self, folder: Path | None, rows: Any) -> None:
        self._file = TemporaryFile(dir=folder)  # noqa: SIM115  open as long as the record
        self._type = rows.dtype
        self._shape = rows.shape[1:]
        self.append(rows)

    def append(self, rows: Any) -> None:
        """Add rows (n, ...).

        Raises:
            ValueError: they have another shape than the first.
            OSError: the disk is full.

        """
        if rows.shape[1:] != self._shape:
            raise ValueError("rows of a topic have different shapes")
        self._file.write(np.ascontiguousarray(rows).data)
        self._file.flush()

    def mapped(self) -> Any:
        """Return all rows; they occupy memory until the returned array is released."""
        if not self._file.tell():
            return np.empty((0, *self._shape), self._type)
        pages = mmap(self._file.fileno(), 0, access=ACCESS_READ)
        return np.frombuffer(pages, self._type).reshape(-1, *self._shape)


class Table:
    """Base class of all tables: a field is an array with an entry for each row of the topic."""

    __slots__ = ()
    topic: ClassVar[Topic]
    time_s: Floats
    """Times of all tables but ``ConfigTable``."""

    def __getattribute__(self, name: str) -> Any:
        """Return a field; one of a long log is mapped from its file."""
        value = object.__getattribute__(self, name)
        return value.mapped() if isinstance(value, StoredColumn) else value

    def stored_columns(self) -> dict[str, Any]:
        """Return the fields by name; those of a long log stay in their files."""
        return {name: object.__getattribute__(self, name) for name in self.topic.columns}

    def with_columns(self, **columns: Any) -> Self:
        """Return the table with other values of some fields."""
        return type(self)(**self.stored_columns() | columns)


ROWS = 4096
"""Rows of a long log that are in memory at once (ours)."""
_SPAN_BYTES = 1 << 24
"""Largest part of a file that is in memory at once (ours), also of every n-th row."""


def release(columns: Iterable[Any]) -> None:
    """Remove the rows of columns that are stored in files from memory; they can be read again."""
    for column in columns:
        owner = column
        while isinstance(owner, np.ndarray):
            owner = owner.base
        if isinstance(owner, memoryview) and isinstance(owner.obj, mmap):
            owner.obj.madvise(MADV_DONTNEED)


def by_rows(function: Callable[..., Any], *columns: Any) -> Any:
    """Return ``function`` of columns (n, ...) without a copy of a whole column in memory.

    ``function`` accepts some rows of each column, and returns an entry for each row.
    """
    widest = max(abs(column.strides[0]) for column in columns)
    rows = max(min(ROWS, _SPAN_BYTES // max(widest, 1)), 1)
    if len(columns[0]) <= rows:
        return function(*columns)
    results = []
    for start in range(0, len(columns[0]), rows):
        results.append(function(*(column[start : start + rows] for column in columns)))
        release(columns)
    return np.concatenate(results)


T = TypeVar("T", bound=Table)
_registered_tables: list[type[Table]] = []


@dataclass_transform(frozen_default=True)
def topic(
    name: str,
    *,
    is_fast: bool = False,
    only_changes: bool = False,
    is_optional: bool = False,
    watched: Watched = "newest",
) -> Callable[[type[T]], type[T]]:
    """Return a decorator that makes a class the table of a topic and registers it."""

    def register(table_type: type[T]) -> type[T]:
        table = dataclass(frozen=True, slots=True)(table_type)
        hints = get_type_hints(table, include_extras=True)
        columns = {field.name: _column(hints[field.name]) for field in fields(table)}  # type: ignore[arg-type]
        table.topic = Topic(name, columns, is_fast, only_changes, is_optional, watched)
        _registered_tables.append(table)
        return table

    return register


def registered_tables() -> tuple[type[Table], ...]:
    """Return the table of each topic that is declared so far."""
    return tuple(_registered_tables)


def _column(hint: Any) -> Column:
    """Return the column of an annotation.

    Raises:
        TypeError: it has none.

    """
    columns = [arg for arg in get_args(hint) if isinstance(arg, Column)]
    if len(columns) != 1:
        raise TypeError(f"{hint}: each field of a topic is Annotated with one Column")
    return columns[0]
