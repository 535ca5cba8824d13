"""Source files of the packages and of the tests, and the imports between them."""

import ast
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import networkx as nx

from tests.architecture.layout import TOPS
from tests.helpers.library import library

ROOT = Path(__file__).resolve().parents[2]


@dataclass(frozen=True)
class Source:
    """What a file says, of what these tests ask."""

    imported: set[str]
    """Modules and names of ours, and of tests, that it imports, without ``snakewalk``."""
    defined: list[tuple[str, int]]
    """Classes, functions, parameters and attributes, with their lines."""
    classes: list[str]
    """On the file's top level."""


def read_source(text: str) -> Source:
    """Return what the text of a file says."""
    tree = ast.parse(text)
    return read_tree(tree, ast.walk(tree))


def read_tree(tree: ast.Module, nodes: Iterable[ast.AST]) -> Source:
    """Return what a file says, by its syntax tree and all nodes of it."""
    names: set[str] = set()
    defined: list[tuple[str, int]] = []
    for node in nodes:
        match node:
            case ast.Import():
                names |= {alias.name for alias in node.names}
            case ast.ImportFrom():
                assert node.level == 0, "imports are absolute"
                names |= {f"{node.module}.{alias.name}" for alias in node.names}
            case ast.FunctionDef(name=name) | ast.ClassDef(name=name) | ast.arg(arg=name):
                defined.append((name, node.lineno))
            case ast.Attribute(attr=name, ctx=ast.Store()):
                defined.append((name, node.lineno))
            case ast.AnnAssign(target=ast.Name(id=name)):
                defined.append((name, node.lineno))
    bare = {name for name in names if name.split(".")[0] in TOPS}
    assert not bare, f"top folders are imported as snakewalk.*: {bare}"
    ours = {name.removeprefix("snakewalk.") for name in names if name.startswith("snakewalk.")}
    others = {name for name in names if name.split(".")[0] in {"tests", "dynamixel_sdk"}}
    classes = [node.name for node in tree.body if isinstance(node, ast.ClassDef)]
    return Source(ours | others, defined, classes)


def _dotted(path: str) -> str:
    return path.removesuffix(".py").replace("/", ".").removesuffix(".__init__")


@cache
def read_folder(top: str) -> Mapping[str, Source]:
    """Every module of a folder that is not of the library (dotted)."""
    return {
        _dotted(file.relative_to(ROOT).as_posix()): read_source(file.read_text(encoding="utf-8"))
        for file in sorted((ROOT / top).rglob("*.py"))
    }


@cache
def sources() -> Mapping[str, Source]:
    """Every module of the packages (dotted, without ``snakewalk``), read once for all tests."""
    return {_dotted(file.name): read_tree(file.tree, file.nodes) for file in library()}


def module_of(name: str, known: Iterable[str]) -> str | None:
    """Return the module that an imported name lives in."""
    return name if name in known else name.rpartition(".")[0] or None


def module_imports(ours: Mapping[str, Source]) -> nx.DiGraph:
    """Return the imports from module to module."""
    return nx.DiGraph(
        (m, to)
        for m, source in ours.items()
        for name in source.imported
        if (to := module_of(name, ours)) in ours and to != m
    )
