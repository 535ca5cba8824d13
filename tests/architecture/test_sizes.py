"""Limits on packages, signatures and imports inside functions; long files are told as warnings."""

import ast
import re
import warnings
from collections import Counter
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Final

import pytest

from tests.architecture.layout import TOPS

pytestmark = pytest.mark.costs("reads every source file")

ROOT: Final = Path(__file__).resolve().parents[2]
PACKAGE_SHARE: Final = 0.20
FILE_LINES: Final = 500
FUNCTION_LINES: Final = 80
"""Longer files and functions are listed as warnings: code that is packed reads no better."""
PARAMETERS: Final = 12
FUNCTION_IMPORTS: Final = 69
"""Imports inside functions that may be left, each with its reason."""
NOQA: Final = re.compile(r"# noqa: (?:\w+, )*PLC0415  (\S.+)$")

KERNELS: Final[dict[str, str]] = {
    "controller/gaits/cpg/trajectory.py:_evaluate": "arrays are made once, outside of its loop",
    "controller/gaits/cpg/trajectory.py:peak_share": "a numba signature knows no records",
    "controller/mechanics/ground_step.py:_place": "a numba signature knows no records",
    "controller/mechanics/rollout_kernel.py:roll_pieces": "its arrays are the state of all pieces",
    "controller/repertoire/crowd.py:_step": "a slice per body costs more than its arithmetic",
    "controller/studies/identification/pendulum_swing.py:_swing": "a signature of numba",
    "drivers/safety/vet.py:_quick_check": "runs in each cycle on plain arrays",
    "sim/batch/kernels.py:move_links": "a kernel of Warp accepts arrays alone",
    "sim/batch/kernels.py:rub": "a kernel of Warp accepts arrays alone",
    "sim/batch/kernels.py:turn_motors": "a kernel of Warp accepts arrays alone",
    "sim/servo/bench.py:_step": "a numba signature knows no records",
    "sim/servo/control_loops.py:_run_position": "a numba signature knows no records",
}
"""Compiled loops (file:function) that exceed the limit, each with its reason."""


def files() -> Iterator[Path]:
    for top in TOPS:
        yield from sorted((ROOT / top).rglob("*.py"))


def name(file: Path) -> str:
    return file.relative_to(ROOT).as_posix()


def text(file: Path) -> str:
    return file.read_text(encoding="utf-8")


@cache
def functions(source: str) -> list[tuple[str, int, int]]:
    """Return name, lines and parameters of each function; ``self`` and ``cls`` do not count."""
    found = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            given = node.args
            named = [*given.posonlyargs, *given.args, *given.kwonlyargs]
            count = sum(each.arg not in {"self", "cls"} for each in named)
            assert node.end_lineno is not None
            found.append((node.name, node.end_lineno - node.lineno + 1, count))
    return found


def wide(source: str) -> list[str]:
    """Return the functions with too many parameters."""
    return [function for function, _, parameters in functions(source) if parameters > PARAMETERS]


def long(place: str, source: str) -> Iterator[str]:
    """Yield what is longer than a reader likes, with its length."""
    if (lines := len(source.splitlines())) > FILE_LINES:
        yield f"{place}: {lines} lines"
    for function, lines, _ in functions(source):
        if lines > FUNCTION_LINES:
            yield f"{place}:{function}: {lines} lines"


def function_imports(source: str) -> list[tuple[int, str]]:
    """Return line and reason of each import inside a function; an empty reason is missing."""
    lines, found = source.splitlines(), {}
    for function in ast.walk(ast.parse(source)):
        if isinstance(function, ast.FunctionDef | ast.AsyncFunctionDef):
            for node in ast.walk(function):
                if isinstance(node, ast.Import | ast.ImportFrom):
                    stated = NOQA.search(lines[node.lineno - 1])
                    found[node.lineno] = "" if stated is None else stated[1]
    return sorted(found.items())


def test_no_package_holds_over_a_fifth_of_the_library() -> None:
    lines: Counter[str] = Counter()
    for file in files():
        parts = file.relative_to(ROOT).parts
        lines[".".join(parts[:2]) if len(parts) > 2 else parts[0]] += len(text(file).splitlines())
    crowded = {package: count / lines.total() for package, count in lines.items()}
    assert {p: round(s, 3) for p, s in crowded.items() if s > PACKAGE_SHARE} == {}


def test_long_files_and_functions_are_warnings() -> None:
    for file in files():
        for found in long(name(file), text(file)):
            warnings.warn(found, stacklevel=1)


def test_no_function_has_too_many_parameters() -> None:
    found = {
        f"{name(file)}:{function}"
        for file in files()
        if file.parent.name != "commands"
        for function in wide(text(file))
    }
    assert found - set(KERNELS) == set()
    assert set(KERNELS) <= found, "an exempted loop is within the limit: remove it from the list"


@pytest.mark.parametrize("kernel", KERNELS)
def test_only_compiled_loops_are_exempt(kernel: str) -> None:
    path, function = kernel.split(":")
    for node in ast.walk(ast.parse(text(ROOT / path))):
        if isinstance(node, ast.FunctionDef) and node.name == function:
            decorators = {ast.unparse(each).split("(")[0] for each in node.decorator_list}
            assert decorators & {"compiled", "njit", "inlined", "wp.kernel"}
            return
    pytest.fail(f"{kernel}: there is no such function")


def test_few_imports_inside_functions_and_each_has_a_reason() -> None:
    found = {
        f"{name(file)}:{line}": reason
        for file in files()
        for line, reason in function_imports(text(file))
    }
    assert [place for place, reason in found.items() if not reason] == []
    assert len(found) <= FUNCTION_IMPORTS


def test_planted_excesses_are_found() -> None:
    body = "\n".join(f"    x{k} = {k}" for k in range(FUNCTION_LINES))
    assert list(long("a.py", f"def f():\n{body}\n")) == [f"a.py:f: {FUNCTION_LINES + 1} lines"]
    many = ", ".join(f"p{k}" for k in range(PARAMETERS + 1))
    assert wide(f"def wide({many}):\n    pass\n") == ["wide"]
    assert wide(f"def method(self, {many[4:]}):\n    pass\n") == []
    lazy = "def f():\n    import av  # noqa: PLC0415  an extra\n    import cv2  # noqa: PLC0415\n"
    assert function_imports(lazy) == [(2, "an extra"), (3, "")]
