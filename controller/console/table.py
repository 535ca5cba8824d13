"""A table of results as one CSV that survives a kill: each row is on disk before the next."""

import csv
import io
import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Self

from snakewalk.config.archive import read_bytes, read_text
from snakewalk.config.errors import InputError

_NO_ROW: dict[str, str] = {}


def read_csv_table(path: Path, columns: Sequence[str], command: str) -> Iterator[dict[str, str]]:
    """Yield the complete rows of a table that ``command`` wrote; drops a torn last line.

    Raises:
        InputError: the file is something else.

    """
    try:
        text = read_text(path)
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: {getattr(error, 'strerror', None) or 'is no text'}") from None
    complete_text = text[: text.rfind("\n") + 1]
    rows = csv.DictReader(io.StringIO(complete_text))
    if not complete_text or tuple(rows.fieldnames or ()) != tuple(columns):
        raise InputError(
            f"{path}: is not a table of `snakewalk {command}` of this version; choose another file"
        )
    return iter(rows)


class CsvTable:
    """Appends rows; identifies existing ones by the columns of ``place``."""

    def __init__(
        self,
        path: Path,
        *,
        columns: Sequence[str],
        place: Sequence[str],
        command: str,
        keeps_rows: bool = True,
    ) -> None:
        """Open or make the table; without ``keeps_rows`` only the places stay in memory.

        Raises:
            InputError: the file is something else.

        """
        self._path, self._columns, self._place = path, tuple(columns), tuple(place)
        self._keeps_rows = keeps_rows
        self._held: dict[tuple[str, ...], dict[str, str]] = {}
        if path.exists() and path.stat().st_size:
            for row in read_csv_table(path, columns, command):
                self._hold(row)

    def __enter__(self) -> Self:
        """Cut off a torn last line and open for appending."""
        if self._path.exists():
            content = read_bytes(self._path)
            if not content.endswith(b"\n"):
                os.truncate(self._path, content.rfind(b"\n") + 1)
        self._file = self._path.open("a", newline="")
        self._writer = csv.DictWriter(
            self._file, self._columns, restval="", extrasaction="ignore", lineterminator="\n"
        )
        return self

    def __exit__(self, *raised: object) -> None:
        """Close; delete a table without rows."""
        empty = self._file.tell() == 0
        self._file.close()
        if empty:
            self._path.unlink()

    def held(self, place: tuple[str, ...]) -> dict[str, str] | None:
        """Return the row of a place, empty if rows are not kept; None if it is missing."""
        return self._held.get(place)

    def append(self, row: Mapping[str, object]) -> None:
        """Append a row, and have it on the disk."""
        text = {key: str(value) for key, value in row.items()}
        if self._file.tell() == 0:
            self._writer.writeheader()
        self._writer.writerow(text)
        self._file.flush()
        os.fsync(self._file.fileno())
        self._hold(text)

    def _hold(self, row: dict[str, str]) -> None:
        self._held[tuple(row[key] for key in self._place)] = row if self._keeps_rows else _NO_ROW
