"""A file begins with its public class or function; private helpers follow where Python allows."""

import ast
from collections.abc import Iterator, Sequence
from typing import Final

import pytest

from tests.helpers.library import library

Definition = ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef
COMPILED: Final = ("compiled", "inlined", "njit", "wp.kernel", "wp.func", "overload", "intrinsic")
"""Decorators that read the body of a function, and so the helpers that it calls, at the import."""


def evaluated(node: ast.AST) -> Iterator[ast.AST]:
    """Yield the nodes of a statement that an import evaluates: no bodies of plain functions."""
    if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
        decorators = [ast.unparse(decorator) for decorator in node.decorator_list]
        if not any(text.startswith(COMPILED) for text in decorators):
            arguments = node.args
            defaults = [*arguments.defaults, *(d for d in arguments.kw_defaults if d is not None)]
            every = [*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs]
            every += [a for a in (arguments.vararg, arguments.kwarg) if a is not None]
            hints = [a.annotation for a in every if a.annotation is not None]
            hints += [node.returns] if node.returns is not None else []
            for part in (*node.decorator_list, *defaults, *hints):
                yield from ast.walk(part)
            return
    if isinstance(node, ast.Lambda):
        return
    yield node
    for child in ast.iter_child_nodes(node):
        yield from evaluated(child)


def names_in(statements: Sequence[ast.stmt]) -> set[str]:
    """Names that the import of these statements evaluates."""
    nodes = [node for statement in statements for node in evaluated(statement)]
    return {node.id for node in nodes if isinstance(node, ast.Name)}


def movable(body: list[ast.stmt]) -> list[str]:
    """Names of the private definitions that could follow the first public one."""
    places = [k for k, node in enumerate(body) if isinstance(node, Definition)]
    public = [k for k in places if not body[k].name.startswith("_")]  # type: ignore[attr-defined]
    if not public:
        return []
    found: list[str] = []
    for k in reversed([k for k in places if k < public[0]]):
        name = body[k].name  # type: ignore[attr-defined]
        stays = [node for node in body[k + 1 : public[0] + 1] if node_name(node) not in found]
        if name not in names_in(stays):
            found.insert(0, name)
    return found


def node_name(node: ast.stmt) -> str | None:
    """Name of a definition."""
    return node.name if isinstance(node, Definition) else None


def test_private_helpers_follow_the_first_public_definition() -> None:
    early = {module.name: movable(module.tree.body) for module in library()}
    assert not {name: helpers for name, helpers in early.items() if helpers}


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ("def _a(): ...\ndef b(): return _a()", ["_a"]),
        ("class _A: ...\nclass B(_A): ...", []),
        ("class _A: ...\ndef b(x: _A): ...", []),
        ("class _A: ...\ndef b(x: '_A'): ...", ["_A"]),
        ("@njit\ndef _a(): ...\n@njit\ndef b(): return _a()", []),
        ("def b(): ...\ndef _a(): ...", []),
        ("class _A: ...\ndef _a(x: _A): ...\ndef b(): ...", ["_A", "_a"]),
    ],
)
def test_only_what_an_import_needs_comes_first(source: str, expected: list[str]) -> None:
    assert movable(ast.parse(source).body) == expected
