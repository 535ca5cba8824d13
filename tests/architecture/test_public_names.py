"""``import snakewalk``: its names stand where it says, and importing it is light."""

import ast
import subprocess
import sys
from pathlib import Path

import snakewalk

SOURCE = ast.parse(Path(snakewalk.__file__).read_text(encoding="utf-8"))


def imported_for_type_checkers() -> dict[str, str]:
    """Module of each name under ``if TYPE_CHECKING``."""
    (block,) = (node for node in SOURCE.body if isinstance(node, ast.If))
    return {
        alias.name: str(node.module)
        for node in block.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }


def test_type_checkers_and_python_find_the_same_names() -> None:
    assert imported_for_type_checkers() == snakewalk._MODULES
    assert sorted(snakewalk.__all__) == sorted(snakewalk._MODULES)
    assert set(snakewalk.__all__) <= set(dir(snakewalk))


def test_every_name_is_defined_in_the_module_that_is_named() -> None:
    for name, module in snakewalk._MODULES.items():
        value = getattr(snakewalk, name)
        assert getattr(value, "__module__", module) == module, name


def test_an_unknown_name_is_an_attribute_error() -> None:
    assert not hasattr(snakewalk, "Snake")


def test_the_import_is_light() -> None:
    code = "import sys, snakewalk; print([m for m in sys.modules if m.split('.')[0] in %r])"
    heavy = {"numpy", "scipy", "numba", "pydantic", "mujoco", "matplotlib", "cv2", "dynamixel_sdk"}
    done = subprocess.run(
        [sys.executable, "-c", code % heavy], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"
