"""Declaration of a command: its words and examples, also read without an import.

``declaration`` reads a command without importing the modules that its body uses.

``--help``, completion and the check of options need only a command's signature, docstring and
``@command``. Importing its module costs seconds. So this module evaluates only the statements that
the declaration needs. The whole module is imported when the command runs.
"""

import ast
import importlib.util
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

F = TypeVar("F", bound=Callable[..., object])
T = TypeVar("T")

_ATTRIBUTE = "snakewalk_command"


@dataclass(frozen=True, slots=True)
class CommandInfo:
    """Words and examples of a command."""

    words: str
    """Words of the command: ``plan``, or ``bus serve`` for a command below a subject."""
    examples: tuple[str, ...]
    """Command lines without the leading ``snakewalk``."""
    results: tuple[str, ...] = ()
    """Options that name files of results; ``--force`` overwrites them."""
    tables: tuple[str, ...] = ()
    """Options that name tables to which the command appends rows."""


def command(
    words: str,
    *,
    examples: tuple[str, ...] = (),
    results: tuple[str, ...] = (),
    tables: tuple[str, ...] = (),
) -> Callable[[F], F]:
    """Declare a function as a command; ``python -m tests.architecture.manifests`` lists it.

    The files of ``results`` and ``tables`` are checked before its module is imported.
    """

    def declare(function: F) -> F:
        setattr(function, _ATTRIBUTE, CommandInfo(words, examples, results, tables))
        return function

    return declare


def command_info(function: Callable[..., object]) -> CommandInfo:
    """Return the declaration of a command's function."""
    info = getattr(function, _ATTRIBUTE)
    assert isinstance(info, CommandInfo)
    return info


def plugin(kind: str, name: str) -> Callable[[T], T]:
    """Declare an object as a plug-in of a kind of ``console.plugins.KINDS``."""
    assert kind
    assert name
    return lambda target: target


_COMMANDS = ".commands."
"""Part of the name of each module that holds a command, or options of several commands."""


def declaration(target: str) -> Callable[..., Any] | None:
    """Function with the signature, docstring and declaration of a command; do not call it.

    ``target`` is ``module:function``. Returns None if the module's source is not available.
    """
    module, _, name = target.partition(":")
    names = _names(module, {name}, is_declared=True)
    return None if names is None else names[name]


def _names(module: str, names: set[str], *, is_declared: bool = False) -> dict[str, Any] | None:
    """Names of a module's namespace, after the statements that they need.

    ``is_declared`` omits the bodies of the named functions.
    """
    spec = importlib.util.find_spec(module)
    file = Path("" if spec is None or spec.origin is None else spec.origin)
    if file.suffix != ".py" or not file.is_file():
        return None
    tree = ast.parse(file.read_text(encoding="utf-8"))
    defined = {name: node for node in tree.body for name in _defined_names(node)}
    namespace: dict[str, Any] = {"__name__": module, "__file__": str(file)}
    needed: dict[ast.stmt, set[str]] = {}
    waiting = sorted(names)
    while waiting:
        name = waiting.pop()
        node = defined.get(name)
        if node is None:  # a builtin
            continue
        if is_declared and name in names and isinstance(node, ast.FunctionDef):
            node.body = [ast.Expr(ast.Constant(ast.get_docstring(node, clean=False)))]
        if node not in needed:
            waiting += _used_names(node)
        needed.setdefault(node, set()).add(name)
    for node in sorted(needed, key=lambda import_node: import_node.lineno):
        namespace |= _imported_names(node, needed[node])
        if not isinstance(node, ast.Import | ast.ImportFrom):
            code = ast.fix_missing_locations(ast.Module([node], []))
            exec(compile(code, str(file), "exec"), namespace)
    return namespace


def _imported_names(node: ast.stmt, names: set[str]) -> dict[str, Any]:
    namespace: dict[str, Any] = {}
    if isinstance(node, ast.ImportFrom):
        needed = [alias for alias in node.names if (alias.asname or alias.name) in names]
        values = None
        if _COMMANDS in (node.module or ""):
            values = _names(node.module or "", {alias.name for alias in needed})
        if values is not None:
            return {alias.asname or alias.name: values[alias.name] for alias in needed}
        node = ast.ImportFrom(node.module, needed, node.level)
    if isinstance(node, ast.Import | ast.ImportFrom):
        code = ast.fix_missing_locations(ast.Module([node], []))
        exec(compile(code, "<imports of a command>", "exec"), namespace)
        namespace.pop("__builtins__", None)
    return namespace


def _defined_names(node: ast.stmt) -> Iterator[str]:
    """Yield the names that a statement of a module defines."""
    if isinstance(node, ast.Import | ast.ImportFrom):
        for alias in node.names:
            yield alias.asname or alias.name.partition(".")[0]
    elif isinstance(node, ast.FunctionDef | ast.ClassDef):
        yield node.name
    elif isinstance(node, ast.Assign | ast.AnnAssign):
        for target in node.targets if isinstance(node, ast.Assign) else [node.target]:
            yield from (
                target_node.id
                for target_node in ast.walk(target)
                if isinstance(target_node, ast.Name)
            )


def _used_names(node: ast.stmt) -> set[str]:
    return {
        used_node.id
        for used_node in ast.walk(node)
        if isinstance(used_node, ast.Name) and isinstance(used_node.ctx, ast.Load)
    }
