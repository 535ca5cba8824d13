"""Tables of numbers: CSV and XYZ, with decimal points or decimal commas."""

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.table_columns import with_meanings
from snakewalk.config.text_table import (
    DECIMAL_COMMA,
    has_decimal_commas,
    is_number,
    numbers_of,
    read_lines,
)


def read_numbers(
    file: Path,
    notes: list[str],
    names: list[str] | None = None,
    chosen: Mapping[str, str] = MappingProxyType({}),
) -> Floats:
    """Numbers (rows, columns) of a table, with or without a line of names.

    Commas, semicolons, tabs or blanks separate them. Empty cells, ``NaN`` and ``NA`` are NaN.
    Without comma separators a table may have decimal commas. Names of columns are appended to
    ``names``. ``chosen`` are meanings of columns, of which alone the numbers are read.

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
    if chosen:
        named = with_meanings(file, [cells for _, cells in rows], chosen, notes)
        named = [cells[: len(chosen)] for cells in named]
        rows = list(zip([0, *(n for n, _ in rows[-len(named) + 1 :])], named, strict=True))
    comma = mark != "," and has_decimal_commas(file, [cells for _, cells in rows])
    if not all(is_number(cell, comma) for cell in rows[0][1]):
        if names is not None:
            names += rows[0][1]
        rows = rows[1:]
    widths = {len(cells) for _, cells in rows}
    if len(widths) != 1:
        raise InputError(_uneven(file, rows, widths))
    if comma:
        notes.append("numbers have decimal commas")
    cells = ([cell.replace(",", ".") if comma else cell for cell in row] for _, row in rows)
    columns = [f"column {k + 1}" for k in range(widths.pop())]
    return numbers_of(file, cells, columns, [number for number, _ in rows])


def _separator(lines: list[str]) -> str | None:
    """Separator of the cells: the first of ; tab , in a line of numbers; else blanks."""
    first = lines[:10]
    for mark in ";\t":
        if any(mark in line for line in first):
            return mark
    if any("," in line for line in first):
        words = next(line for line in reversed(first) if "," in line).split()
        decimal = len(words) > 1 and all(
            DECIMAL_COMMA.fullmatch(word) or is_number(word) for word in words
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
