"""Tables of numbers: CSV and XYZ, with decimal points or decimal commas."""

from pathlib import Path

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.text_table import DECIMAL_COMMA, MISSING, has_decimal_commas, read_lines


def read_numbers(
    file: Path, notes: list[str] | None = None, names: list[str] | None = None
) -> Floats:
    """Numbers (rows, columns) of a table, with or without a line of names.

    Commas, semicolons, tabs or blanks separate them. Empty cells, ``NaN`` and ``NA`` are NaN.
    Without comma separators a table may have decimal commas. Names of columns are appended to
    ``names``.

    Raises:
        InputError: the file is not such a table; names the first cell that is not a number.

    """
    lines = [
        (number, line)
        for number, line in enumerate(read_lines(file, "table"), start=1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if not lines:
        raise InputError(f"{file}: holds no numbers")
    mark = _separator([line for _, line in lines])
    rows = [(number, [cell.strip() for cell in line.split(mark)]) for number, line in lines]
    comma = mark != "," and has_decimal_commas(file, [cells for _, cells in rows])
    if not all(_is_number(cell, comma) for cell in rows[0][1]):
        if names is not None:
            names += rows[0][1]
        rows = rows[1:]
    widths = {len(cells) for _, cells in rows}
    if len(widths) != 1:
        raise InputError(_uneven(file, rows, widths))
    values = np.full((len(rows), widths.pop()), np.nan)
    for k, (number, cells) in enumerate(rows):
        plain = None if comma else _plain(cells)
        values[k] = _row(file, number, cells, comma) if plain is None else plain
    if comma and notes is not None:
        notes.append("numbers have decimal commas")
    return values


def _row(file: Path, line: int, cells: list[str], comma: bool) -> list[float]:
    values = []
    for column, cell in enumerate(cells, start=1):
        value = _number(cell, comma)
        if value is None:
            raise InputError(
                f"{file}: line {line}, column {column}: {cell!r} is not a number; leave cells "
                "without a value empty"
            )
        values.append(value)
    return values


def _separator(lines: list[str]) -> str | None:
    """Separator of the cells: the first of ; tab , in a line of numbers; else blanks."""
    first = lines[:10]
    for mark in ";\t":
        if any(mark in line for line in first):
            return mark
    if any("," in line for line in first):
        words = next(line for line in reversed(first) if "," in line).split()
        decimal = len(words) > 1 and all(
            DECIMAL_COMMA.fullmatch(word) or _is_number(word, False) for word in words
        )
        return None if decimal else ","
    return None


def _uneven(file: Path, rows: list[tuple[int, list[str]]], widths: set[int]) -> str:
    if not rows:
        return f"{file}: holds no numbers behind its line of names"
    first = len(rows[0][1])
    line, count = next((number, len(cells)) for number, cells in rows if len(cells) != first)
    return (
        f"{file}: line {line} holds {count} numbers, line {rows[0][0]} holds {first}; all need as "
        "many"
    )


def _plain(cells: list[str]) -> list[float] | None:
    try:
        return [float(cell) for cell in cells]
    except ValueError:
        return None


def _number(cell: str, comma: bool) -> float | None:
    if cell.lower() in MISSING:
        return float("nan")
    try:
        return float(cell.replace(",", ".") if comma else cell)
    except ValueError:
        return None


def _is_number(cell: str, comma: bool) -> bool:
    return _number(cell, comma) is not None
