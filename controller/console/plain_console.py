"""A console whose texts, such as names from files, cannot control the terminal."""

from collections.abc import Iterable
from typing import Any

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment
from rich.text import Text

from snakewalk.config.plain_text import plain


class PlainConsole(Console):
    """Prints all texts as ``plain``; styles and cursor moves are its own."""

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
