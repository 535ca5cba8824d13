"""All small changes of a source file that should matter to somebody."""

import ast
import copy
from collections.abc import Callable, Iterator
from dataclasses import dataclass

_SWAPS: dict[type[ast.AST], type[ast.AST]] = {
    ast.Lt: ast.LtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.BitOr: ast.BitAnd,
    ast.BitAnd: ast.BitOr,
    ast.LShift: ast.RShift,
    ast.And: ast.Or,
    ast.Or: ast.And,
}
_NAMES = {"min": "max", "max": "min", "any": "all", "all": "any"}
_AROUND = 40
_NOT_CODE = ("annotation", "returns", "decorator_list", "args", "bases", "type_params")
Edit = Callable[[ast.AST], None]


@dataclass(frozen=True)
class Mutant:
    """One change."""

    where: str
    """``function``, or ``Class.function``."""
    before: str
    after: str
    line: int
    tree: ast.Module
    """The whole file, changed; its lines are those of the file."""

    @property
    def name(self) -> str:
        """Stays the same while the line does, wherever it moves to."""
        return f"{self.where}: {self.before} => {self.after}"


def mutants(source: str) -> Iterator[Mutant]:
    """Every mutant of ``source``; docstrings, annotations and messages are left alone."""
    tree = ast.parse(source)
    places = list(_places(tree, ""))
    for where, path in places:
        for edit in _edits(_at(tree, path)):
            changed = copy.deepcopy(tree)
            statement = _statement(changed, path)
            before = ast.unparse(statement)
            edit(_at(changed, path))
            ast.fix_missing_locations(changed)
            after = ast.unparse(_statement(changed, path))
            if before != after:
                yield Mutant(where, *_differ(before, after), statement.lineno, changed)


Path = tuple[tuple[str, int | None], ...]


def _places(node: ast.AST, where: str, path: Path = ()) -> Iterator[tuple[str, Path]]:
    """Paths of all nodes inside functions."""
    if where and not isinstance(node, ast.FunctionDef | ast.ClassDef):
        yield where, path
    for name, value in ast.iter_fields(node):
        if name in _NOT_CODE and not (isinstance(node, ast.Call) and name == "args"):
            continue
        inside = where
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and name == "body":
            inside = f"{where}.{node.name}" if where else node.name
        children = value if isinstance(value, list) else [value]
        for index, child in enumerate(children):
            if isinstance(child, ast.JoinedStr) or not isinstance(child, ast.AST):
                continue
            if isinstance(child, ast.Expr) and isinstance(child.value, ast.Constant):
                continue  # a docstring
            step = (name, index if isinstance(value, list) else None)
            only_class = isinstance(node, ast.ClassDef) and not isinstance(child, ast.FunctionDef)
            if not only_class:
                yield from _places(child, inside, (*path, step))


def _at(tree: ast.AST, path: Path) -> ast.AST:
    node: ast.AST = tree
    for name, index in path:
        value = getattr(node, name)
        node = value if index is None else value[index]
    return node


def _statement(tree: ast.AST, path: Path) -> ast.stmt:
    """The innermost statement around a place."""
    found: ast.stmt | None = None
    for end in range(len(path) + 1):
        node = _at(tree, path[:end])
        if isinstance(node, ast.stmt):
            found = node
    assert found is not None
    return found


def _differ(before: str, after: str) -> tuple[str, ...]:
    """What of a statement differs, with as much around it as tells it apart."""
    before, after = before.splitlines()[0], after.splitlines()[0]
    if len(before) <= 3 * _AROUND:
        return before, after
    start = _common(before, after)
    end = _common(before[start:][::-1], after[start:][::-1])
    first = max(0, start - _AROUND)
    return tuple(text[first : len(text) - max(0, end - _AROUND)] for text in (before, after))


def _common(one: str, other: str) -> int:
    """Length of the common beginning."""
    differ = (k for k, (a, b) in enumerate(zip(one, other, strict=False)) if a != b)
    return next(differ, min(len(one), len(other)))


def _edits(node: ast.AST) -> Iterator[Edit]:
    if isinstance(node, ast.Compare):
        for k, operator in enumerate(node.ops):
            if type(operator) in _SWAPS:
                yield lambda n, k=k, o=operator: n.ops.__setitem__(k, _SWAPS[type(o)]())
    if isinstance(node, ast.BinOp | ast.BoolOp | ast.AugAssign) and type(node.op) in _SWAPS:
        yield lambda n, o=node.op: setattr(n, "op", _SWAPS[type(o)]())
    if isinstance(node, ast.BoolOp):
        for k in range(len(node.values)):
            yield lambda n, k=k: n.values.pop(k)
    if isinstance(node, ast.Constant):
        yield from _constants(node)
    if isinstance(node, ast.Call):
        yield from _calls(node)
    if isinstance(node, ast.If):
        yield lambda n: setattr(n, "test", ast.Constant(False))
        yield lambda n: setattr(n, "test", ast.Constant(True))
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Invert | ast.Not):
        yield lambda n: setattr(n, "op", ast.UAdd())
    if isinstance(node, ast.Continue):
        yield lambda n: setattr(n, "__class__", ast.Break)
    if isinstance(node, ast.Assign | ast.AugAssign) or (
        isinstance(node, ast.Expr) and isinstance(node.value, ast.Call)
    ):
        yield _delete


def _delete(node: ast.AST) -> None:
    """Make a statement do nothing; an assigned name keeps what it had, or is missing."""
    node.__class__ = ast.Pass
    for name in ("targets", "target", "value", "op"):
        node.__dict__.pop(name, None)


def _constants(node: ast.Constant) -> Iterator[Edit]:
    value = node.value
    if isinstance(value, bool):
        yield lambda n: setattr(n, "value", not value)
    elif isinstance(value, int | float):
        yield lambda n: setattr(n, "value", value + 1)
        yield lambda n: setattr(n, "value", value - 1)


def _calls(node: ast.Call) -> Iterator[Edit]:
    function = node.func
    if isinstance(function, ast.Name) and function.id in _NAMES:
        yield lambda n: setattr(n.func, "id", _NAMES[n.func.id])
    if isinstance(function, ast.Attribute) and function.attr in _NAMES:
        yield lambda n: setattr(n.func, "attr", _NAMES[n.func.attr])
    if isinstance(function, ast.Attribute) and function.attr == "clip" and len(node.args) == 3:
        yield lambda n: n.args.__setitem__(1, ast.parse("-np.inf", mode="eval").body)
        yield lambda n: n.args.__setitem__(2, ast.parse("np.inf", mode="eval").body)
