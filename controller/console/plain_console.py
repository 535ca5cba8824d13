"""A console whose texts cannot control the terminal and whose tables fit its width."""

from collections.abc import Iterable
from typing import Any

from rich.console import Console, ConsoleOptions, Group, RenderableType
from rich.measure import Measurement
from rich.segment import Segment
from rich.table import Column, Table
from rich.text import Text

from snakewalk.config.plain_text import plain

_UNLIMITED_COLUMNS = 10_000
"""Width at which no table breaks a line."""
_HEAD = 12
"""Fewest characters of a heading in a column that may break words (ours)."""
_SENTENCE = (20, 12)
"""Fewest characters of a column of sentences, and of one in a crowded table (ours)."""


class PlainConsole(Console):
    """Prints all texts as ``plain``; styles and cursor moves are its own."""

    def print(self, *objects: Any, **options: Any) -> None:
        """Print objects; a table fits the width."""
        shown = [
            _fitted_table(printed, self) if isinstance(printed, Table) else printed
            for printed in objects
        ]
        super().print(*shown, **options)

    def render_str(self, text: str, **options: Any) -> Text:
        """Convert a string to text, before table columns are measured."""
        return super().render_str(plain(text), **options)

    def render(
        self, renderable: RenderableType, options: ConsoleOptions | None = None
    ) -> Iterable[Segment]:
        """Render an object to an iterable of segments."""
        for segment in super().render(renderable, options):
            if segment.control or segment.text.isprintable():
                yield segment
            else:
                yield Segment(plain(segment.text), segment.style)


def _fitted_table(table: Table, console: Console) -> RenderableType:
    """Return what shows a table within the width of ``console``, no word cut.

    The widths of the columns are set here: rich shortens words while other columns have space.
    """
    unlimited = console.options.update(width=_UNLIMITED_COLUMNS)
    if not table.columns or Measurement.get(console, unlimited, table).maximum <= console.width:
        return table
    table.padding = (0, 1, 0, 0)
    table.pad_edge = False
    total = Measurement.get(console, unlimited, table).maximum
    for sentence in _SENTENCE:
        columns = [_widths(column, console, sentence) for column in table.columns]
        flexible_width = sum(most - least for least, most in columns)
        spare = console.width - total + flexible_width
        if spare >= 0:
            for column, (least, most) in zip(table.columns, columns, strict=True):
                column.width = min(least + spare * (most - least) // max(flexible_width, 1), most)
                column.no_wrap = False
            return table
    return _blocks(table)


def _widths(column: Column, console: Console, sentence: int) -> tuple[int, int]:
    """Return the fewest characters of a readable column, and those of its longest line."""
    unlimited = console.options.update(width=_UNLIMITED_COLUMNS)
    cells = [Measurement.get(console, unlimited, cell) for cell in column.cells]
    head = Measurement.get(console, unlimited, column.header)
    most = max(cell.maximum for cell in (head, *cells))
    if column.no_wrap:
        return most, most
    breaks_words = column.overflow == "fold"
    heading = min(head.minimum, _HEAD) if breaks_words else head.minimum
    readable = [max(cell.minimum, min(cell.maximum, sentence)) for cell in cells]
    return max(heading, *readable, 1), most


def _blocks(table: Table) -> RenderableType:
    """Return a row of a table as a block of lines: the heading of each cell, and the cell."""
    blocks: list[RenderableType] = [table.title] if table.title else []
    for row in zip(*(column.cells for column in table.columns), strict=True):
        block = Table(box=None, show_header=False, pad_edge=False)
        for column, cell in zip(table.columns, row, strict=True):
            if cell not in {"", None}:
                block.add_row(column.header, cell)
        blocks += [block, ""]
    return Group(*blocks)
