"""A console whose texts cannot control the terminal and whose tables fit its width."""

from collections.abc import Iterable
from typing import Any

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment
from rich.table import Table
from rich.text import Text

from snakewalk.config.plain_text import plain
from snakewalk.controller.console.fitted_table import fitted


class PlainConsole(Console):
    """Prints all texts as ``plain``; styles and cursor moves are its own."""

    def print(self, *objects: Any, **options: Any) -> None:
        """Print objects; a table fits the width."""
        shown = [fitted(one, self) if isinstance(one, Table) else one for one in objects]
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
