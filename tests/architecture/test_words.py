"""Names: one class a name, and none of the words that gave way to the field's."""

import ast
from collections import defaultdict
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
_WORDS = """
agenda alive arrivals climb coming_to_rest company debts easing express eyes faint footing
glimpse habit hear heard hillside hottest_c house jam judged laid learn listen look_again loops
most_a nap news occupy oldest orders owe path_laid paths_laid_again put readout relay say
service sins softness sound speak strangers surroundings tell told unlike usable voices wanted
way whole_file wish
"""
RETIRED = frozenset(_WORDS.split())
"""Words of the project's own that stood where the field has a term; docs/glossary.md has the terms.

Not here are words that are also right somewhere: effort and overlay, a verdict and a note of the
log, the turn of a heading, the eye of a snake, the pulse of [PT].
"""


@cache
def trees() -> dict[Path, ast.Module]:
    """Of each file; parsed by the first test, not by every process that collects it."""
    return {
        path.relative_to(ROOT): ast.parse(path.read_text(encoding="utf-8"))
        for top in ("config", "drivers", "sim", "controller")
        for path in sorted((ROOT / top).rglob("*.py"))
    }


def names(tree: ast.Module) -> Iterator[tuple[str, int]]:
    """Classes, functions, parameters and attributes that a file defines, with their lines."""
    for node in ast.walk(tree):
        match node:
            case ast.FunctionDef(name=name) | ast.ClassDef(name=name) | ast.arg(arg=name):
                yield name, node.lineno
            case ast.Attribute(attr=name, ctx=ast.Store()):
                yield name, node.lineno
            case ast.AnnAssign(target=ast.Name(id=name)):
                yield name, node.lineno


def test_no_name_is_a_retired_word() -> None:
    found = [
        f"{path}:{line}: {name}"
        for path, tree in trees().items()
        for name, line in names(tree)
        if name.strip("_").lower() in RETIRED
    ]
    assert not found, "\n".join(found)


def test_no_class_name_is_defined_in_two_files() -> None:
    files: dict[str, set[str]] = defaultdict(set)
    for path, tree in trees().items():
        for node in tree.body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                files[node.name].add(str(path))
    assert not {name: sorted(of) for name, of in files.items() if len(of) > 1}
