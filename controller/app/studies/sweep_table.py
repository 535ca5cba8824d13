"""The table of a sweep: one tidy CSV, a row for each finished point, written when it finishes."""

import csv
import io
import os
from pathlib import Path
from types import TracebackType
from typing import Self

from snakewalk.config.errors import InputError
from snakewalk.controller.app.studies.sweep_measure import MEASURED, Row
from snakewalk.controller.app.studies.sweep_points import Point
from snakewalk.controller.gaits.registry import GAITS

_PLACE = ("gait", "robot", "world", "number", "seed", "seconds")
_PARAMETERS = tuple(sorted({key for gait in GAITS.values() for key in gait.model.model_fields}))
COLUMNS = (*_PLACE, *MEASURED, *_PARAMETERS)
"""Empty where a gait has no such parameter, or nothing could be measured."""


def read_table(path: Path) -> list[dict[str, str]]:
    """Read the whole rows of a table; a last line that was cut off is left out.

    Raises:
        InputError: no table of a sweep.

    """
    try:
        text = path.read_text()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: {getattr(error, 'strerror', None) or 'is no text'}") from None
    whole = text[: text.rfind("\n") + 1]
    rows = csv.DictReader(io.StringIO(whole))
    if not whole or tuple(rows.fieldnames or ()) != COLUMNS:
        raise InputError(f"{path}: is no table of `snakewalk sweep` of this version")
    return list(rows)


class Table:
    """Appends rows, each of them on the disk before the next; knows what is there already."""

    def __init__(self, path: Path) -> None:
        """Open or make the table.

        Raises:
            InputError: the file is something else.

        """
        self._path = path
        self._done: set[tuple[str, ...]] = set()
        if path.exists() and path.stat().st_size:
            rows = read_table(path)
            self._done = {tuple(row[key] for key in _PLACE) for row in rows}

    def __enter__(self) -> Self:
        """Cut off a torn last line and open for appending."""
        if self._path.exists():
            whole = self._path.read_bytes()
            if not whole.endswith(b"\n"):
                os.truncate(self._path, whole.rfind(b"\n") + 1)
        self._path.parent.mkdir(parents=True, exist_ok=True)
        self._file = self._path.open("a", newline="")
        self._writer = csv.DictWriter(self._file, COLUMNS, restval="", lineterminator="\n")
        if self._file.tell() == 0:
            self._writer.writeheader()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Close."""
        self._file.close()

    def missing(self, points: list[Point]) -> list[Point]:
        """Those of ``points`` that the table does not hold yet."""
        return [point for point in points if point.key not in self._done]

    def add(self, point: Point, row: Row) -> None:
        """Append a finished point."""
        place = dict(zip(_PLACE, point.key, strict=True))
        values = GAITS[point.gait].of(dict(point.parameters)).params.model_dump()
        found = place | {k: v for k, v in (row | values).items() if v is not None}
        self._writer.writerow(found)
        self._file.flush()
        os.fsync(self._file.fileno())
        self._done.add(point.key)


def number(row: dict[str, str], key: str) -> float:
    """A cell as a number; NaN where it is empty."""
    return float(row[key]) if row[key] else float("nan")
