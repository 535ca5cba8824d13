"""Defaults that stand twice: ``python -m tests.architecture.defaults`` lists them.

A parameter of a command and a field or a parameter of the code below it have the same name (or the
same with a unit) and the same number or text as their default, each as a literal.
"""

import ast
from collections.abc import Iterator
from typing import Final, NamedTuple

from tests.helpers.library import Module, library

_OTHERS: Final = {
    "animals/commands/people.py:motion": "how a person moves; that of a run moves a robot",
    "bench/commands/bus_serve.py:latency": "of a USB adapter in ms; the other is a camera's in s",
    "exchange/commands/robot_import.py:scale": "of lengths; that of a playback is of angles",
    "mapping/commands/elevation.py:scale": "of a map; that of a playback is of angles",
    "mapping/commands/stereo.py:roll": "of a stereo camera by hand; the other one looks down",
    "mapping/commands/stereo.py:scale": "of a map; that of a playback is of angles",
    "mapping/commands/stereo.py:spacing": "of a measured map; the other is of random ground",
    "mapping/commands/walkthrough.py:spacing": "of a measured map; the other is of random ground",
}
"""Options whose default equals that of another quantity of the same name, and the difference."""


class Default(NamedTuple):
    """A literal default."""

    name: str
    value: object
    place: str


def repeated() -> list[tuple[Default, Default]]:
    """Return the defaults of commands that the code of their package, or a schema, repeats."""
    schemas = [each for file in library("config/") for each in defaults(file)]
    controller = library("controller/")
    packages = {file.name.split("/")[1] for file in controller if _is_command(file)}
    found = []
    for package in sorted(packages):
        files = [file for file in controller if file.name.split("/")[1] == package]
        below = [file for file in files if not _is_command(file)]
        known = [*schemas, *(each for file in below for each in defaults(file))]
        for file in filter(_is_command, files):
            for one in defaults(file):
                same = [other for other in known if _is_same(one, other)]
                key = f"{file.name.removeprefix('controller/')}:{one.name}"
                found += [(one, same[0])] if same and key not in _OTHERS else []
    return found


def _is_command(file: Module) -> bool:
    return file.name.split("/")[-2] == "commands"


def defaults(file: Module) -> Iterator[Default]:
    """Yield the literal defaults of public functions and of fields of classes."""
    place = file.name
    for node in file.nodes:
        if isinstance(node, ast.FunctionDef) and node.name[0] != "_":
            both = [*node.args.posonlyargs, *node.args.args]
            given = [None] * (len(both) - len(node.args.defaults)) + list(node.args.defaults)
            pairs = [*zip(both, given, strict=True)]
            pairs += [*zip(node.args.kwonlyargs, node.args.kw_defaults, strict=True)]
            for argument, value in pairs:
                yield from _literal(argument.arg, value, f"{place}:{argument.lineno}")
        elif isinstance(node, ast.ClassDef):
            for each in node.body:
                if isinstance(each, ast.AnnAssign) and isinstance(each.target, ast.Name):
                    yield from _literal(each.target.id, each.value, f"{place}:{each.lineno}")


def _literal(name: str, node: ast.expr | None, place: str) -> Iterator[Default]:
    if isinstance(node, ast.Call) and node.args:  # Field(0.1, ...), Path("a")
        node = node.args[0]
    if node is None:
        return
    try:
        value = ast.literal_eval(node)
    except ValueError:
        return
    if not isinstance(value, bool) and value not in (None, "", (), {}):
        yield Default(name, value, place)


def _is_same(one: Default, other: Default) -> bool:
    named = other.name == one.name or other.name.startswith(f"{one.name}_")
    return named and type(one.value) is type(other.value) and one.value == other.value


if __name__ == "__main__":
    pairs = repeated()
    for one, other in pairs:
        print(f"{one.place}: {one.name} = {one.value!r}; also {other.place}: {other.name}")
    print(len(pairs))
