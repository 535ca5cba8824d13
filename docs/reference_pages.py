"""Generated parts of pages: options and former names of commands, and topics of a log.

A page has a line ``<!-- commands: WORDS -->``, ``<!-- former names -->`` or ``<!-- topics -->``;
each build puts the tables in its place.
"""

import re
from collections.abc import Iterator
from typing import Any

import typer
from sphinx.application import Sphinx

from snakewalk.controller.cli.command_line import FORMER
from snakewalk.controller.cli.command_line import app as program
from snakewalk.controller.runlog import topics
from snakewalk.controller.runlog.column import Column, registered_tables

PLACE = re.compile(r"^<!-- (commands|former names|topics)(?:: (.*?))? -->$", re.MULTILINE)
PAGES = [
    "commands",
    "reference/commands-every-day",
    "reference/commands-gait",
    "reference/commands-log",
    "reference/commands-robot",
    "reference/commands-animal",
    "reference/log-topics",
]


def cell(text: object) -> str:
    """Return a text for a cell of a table."""
    return " ".join(str(text).split()).replace("|", "\\|").replace("<", "&lt;")


def leaves(command: Any, words: str) -> Iterator[tuple[str, Any]]:
    """Yield the words and the command of each command below a family."""
    if not hasattr(command, "list_commands"):
        yield words, command
        return
    context = command.make_context(words, [], resilient_parsing=True)
    for name in command.list_commands(context):
        yield from leaves(command.get_command(context, name), f"{words} {name}")


def option_row(option: Any, context: Any) -> str:
    """Return the row of an argument or an option."""
    value = option.metavar or option.display_type(context)
    if option.param_type_name == "argument":
        name = f"`{option.metavar or option.name}`"
        value = "" if option.metavar else value
    else:
        name = ", ".join(f"`{each}`" for each in [*option.opts, *option.secondary_opts])
        value = "" if option.is_flag else value
    default = "required" if option.required else option.default
    if default in (None, False, (), []) or callable(default):
        default = ""
    shown = f"`{value}`".replace("|", "\\|") if value else ""
    return f"| {name} | {shown} | {cell(option.help or '')} | {cell(default)} |"


def commands(firsts: str) -> str:
    """Return a section with options and examples for each command with one of the first words."""
    root = typer.main.get_command(program)
    context = root.make_context("snakewalk", [], resilient_parsing=True)
    parts = []
    for first in firsts.split():
        top = root.get_command(context, first)  # type: ignore[attr-defined]
        if top is None:
            raise ValueError(f"commands: {first}: no such command")
        for words, command in leaves(top, f"snakewalk {first}"):
            rows = [
                option_row(each, context)
                for each in command.params
                if not each.hidden and each.name != "help" and each.rich_help_panel != "Messages"
            ]
            examples = re.findall(r"\[bold\](.*?)\[/bold\]", command.epilog or "")
            parts += [
                f"## {words}",
                (command.help or "").strip(),
                "\n".join(
                    ["| name | value | meaning | default |", "| --- | --- | --- | --- |", *rows]
                ),
                "\n".join(["```", *examples, "```"]),
            ]
    return "\n\n".join(parts)


def former_names() -> str:
    """Return a table of the former names of commands."""
    rows = [f"| `snakewalk {old}` | `snakewalk {new}` |" for old, new in FORMER.items()]
    return "\n".join(["| former name | name |", "| --- | --- |", *rows])


def shape_of(column: Column) -> str:
    """Return the shape of a row's value."""
    return ", ".join(str(size) for size in column.shape) or "one"


def topic_tables() -> str:
    """Return a section with the fields of each topic of a log."""
    parts = [f"Version of the format: {topics.FORMAT}."]
    for table in registered_tables():
        rows = [
            f"| `{name}` | {column.kind} | {shape_of(column)} | {cell(column.description)} |"
            for name, column in table.topic.columns.items()
        ]
        parts += [
            f"## {table.topic.name}",
            " ".join((table.__doc__ or "").split("\n\n")[0].split()),
            "\n".join(["| field | kind | shape | content |", "| --- | --- | --- | --- |", *rows]),
        ]
    return "\n\n".join(parts)


def fill(app: Sphinx, name: str, source: list[str]) -> None:
    """Put the tables in the places of a page."""

    def made(place: re.Match[str]) -> str:
        if place[1] == "commands":
            return commands(place[2])
        return topic_tables() if place[1] == "topics" else former_names()

    source[0] = PLACE.sub(made, source[0])


def outdated(app: Sphinx, *rest: object) -> list[str]:
    """Return the pages whose content depends on the code."""
    return PAGES


def setup(app: Sphinx) -> dict[str, bool]:
    """Take part in the reading of each page."""
    app.connect("source-read", fill, priority=400)
    app.connect("env-get-outdated", outdated)
    return {"parallel_read_safe": True}
