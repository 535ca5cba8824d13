"""Limits on packages, signatures and imports inside functions; long files are told as warnings."""

import ast
import re
import warnings
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Final

import pytest

from tests.helpers.library import library

pytestmark = pytest.mark.costs("reads every source file")

ROOT: Final = Path(__file__).resolve().parents[2]
PACKAGE_SHARE: Final = 0.20
FILE_LINES: Final = 500
FUNCTION_LINES: Final = 80
"""Longer files and functions are listed as warnings: code that is packed reads no better."""
PARAMETERS: Final = 8
FUNCTION_IMPORTS: Final = 71
"""Imports inside functions that may be left, each with its reason."""
NOQA: Final = re.compile(r"# noqa: (?:\w+, )*PLC0415  (\S.+)$")

KERNELS: Final[dict[str, str]] = {
    "controller/gaits/cpg/trajectory.py:_evaluate": "arrays are made once, outside of its loop",
    "controller/gaits/cpg/trajectory.py:peak_share": "a numba signature knows no records",
    "controller/gaits/cpg/trajectory.py:trajectory": "a numba signature knows no records",
    "controller/images/thin_body_fit.py:draw_spots": "numbers of a spot and derivatives",
    "controller/mapping/mosaic/scale_flow.py:_data_terms": "runs in each step of a fit",
    "controller/mechanics/force_balance.py:_forces": "runs in each step of a solver",
    "controller/mechanics/force_balance.py:_least_missing": "work arrays of a solver are made once",
    "controller/mechanics/force_balance.py:_least_power": "work arrays of a solver are made once",
    "controller/mechanics/ground_step.py:_place": "a numba signature knows no records",
    "controller/mechanics/rigid_motion.py:_power": "runs in each step of a solver",
    "controller/mechanics/rollout_kernel.py:_pull": "runs in each step of a rollout",
    "controller/mechanics/rollout_kernel.py:roll_pieces": "its arrays are the state of all pieces",
    "controller/mechanics/rollout_kernel.py:write_result": "runs at the end of each rollout",
    "controller/repertoire/crowd.py:_step": "a slice per body costs more than its arithmetic",
    "controller/runtime/derating.py:_needs_no_limit": "runs in each cycle on plain arrays",
    "controller/studies/identification/pendulum_swing.py:_swing": "a signature of numba",
    "controller/terrain/dijkstra.py:_settle": "arrays of a heap are made once",
    "controller/terrain/safe_graph.py:_weigh": "a numba signature knows no records",
    "drivers/safety/following_error.py:_judge": "runs in each cycle on plain arrays",
    "drivers/safety/measured_step.py:_is_all_believable": "runs in each cycle on plain arrays",
    "drivers/safety/vet.py:_quick_check": "runs in each cycle on plain arrays",
    "sim/batch/kernels.py:move_links": "a kernel of Warp accepts arrays alone",
    "sim/batch/kernels.py:rub": "a kernel of Warp accepts arrays alone",
    "sim/batch/kernels.py:turn_motors": "a kernel of Warp accepts arrays alone",
    "sim/physics/belly_contacts.py:write_contacts": "runs in each step of the physics",
    "sim/plant.py:shaft_torque": "runs for each shaft in each step of the physics",
    "sim/servo/backlash.py:turn_with_backlash": "runs for each gear in each step",
    "sim/servo/bench.py:_step": "a numba signature knows no records",
    "sim/servo/control_loops.py:_run_position": "a numba signature knows no records",
    "sim/servo/control_loops.py:_run_velocity": "a numba signature knows no records",
    "sim/servo/servo_loops.py:accept_goals": "runs for each packet on plain arrays",
    "sim/servo/servo_loops.py:answer": "runs for each packet on plain arrays",
}
"""Compiled loops (file:function) that exceed the limit, each with its reason."""
DECLARATIONS: Final = {"controller/learning/environment.py:__init__"}
"""Functions whose parameters are options of users, as those of ``commands/``: here of
``gymnasium.make``."""


def nodes_of(text: str) -> list[ast.AST]:
    return list(ast.walk(ast.parse(text)))


def functions(nodes: Iterable[ast.AST]) -> list[tuple[str, int, int]]:
    """Return name, lines and parameters of each function; ``self`` and ``cls`` do not count."""
    found = []
    for node in nodes:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            given = node.args
            named = [*given.posonlyargs, *given.args, *given.kwonlyargs]
            count = sum(each.arg not in {"self", "cls"} for each in named)
            assert node.end_lineno is not None
            found.append((node.name, node.end_lineno - node.lineno + 1, count))
    return found


