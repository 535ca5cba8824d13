"""Every command that the pages print is one: its command, options and values are taken."""

import re
import shlex
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
import typer
from typer.core import TyperGroup

from snakewalk.controller.cli.command_line import app

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
COMMAND = re.compile(r"^ *(?:\$ )?(snakewalk (?:.*\\\n)*.*)$", re.MULTILINE)


def printed(page: Path) -> list[str]:
    """Command lines in a page's blocks of code, without comments and prompts."""
    text = page.read_text(encoding="utf-8")
    fenced = re.findall(r"^```\w*\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    indented = re.findall(r"(?:^    .*\n)+", text, re.MULTILINE)
    return [
        line.replace("\\\n", " ")
        for block in [*fenced, *indented]
        for line in COMMAND.findall(block)
        if " [-" not in line  # which options there are, not a command
    ]


LINES = sorted({(page.name, line) for page in PAGES for line in printed(page)})
PROGRAM = typer.main.get_command(app)
UsageError: Any = typer.BadParameter.__base__


def take(line: str) -> None:
    """Parse a command line as the program does, and run nothing.

    Raises:
        UsageError: there is no such command or option, or a value is out of its range.

    """
    words = shlex.split(line, comments=True)[1:]
    for end in ("|", ">", "&", "&&"):
        words = words[: words.index(end)] if end in words else words
    command: Any = PROGRAM
    context = command.make_context("snakewalk", [], resilient_parsing=True)
    while isinstance(command, TyperGroup) and words and not words[0].startswith("-"):
        name, *words = words
        command = command.get_command(context, name)
        if command is None:
            raise UsageError(f"No such command {name!r}.")
    with suppress(typer.Exit):  # of --help and --version
        command.make_context(command.name, words, parent=context)


def test_every_printed_command_is_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    wrong = []
    for page, line in LINES:
        try:
            take(line)
        except UsageError as error:
            wrong.append(f"{page}: {line}: {error.format_message()}")
    assert wrong == []


def test_the_pages_print_many_commands_and_a_wrong_one_is_found() -> None:
    assert len(LINES) > 100
    with pytest.raises(UsageError, match="No such option"):
        take("snakewalk plan --nosuch")
    with pytest.raises(UsageError, match="No such command"):
        take("snakewalk nosuch")
    with pytest.raises(UsageError, match="greater than or equal to 0"):
        take("snakewalk plan --physics -1")
