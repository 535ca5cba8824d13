"""Cells of text tables of other programs: separator, decimal commas and missing values."""

import csv
import re
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from snakewalk.config.archive import read_text
from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError

MISSING = frozenset({"", "nan", "na", "n/a", "null", "none", "-"})
"""Lower-case cells for a missing value."""
DECIMAL_COMMA = re.compile(r"[-+]?\d*,\d+([eE][-+]?\d+)?")
_THOUSANDS = re.compile(r"[-+]?[1-9]\d{0,2}(,\d{3})+")
_MOST_BYTES = 250_000_000
"""Limit of a table (ours): its cells need several times its size in memory."""
_SEPARATORS = (",", ";", "\t")


def read_lines(file: Path, what: str) -> list[str]:
    """Lines of a text file; ``what`` names its format in a message.

    Raises:
        InputError: it has another encoding, or is too large.
        OSError: it cannot be read.

    """
    try:
        return read_text(file, _MOST_BYTES).splitlines()
    except UnicodeDecodeError:
        raise InputError(f"{file}: is not a {what} in UTF-8; choose another file") from None


def read_rows(file: Path, what: str, separator: str | None = None) -> list[list[str]]:
    """Cells of a CSV; numbers with decimal commas get decimal points.

    ``separator`` is by default the most frequent one of the first line.

    Raises:
        InputError: the file is not such a table.
        OSError: it cannot be read.

    """
    lines = read_lines(file, what)
    first = next((line for line in lines if any(mark in line for mark in _SEPARATORS)), "")
    try:
        rows = list(csv.reader(lines, delimiter=separator or max(_SEPARATORS, key=first.count)))
    except csv.Error as error:
        raise InputError(f"{file}: is not a {what}: {error}; choose another file") from None
    if has_decimal_commas(file, rows):
        rows = [[_with_point(cell) for cell in row] for row in rows]
    return rows


def _with_point(cell: str) -> str:
    return cell.replace(",", ".") if DECIMAL_COMMA.fullmatch(cell.strip()) else cell


def has_decimal_commas(file: Path, rows: Iterable[list[str]]) -> bool:
    """Whether the numbers have decimal commas.

    Raises:
        InputError: they may also be thousands.

    """
    cells = [cell.strip() for row in rows for cell in row if "," in cell]
    cells = [cell for cell in cells if DECIMAL_COMMA.fullmatch(cell) or _THOUSANDS.fullmatch(cell)]
    if cells and all(_THOUSANDS.fullmatch(cell) for cell in cells):
        raise InputError(
            f"{file}: {cells[0]!r} has a comma for decimals or for thousands; write decimal points"
        )
    return bool(cells)


def is_number(cell: str, comma: bool = False) -> bool:
    """Whether a cell is a number, also one with a decimal comma, or stands for none."""
    try:
        float(cell.replace(",", ".") if comma else cell)
    except ValueError:
        return cell.lower() in MISSING
    return True


def numbers_of(
    file: Path, rows: Iterable[Sequence[str]], names: Sequence[str], lines: Iterable[int]
) -> Floats:
    """Cells (rows, columns) as numbers; NaN for missing ones.

    Args:
        file: for errors.
        rows: cells; further ones than ``names`` are ignored.
        names: of the columns.
        lines: of the rows in the file.

    Raises:
        InputError: a cell is not a number; names its line and column.

    """
    rows = list(rows)
    values = np.full((len(rows), len(names)), np.nan)
    for k, (row, line) in enumerate(zip(rows, lines, strict=False)):
        for column, (cell, name) in enumerate(zip(row, names, strict=False)):
            text = cell.strip()
            try:
                values[k, column] = np.nan if text.lower() in MISSING else float(text)
            except ValueError:
                raise InputError(
                    f"{file}: line {line}: {name}: expected a number or nothing, found {text!r}"
                ) from None
    return values
