"""The help of the program, of each family and of each command at 80 columns."""

import io
import os
import time
from collections.abc import Iterator
from contextlib import redirect_stdout
from pathlib import Path
from typing import Final, NamedTuple
from unittest.mock import patch

from snakewalk.controller.cli.command_line import app
from tests.helpers.command import command_words

FOLDER: Final = Path(__file__).parent / "pages"
"""One file per command."""
_SCREEN: Final = {"COLUMNS": "80", "TERM": "dumb", "NO_COLOR": "1"}


class Page(NamedTuple):
    """Help of a command."""

    words: tuple[str, ...]
    text: str
    cpu_s: float

    @property
    def file(self) -> Path:
        """File of the stored text."""
        return FOLDER / f"{'-'.join(self.words) or 'snakewalk'}.txt"


def shown_pages() -> Iterator[Page]:
    """Yield the help that each command shows now."""
    with patch.dict(os.environ, _SCREEN):
        for words in command_words():
            out = io.StringIO()
            start_s = time.process_time()
            with redirect_stdout(out):
                app([*words, "--help"], prog_name="snakewalk", standalone_mode=False)
            lines = (line.rstrip() for line in out.getvalue().splitlines())
            yield Page(words, "\n".join(lines).strip("\n") + "\n", time.process_time() - start_s)


def write() -> None:
    """Store all pages, and delete those of commands that do not exist."""
    pages = [*shown_pages()]
    for old in FOLDER.glob("*.txt"):
        if old not in {page.file for page in pages}:
            old.unlink()
    for page in pages:
        page.file.write_text(page.text, encoding="utf-8")
