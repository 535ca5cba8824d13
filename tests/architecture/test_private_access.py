"""Tests use private names and patches no more often than before."""

import ast
from pathlib import Path
from typing import Final

import pytest

from tests.architecture.imports import ROOT

pytestmark = pytest.mark.costs("reads every test file")

MOST_PRIVATE: Final = 341
"""Imports and attributes with a leading underscore; lower it if the count falls."""
MOST_PATCHES: Final = 215
"""Calls that replace a name while a test runs; lower it if the count falls."""
PUBLIC: Final = {"_replace", "_asdict", "_fields", "_make", "_exit", "_getframe"}
"""Names of the standard library that are public in spite of their underscore."""
PATCHES: Final = {"setattr", "delattr", "patch", "object", "spy"}
PATCHERS: Final = {"monkeypatch", "mocker", "patch", "patched", "gone"}


def is_private(name: str) -> bool:
    return name.startswith("_") and not name.startswith("__") and name not in PUBLIC


def private_accesses(tree: ast.AST) -> int:
    """Return how often a file reads a private name that is not its own object's."""
    count = 0
    for node in ast.walk(tree):
        match node:
            case ast.ImportFrom(module=str(module), names=names) if module.startswith("snakewalk"):
                count += sum(is_private(alias.name) for alias in names)
            case ast.Attribute(value=ast.Name(id="self" | "cls")):
                pass
            case ast.Attribute(attr=name):
                count += is_private(name)
    return count


def patches(tree: ast.AST) -> int:
    """Return the number of calls that replace a name; words of a command line do not count."""
    count = 0
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            words = ast.unparse(node.func).split(".")
            is_patch = words[0] in PATCHERS and words[-1] in PATCHES
            target = ast.unparse(node.args[0]) if is_patch else ""
            is_name = words != ["patch"] or target.startswith("'")
            count += is_patch and is_name and target != "'sys.argv'"
    return count


@pytest.fixture(scope="module")
def trees() -> list[ast.AST]:
    files = sorted(Path(ROOT / "tests").rglob("*.py"))
    return [ast.parse(file.read_text(encoding="utf-8")) for file in files]


def test_private_names_are_read_no_more_often(trees: list[ast.AST]) -> None:
    assert sum(map(private_accesses, trees)) <= MOST_PRIVATE


def test_names_are_replaced_no_more_often(trees: list[ast.AST]) -> None:
    assert sum(map(patches, trees)) <= MOST_PATCHES


def test_planted_ones_are_counted() -> None:
    code = "from snakewalk.sim.x import _one, two\na._b = c._replace(d.__name__)\nself._e = cls._f"
    assert private_accesses(ast.parse(code)) == 2
    code = "monkeypatch.setattr(a, 'b')\nmocker.patch.object(a, 'b')\npatch('c')\nsetattr(a, 'b')"
    assert patches(ast.parse(code)) == 3
    assert patches(ast.parse("monkeypatch.setattr('sys.argv', [])")) == 0