def wide(nodes: Iterable[ast.AST]) -> list[str]:
    """Return the functions with too many parameters."""
    return [function for function, _, parameters in functions(nodes) if parameters > PARAMETERS]


def long(place: str, text: str, nodes: Iterable[ast.AST]) -> Iterator[str]:
    """Yield what is longer than a reader likes, with its length."""
    if (lines := len(text.splitlines())) > FILE_LINES:
        yield f"{place}: {lines} lines"
    for function, lines, _ in functions(nodes):
        if lines > FUNCTION_LINES:
            yield f"{place}:{function}: {lines} lines"


def function_imports(text: str, nodes: Iterable[ast.AST]) -> list[tuple[int, str]]:
    """Return line and reason of each import inside a function; an empty reason is missing."""
    lines, found = text.splitlines(), {}
    for function in nodes:
        if isinstance(function, ast.FunctionDef | ast.AsyncFunctionDef):
            for node in ast.walk(function):
                if isinstance(node, ast.Import | ast.ImportFrom):
                    stated = NOQA.search(lines[node.lineno - 1])
                    found[node.lineno] = "" if stated is None else stated[1]
    return sorted(found.items())


def test_no_package_holds_over_a_fifth_of_the_library() -> None:
    lines: Counter[str] = Counter()
    for module in library():
        parts = module.name.split("/")
        lines[".".join(parts[:2]) if len(parts) > 2 else parts[0]] += len(module.text.splitlines())
    crowded = {package: count / lines.total() for package, count in lines.items()}
    assert {p: round(s, 3) for p, s in crowded.items() if s > PACKAGE_SHARE} == {}


def test_long_files_and_functions_are_warnings() -> None:
    for module in library():
        for found in long(module.name, module.text, module.nodes):
            warnings.warn(found, stacklevel=1)


def test_no_function_has_too_many_parameters() -> None:
    found = {
        f"{module.name}:{function}"
        for module in library()
        if "/commands/" not in module.name
        for function in wide(module.nodes)
    }
    exempt = set(KERNELS) | DECLARATIONS
    assert found - exempt == set()
    assert exempt <= found, "an exempted function is within the limit: remove it from the list"


@pytest.mark.parametrize("kernel", KERNELS)
def test_only_compiled_loops_are_exempt(kernel: str) -> None:
    path, function = kernel.split(":")
    modules = [each for each in library() if each.name == path]
    for node in [node for module in modules for node in module.nodes]:
        if isinstance(node, ast.FunctionDef) and node.name == function:
            decorators = {ast.unparse(each).split("(")[0] for each in node.decorator_list}
            if not decorators & {"compiled", "njit", "inlined", "wp.kernel"}:
                several = rf"for _function in \([^)]*\b{function}\b[^)]*\):\n    register_jitable"
                compiles = re.compile(rf"register_jitable\(.*\)\({function}\)|{several}")
                assert any(compiles.search(each.text) for each in library())
            return
    pytest.fail(f"{kernel}: there is no such function")


def test_few_imports_inside_functions_and_each_has_a_reason() -> None:
    found = {
        f"{module.name}:{line}": reason
        for module in library()
        for line, reason in function_imports(module.text, module.nodes)
    }
    assert [place for place, reason in found.items() if not reason] == []
    assert len(found) <= FUNCTION_IMPORTS


def test_planted_excesses_are_found() -> None:
    body = "\n".join(f"    x{k} = {k}" for k in range(FUNCTION_LINES))
    text = f"def f():\n{body}\n"
    assert list(long("a.py", text, nodes_of(text))) == [f"a.py:f: {FUNCTION_LINES + 1} lines"]
    many = ", ".join(f"p{k}" for k in range(PARAMETERS + 1))
    assert wide(nodes_of(f"def wide({many}):\n    pass\n")) == ["wide"]
    assert wide(nodes_of(f"def method(self, {many[4:]}):\n    pass\n")) == []
    lazy = "def f():\n    import av  # noqa: PLC0415  an extra\n    import cv2  # noqa: PLC0415\n"
    assert function_imports(lazy, nodes_of(lazy)) == [(2, "an extra"), (3, "")]
