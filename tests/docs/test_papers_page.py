"""The page of the papers names commands, tests and pictures that exist."""

import re
import shlex
from pathlib import Path
from typing import Any

import pytest
from typer.main import get_command

from snakewalk.controller.cli.command_line import app

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "papers.md").read_text(encoding="utf-8").partition("\n## Errata\n")[0]
ROWS = [
    [cell.strip() for cell in line.strip("|").split("|")]
    for line in PAGE.splitlines()
    if re.match(r"\| (?!place|---)", line) and line.count(" | ") == 4
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


def test_every_numbered_item_of_the_papers_has_a_row() -> None:
    """Equations, algorithms, figures and tables by paper, as printed."""
    kinds = ("Eq.", "Algorithm", "Fig.", "Table")
    printed = {
        "PT": (13, 2, 15, 0),
        "KP": (9, 0, 17, 0),
        "YT": (13, 0, 9, 2),
        "TH": (3, 0, 15, 0),
        "GC": (12, 0, 16, 1),
    }
    sections = re.split(r"^## \[(\w+)\]", PAGE, flags=re.MULTILINE)[1:]
    found = dict(zip(sections[::2], sections[1::2], strict=True))
    for key, counts in printed.items():
        places = [line.split("|")[1] for line in found[key].splitlines() if line.startswith("|")]
        for kind, count in zip(kinds, counts, strict=True):
            listed = {number for place in places for number in numbers(kind, place)}
            assert listed == set(range(1, count + 1)), (key, kind)


def numbers(kind: str, place: str) -> set[int]:
    """Numbers of ``Eq. 1-3, 5, Fig. 2``."""
    listed = set()
    for part in re.findall(rf"{re.escape(kind)} ((?:\d+(?:-\d+)?(?:, )?)+)", place):
        for ends in re.findall(r"(\d+)(?:-(\d+))?", part):
            first, last = (int(end) for end in (ends[0], ends[1] or ends[0]))
            listed |= set(range(first, last + 1))
    return listed


def test_a_row_that_lacks_its_place_says_why_and_has_no_command() -> None:
    lacking = [row for row in ROWS if row[2] == "-"]
    assert len(lacking) > 5
    assert [row for row in lacking if not row[4].startswith("lacks: ")] == []
    assert [row for row in ROWS if row not in lacking and "lacks" in row[4]] == []
