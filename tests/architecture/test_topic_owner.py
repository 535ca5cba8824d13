"""Each topic of the log, of the exports and of the observers' line is typed once in the library."""

import ast
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

from snakewalk.controller.exchange import foxglove_scene, ros_messages
from snakewalk.controller.runlog import row_line
from snakewalk.controller.runlog.topics import TABLES

pytestmark = pytest.mark.costs("reads every source file")

ROOT = Path(__file__).resolve().parents[2]


def texts(tree: ast.AST) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.value


def repeated(sources: dict[str, str]) -> set[str]:
    """Topics that are typed more than once in the library."""
    names = {table.topic.name for table in TABLES}
    for module in (foxglove_scene, ros_messages, row_line):
        names |= {
            value
            for key, value in vars(module).items()
            if key.isupper() and isinstance(value, str) and value.startswith("/")
        }
    found = Counter(
        text for source in sources.values() for text in texts(ast.parse(source)) if text in names
    )
    assert names == set(found), "each is typed somewhere"
    return {name for name, count in found.items() if count > 1}


@pytest.fixture(scope="module")
def library() -> dict[str, str]:
    return {
        str(file): file.read_text(encoding="utf-8")
        for top in ("config", "drivers", "sim", "controller")
        for file in (ROOT / top).rglob("*.py")
    }


def test_no_topic_is_typed_a_second_time(library: dict[str, str]) -> None:
    assert repeated(library) == set()


def test_a_second_copy_is_found(library: dict[str, str]) -> None:
    planted = library | {"copy.py": 'rows = {"/friction": []}'}
    assert repeated(planted) == {"/friction"}
