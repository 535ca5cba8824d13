"""Sentences of pages, help texts, messages and docstrings, and names."""

import ast
import inspect
import re
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any, Final

import typer

from tests.architecture.tokens import TOKEN
from tests.helpers.library import library

ROOT = Path(__file__).resolve().parents[2]
NAMES: Final = "names"
"""The kind of text that has no sentences."""
NOT_PROSE = ("CHANGELOG.md", "docs/decisions/")
"""Pages whose text is history."""


def sentences(text: str) -> list[str]:
    """Sentences of one paragraph, without code spans and link targets."""
    plain = re.sub(r"`[^`]*`", "CODE", re.sub(r"\]\([^)]*\)", "]", text))
    plain = re.sub(r"[*_]{1,2}(\S[^*_]*?)[*_]{1,2}", r"\1", " ".join(plain.split()))
    return [part for part in re.split(r"(?<=[.!?])\s+(?=[A-Z*`(\[])", plain) if part]


def page_paragraphs(text: str) -> Iterator[str]:
    """Paragraphs, list items, headings and table cells of a Markdown page, without code blocks."""
    text = re.sub(r"^(```|~~~).*?^\1", "", text, flags=re.MULTILINE | re.DOTALL)
    text = re.sub(r"^\|[ :|-]+\|$", "", text, flags=re.MULTILINE)
    block: list[str] = []
    for line in [*text.splitlines(), ""]:
        starts = re.match(r"\s*(?:[-*] |\d+\. |#+ |>|\|)", line)
        if starts or not line.strip() or line.startswith("    "):
            if block:
                yield " ".join(block)
            block = []
        if line.startswith("    ") and not starts:
            continue
        if line.startswith("|"):
            yield from (cell.strip() for cell in line.strip("|").split("|"))
        elif line.strip():
            block.append(line.strip().lstrip("#->* "))


def pages() -> Iterator[tuple[str, str]]:
    """Place and paragraph of the README, CONTRIBUTING and every page of the site."""
    files = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
    for file in files:
        name = file.relative_to(ROOT).as_posix()
        if not name.startswith(NOT_PROSE):
            for paragraph in page_paragraphs(file.read_text(encoding="utf-8")):
                yield name, paragraph


def docstring_paragraphs(text: str) -> Iterator[str]:
    """Paragraphs and list items of a docstring, without code blocks and names of arguments."""
    block: list[str] = []
    section = None
    for line in [*inspect.cleandoc(text).splitlines(), ""]:
        indent = len(line) - len(line.lstrip())
        heading = re.fullmatch(r"\s*(Args|Attributes|Raises|Returns|Yields):", line)
        if heading:
            section = indent + 4
        elif line.strip() and section is not None and indent < section:
            section = None
        named = re.match(r"\s*[*\w.]+(?:, [*\w.]+)*: ", line) if indent == section else None
        starts = named or re.match(r"\s*(?:[-*]|\d+\.) ", line)
        if heading or starts or not line.strip():
            if block:
                yield " ".join(block)
            block = []
        is_code = indent >= 4 and section is None and not block and not starts
        if line.strip() and not heading and not is_code:
            block.append(line[starts.end() :].strip() if starts else line.strip())


def docstring_texts() -> Iterator[tuple[str, str]]:
    """Place and text of docstrings and strings below attributes."""
    for name, _, _, nodes in library():
        for node in nodes:
            value = node.value if isinstance(node, ast.Expr) else None
            if isinstance(value, ast.Constant) and isinstance(value.value, str):
                yield f"{name}:{value.lineno}", value.value


def docstrings() -> Iterator[tuple[str, str]]:
    """Place and paragraph of docstrings, strings below attributes, and comments."""
    for place, text in docstring_texts():
        for paragraph in docstring_paragraphs(text):
            yield place, paragraph
    for name, source, _, _ in library():
        for token in TOKEN.finditer(source):
            if token.lastgroup == "comment" and "noqa" not in token[0]:
                line = source.count("\n", 0, token.start()) + 1
                yield f"{name}:{line}", token[0].lstrip("#: ")


def messages() -> Iterator[tuple[str, str]]:
    """Place and text of the other strings of the library that have four words or more."""
    for name, _, _, nodes in library():
        skipped = {id(node.value) for node in nodes if isinstance(node, ast.Expr)}
        for node in nodes:
            if isinstance(node, ast.JoinedStr):
                skipped |= {id(part) for part in node.values}
        for node in nodes:
            if id(node) in skipped:
                continue
            if isinstance(node, ast.JoinedStr):
                text = "".join(
                    str(part.value) if isinstance(part, ast.Constant) else "VALUE"
                    for part in node.values
                )
            elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                text = node.value
            else:
                continue
            if len(re.findall(r"\b[a-z]{2,}\b", text)) > 3 and "\n" not in text.strip():
                yield f"{name}:{node.lineno}", " ".join(text.split())


def help_texts() -> Iterator[tuple[str, str]]:
    """Command and text of every help, argument and option."""
    from snakewalk.controller.cli.command_line import app

    def walk(command: Any, words: str) -> Iterator[tuple[str, str]]:
        for paragraph in re.split(r"\n\s*\n", command.help or ""):
            yield words, " ".join(paragraph.split())
        for parameter in command.params:
            if text := getattr(parameter, "help", None):
                yield f"{words} {parameter.name}", text
        if hasattr(command, "list_commands"):
            context = command.make_context(words, [], resilient_parsing=True)
            for name in command.list_commands(context):
                yield from walk(command.get_command(context, name), f"{words} {name}")

    yield from walk(typer.main.get_command(app), "snakewalk")


def names() -> Iterator[tuple[str, str]]:
    """Place and name of every variable, parameter, function, class and field that is bound."""
    for module, _, _, nodes in library():
        for node in nodes:
            if isinstance(node, ast.Name | ast.Attribute) and isinstance(node.ctx, ast.Store):
                name = node.id if isinstance(node, ast.Name) else node.attr
            elif isinstance(node, ast.arg):
                name = node.arg
            elif isinstance(
                node,
                ast.FunctionDef
                | ast.AsyncFunctionDef
                | ast.ClassDef
                | ast.ExceptHandler
                | ast.MatchAs,
            ):
                name = node.name or ""
            else:
                continue
            if name.strip("_"):
                yield f"{module}:{node.lineno}", name


KINDS: Final[dict[str, Callable[[], Iterator[tuple[str, str]]]]] = {
    "pages": pages,
    "help": help_texts,
    "messages": messages,
    "docstrings": docstrings,
}


@cache
def read(kind: str) -> tuple[tuple[str, str], ...]:
    """Place and sentence of all texts of a kind; a name is one sentence."""
    if kind == NAMES:
        return tuple(names())
    return tuple((place, sentence) for place, text in KINDS[kind]() for sentence in sentences(text))
