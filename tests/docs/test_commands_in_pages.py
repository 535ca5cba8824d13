"""Every command that pages, helps and messages name exists; its options and values are accepted."""

import ast
import re
import shlex
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import typer
from typer.core import TyperGroup
from typer.testing import CliRunner

from snakewalk.controller.cli.command_line import app
from tests.helpers.library import library

pytestmark = pytest.mark.costs("reads the help of every command")

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
COMMAND = re.compile(
    r"^ *(?:\$ |\. \.venv/bin/activate && )?(snakewalk (?:.*\\\n)*.*)$", re.MULTILINE
)


def printed(page: Path) -> list[str]:
    """Command lines in a page's blocks of code, without those of a command that the page adds."""
    text = page.read_text(encoding="utf-8")
    added = [f"snakewalk {words}" for words in re.findall(r'^@command\("([a-z ]+)"', text, re.M)]
    fenced = re.findall(r"^```\w*\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    indented = re.findall(r"(?:^    .*\n)+", text, re.MULTILINE)
    return [
        line.replace("\\\n", " ")
        for block in [*fenced, *indented]
        for line in COMMAND.findall(block)
        if not line.startswith(tuple(added))
        and " [-" not in line  # which options there are, not a command
    ]


LINES = sorted({(page.name, line) for page in PAGES for line in printed(page)})
PROGRAM = typer.main.get_command(app)
UsageError: Any = typer.BadParameter.__base__
CONTEXT = PROGRAM.make_context("snakewalk", [], resilient_parsing=True)


@cache
def subcommand(group: Any, name: str) -> Any:
    """Return a command of a group, which typer makes again in each call."""
    return group.get_command(CONTEXT, name)


FAMILIES = [
    name
    for name in PROGRAM.list_commands(CONTEXT)  # type: ignore[attr-defined]
    if isinstance(PROGRAM.get_command(CONTEXT, name), TyperGroup)  # type: ignore[attr-defined]
]


def shown(*words: str) -> str:
    return CliRunner().invoke(app, [*words], env={"COLUMNS": "300"}).output


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
        command = subcommand(command, name)
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


def named(text: str) -> set[str]:
    """Return the commands that running text names, of up to three words."""
    found = re.findall(r"(?<!import )\bsnakewalk ([a-z][a-z-]*(?: [a-z][a-z-]*){0,2})", text)
    for quoted in re.findall(r"`([^`\n]+)`", text):
        words = quoted.removeprefix("snakewalk ").split()
        if words and words[0] in FAMILIES and len(words) > 1 and re.fullmatch("[a-z]+", words[1]):
            found.append(" ".join(words[:3]))
    return set(found)


def exists(words: str) -> bool:
    """Whether the words begin with a command, or are a family."""
    command: Any = PROGRAM
    for word in words.split():
        if isinstance(command, TyperGroup):
            command = subcommand(command, word)
    return command is not None


def inline(page: Path) -> str:
    """Return the code within the lines of a page."""
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.M | re.S)
    return "\n".join(f"`{each}`" for each in re.findall(r"`([^`\n]+)`", text))


def test_every_command_that_a_page_names_exists() -> None:
    names = {(page.name, words) for page in PAGES for words in named(inline(page))}
    assert len(names) > 100
    assert [each for each in sorted(names) if not exists(each[1])] == []


def options(command: Any) -> set[str]:
    """Return the options of a command, or of all commands of a family."""
    if isinstance(command, TyperGroup):
        names = command.list_commands(CONTEXT)
        return set().union(*(options(subcommand(command, name)) for name in names))
    return {option for each in command.params for option in (*each.opts, *each.secondary_opts)}


def test_every_option_that_a_how_to_names_exists() -> None:
    of_others = {
        "--help",
        "--limiter",
        "--dry-run",
        "--teleop",
    }  # the last: benchmarks, pip, LeRobot
    pages = (ROOT / "docs" / "how-to").glob("*.md")
    names = {
        (page.name, option)
        for page in pages
        for option in re.findall(r"`(--[a-z][a-z-]*)", inline(page))
    }
    assert len(names) > 30
    known = options(PROGRAM) | of_others
    assert [each for each in sorted(names) if each[1] not in known] == []


@pytest.mark.slow
def test_every_command_that_a_help_or_a_message_names_exists() -> None:
    names = {
        (module.name, words)
        for module in library()
        if module.name.startswith("controller/")
        for node in module.nodes
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
        for words in named(node.value)
    }
    assert len(names) > 100
    assert [each for each in sorted(names) if not exists(each[1])] == []


@pytest.mark.parametrize("family", FAMILIES)
def test_the_help_of_a_family_names_its_commands(family: str) -> None:
    group = PROGRAM.get_command(CONTEXT, family)  # type: ignore[attr-defined]
    listed = group.help.partition(": ")[2].removesuffix(".").split(", ")
    assert listed == group.list_commands(CONTEXT)
    assert group.help in " ".join(shown("--help").split())


def test_a_command_that_does_not_exist_is_found() -> None:
    assert named("see `robot compare` and snakewalk pose lens") == {
        "robot compare",
        "pose lens",
    }
    assert not exists("robot compare")
    assert not exists("gait policy compare")
    assert not exists("nosuch")
    assert exists("gait policy run")
    assert exists("run flat-square")


def test_the_pages_print_many_commands_and_a_wrong_one_is_found() -> None:
    assert len(LINES) > 100
    with pytest.raises(UsageError, match="No such option"):
        take("snakewalk plan --nosuch")
    with pytest.raises(UsageError, match="No such command"):
        take("snakewalk nosuch")
    with pytest.raises(UsageError, match="must be at least 1"):
        take("snakewalk plan --beam 0")
