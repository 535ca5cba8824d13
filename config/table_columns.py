"""Meaning of the columns of a text table as the user states it, with a preview of the table."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from snakewalk.config.errors import InputError
from snakewalk.config.text_table import is_number

_MOST_HEAD_LINES = 100
_SHOWN_ROWS, _SHOWN_COLUMNS = 4, 30


def with_meanings(
    file: Path, rows: Sequence[list[str]], columns: Mapping[str, str], notes: list[str]
) -> list[list[str]]:
    """Rows whose first one has the stated meanings, and then the names of the other columns.

    The line of names is the first one that has all stated names. A preview is appended to
    ``notes``.

    Raises:
        InputError: a column does not exist; shows the preview.

    """
    if not columns:
        return list(rows)
    stated = list(columns.values())
    cells = [[cell.strip(" \"'") for cell in row] for row in rows[:_MOST_HEAD_LINES]]
    head = next((k for k, row in enumerate(cells) if {*stated} <= {*row}), -1)
    names = cells[max(head, 0)]
    if head < 0:
        numbers = [str(k + 1) for k in range(len(names))]
        wrong = [name for name in stated if name not in numbers]
        if wrong:
            raise InputError([f"{file}: --columns: it has no column {wrong[0]}", *preview(rows)])
        head = -1 if all(map(is_number, names)) else 0
        places = [numbers.index(name) for name in stated]
    else:
        places = [names.index(name) for name in stated]
    notes += preview(rows[max(head, 0) :], dict(zip(places, columns, strict=True)))
    others = [k for k in range(len(names)) if k not in places]
    return [
        [*columns, *(names[k] for k in others)],
        *([row[k] if row[k:] else "" for k in (*places, *others)] for row in rows[head + 1 :]),
    ]


def preview(rows: Sequence[list[str]], meanings: Mapping[int, str] | None = None) -> list[str]:
    """One line for each column: number, meaning, and first cells, of which one may be a name."""
    first = rows[:_SHOWN_ROWS]
    lines = []
    width = max(map(len, first), default=0)
    for k in range(min(width, _SHOWN_COLUMNS) if width > 1 else 0):
        meaning = "" if meanings is None else f" is {meanings.get(k, 'not chosen')}"
        shown = ", ".join(row[k].strip() for row in first if row[k:])
        lines.append(f"column {k + 1}{meaning}: {shown}")
    return lines
