"""Files of the library with their syntax trees, parsed once for all tests of a process."""

import ast
import gc
from functools import cache
from pathlib import Path
from typing import Final, NamedTuple

from tests.architecture.layout import TOPS

ROOT: Final = Path(__file__).resolve().parents[2]


class Module(NamedTuple):
    """A file of the library."""

    name: str
    """Path below the root of the clone."""
    text: str
    tree: ast.Module
    nodes: list[ast.AST]
    """All nodes of the tree."""


def library(below: str = "") -> tuple[Module, ...]:
    """Return every file of the packages, or those below a path, in the order of their names."""
    return tuple(module for module in _modules() if module.name.startswith(below))


@cache
def _modules() -> tuple[Module, ...]:
    modules = []
    for top in TOPS:
        for file in sorted((ROOT / top).rglob("*.py")):
            text = file.read_text(encoding="utf-8")
            tree = ast.parse(text)
            name = file.relative_to(ROOT).as_posix()
            modules.append(Module(name, text, tree, list(ast.walk(tree))))
    gc.freeze()  # the trees stay, so that no cycles need to be sought in them
    return tuple(modules)
