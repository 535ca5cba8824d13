"""Each topic of the log, of the exports and of the observers' line is typed once in the library."""

import ast
from collections import Counter
from collections.abc import Iterable, Iterator

import pytest

from snakewalk.controller.exchange import foxglove_scene, ros_messages
from snakewalk.controller.runlog import row_line
from snakewalk.controller.runlog.topics import TABLES
from tests.helpers.library import library

pytestmark = pytest.mark.costs("reads every source file")


def texts(nodes: Iterable[ast.AST]) -> Iterator[str]:
    for node in nodes:
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.value


def repeated(texts_of_library: list[str]) -> set[str]:
    """Topics that are typed more than once in the library."""
    names = {table.topic.name for table in TABLES}
    for module in (foxglove_scene, ros_messages, row_line):
        names |= {
            value
            for key, value in vars(module).items()
            if key.isupper() and isinstance(value, str) and value.startswith("/")
        }
    found = Counter(text for text in texts_of_library if text in names)
    assert names == set(found), "each is typed somewhere"
    return {name for name, count in found.items() if count > 1}


@pytest.fixture(scope="module")
def typed() -> list[str]:
    return [text for module in library() for text in texts(module.nodes)]


def test_no_topic_is_typed_a_second_time(typed: list[str]) -> None:
    assert repeated(typed) == set()


def test_a_second_copy_is_found(typed: list[str]) -> None:
    planted = texts(ast.walk(ast.parse('rows = {"/friction": []}')))
    assert repeated([*typed, *planted]) == {"/friction"}
