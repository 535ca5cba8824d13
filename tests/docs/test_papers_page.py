"""The page of the papers names commands, tests and pictures that exist."""

import re
import shlex
from pathlib import Path
from typing import Any

import pytest
from typer.main import get_command

from snakewalk.controller.cli.command_line import app

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "papers.md").read_text(encoding="utf-8")
ROWS = [
    [cell.strip() for cell in line.strip("|").split("|")]
    for line in PAGE.splitlines()
    if re.match(r"\| (?!place|---)", line)
]


def test_every_row_has_a_command_and_a_test_or_a_reason() -> None:
    assert len(ROWS) > 50
    for row in ROWS:
        assert len(row) == 5, row
        assert (row[2] == "-") == (row[3] == "-"), row
        assert len(row[4]) > 8, row


def test_every_command_is_complete() -> None:
    """The page named commands without required arguments, such as ``snakewalk animal body``."""
    commands = {row[2].strip("`") for row in ROWS if row[2] != "-"}
    assert len(commands) > 25
    for words in commands:
        name, *rest = shlex.split(words)
        assert name == "snakewalk"
        assert parsed(rest).command.name != "snakewalk", words


def test_a_command_with_a_missing_or_unknown_word_is_not_complete() -> None:
    for words in (["animal", "body"], ["animal", "people", "walk", "--bogus"], ["world", "none"]):
        with pytest.raises(Exception, match=r"Missing|No such"):
            parsed(words)


def parsed(words: list[str]) -> Any:
    """Return the context of the command that these words call, without calling it."""
    command: Any = get_command(app)
    name, context, rest = "snakewalk", None, words
    while True:
        context = command.make_context(name, rest, parent=context)
        if not hasattr(command, "resolve_command"):
            return context
        words_left = [*getattr(context, "_protected_args", []), *context.args]
        name, command, rest = command.resolve_command(context, words_left)


def test_every_test_and_picture_exists() -> None:
    tests = [row[3].strip("`") for row in ROWS if row[3] != "-"]
    assert [each for each in tests if not (ROOT / "tests/controller" / each).is_file()] == []
    pictures = re.findall(r"\]\((pictures/[^)]+|benchmarks/[^)]+|\w+\.md)\)", PAGE)
    assert len(pictures) > 30
    assert [each for each in pictures if not (ROOT / "docs" / each).is_file()] == []


def test_every_figure_and_table_of_the_papers_has_a_row() -> None:
    """Numbers of figures and tables by paper, as printed."""
    printed = {"PT": (14, 0), "KP": (17, 0), "YT": (9, 2), "TH": (15, 0), "GC": (16, 1)}
    sections = re.split(r"^## \[(\w+)\]", PAGE, flags=re.MULTILINE)[1:]
    found = dict(zip(sections[::2], sections[1::2], strict=True))
    for key, (figures, tables) in printed.items():
        text = "\n".join(line.split("|")[1] for line in found[key].splitlines() if "|" in line)
        wanted = [f"Fig. {n}" for n in range(1, figures + 1)]
        wanted += [f"Table {n}" for n in range(1, tables + 1)]
        assert [each for each in wanted if not re.search(re.escape(each) + r"\b", text)] == [], key
