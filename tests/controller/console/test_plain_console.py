"""Names in tables, bars and messages cannot steer the terminal; colours of our own can."""

import io
import logging
from pathlib import Path

from rich.table import Table
from rich.text import Text

from snakewalk.controller.console.messages import LOGGER, messages
from snakewalk.controller.console.options import console
from snakewalk.controller.console.plain_console import PlainConsole

NAME = "good\x1b[2J\u202etxt.exe\r\x9b"


def test_a_table_and_a_line_show_question_marks() -> None:
    file = io.StringIO()
    shown = PlainConsole(
        file=file, width=100, force_terminal=True, color_system="standard", highlight=False
    )
    table = Table("name", box=None)
    table.add_row(NAME, style="red")
    shown.print(table)
    shown.print(NAME, markup=False)
    shown.print(Text(NAME))
    text = file.getvalue()
    assert text.count("good?[2J?txt.exe") == 3
    assert "\x1b[31m" in text, "red is ours"
    for steering in ("\x1b[2J", "\u202e", "\r", "\x9b"):
        assert steering not in text


def test_results_are_printed_by_such_a_console() -> None:
    assert isinstance(console, PlainConsole)


def test_the_log_file_has_one_plain_line_a_message(tmp_path: Path) -> None:
    file = tmp_path / "log"
    with messages("error", file):
        LOGGER.log(logging.WARNING, "robot %s", NAME)
    text = file.read_text(encoding="utf-8")
    assert "robot good?[2J?txt.exe??" in text
    assert text.replace("\n", "").isprintable()
