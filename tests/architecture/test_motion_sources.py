"""One base class passes on what a wrapped motion source reports."""

import ast
from collections import Counter
from collections.abc import Iterable

import pytest

from tests.helpers.library import library

pytestmark = pytest.mark.costs("reads every source file")

PROPERTIES = ("needs", "done")
METHODS = ("goal_rad", "velocity_rad_s", "pace")
BASE = "MotionWrapper"


def forwarded(method: ast.FunctionDef) -> str | None:
    """Return the attribute of ``self`` to which a method only passes the call on, or None."""
    body = [each for each in method.body if not isinstance(each, ast.Expr)]
    match body:
        case [ast.Return(value=ast.Call(func=ast.Attribute() as target, args=[], keywords=[]))]:
            is_property = False
        case [ast.Return(value=ast.Attribute() as target)]:
            is_property = True
        case _:
            return None
    names = PROPERTIES if is_property else METHODS
    match target:
        case ast.Attribute(
            value=ast.Attribute(value=ast.Name(id="self"), attr=attribute), attr=name
        ) if name == method.name and name in names:
            return attribute
    return None


def by_hand(nodes: Iterable[ast.AST]) -> list[str]:
    """Return the classes that forward two or more of the five to one attribute."""
    found = []
    for node in nodes:
        if not isinstance(node, ast.ClassDef) or node.name == BASE:
            continue
        methods = [each for each in node.body if isinstance(each, ast.FunctionDef)]
        counts = Counter(to for method in methods if (to := forwarded(method)) is not None)
        if any(count >= 2 for count in counts.values()):
            found.append(node.name)
    return found


def test_no_class_forwards_a_motion_source_by_hand() -> None:
    found = {module.name: names for module in library() if (names := by_hand(module.nodes))}
    assert found == {}, f"derive these classes from {BASE}"


def test_a_planted_copy_is_found() -> None:
    planted = '''
class Copy:
    @property
    def needs(self):
        """Those of the motion."""
        return self._motion.needs

    def goal_rad(self):
        """(J,)"""
        return self._motion.goal_rad()
'''
    assert by_hand(ast.walk(ast.parse(planted))) == ["Copy"]
    assert by_hand(ast.walk(ast.parse(planted.replace("Copy", BASE)))) == []
