"""The folders are the architecture: no import may point where the table does not allow."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
OURS = ("config", "drivers", "sim", "controller")
VOCABULARY = {f"drivers.{name}" for name in ("types", "clock", "link", "errors", "compiling")}


def imported(source: str) -> set[str]:
    names: set[str] = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "imports are absolute"
            module = node.module or ""
            names.add(module)
            if module in OURS:
                names |= {f"{module}.{alias.name}" for alias in node.names}
    return {name for name in names if name.split(".")[0] in {*OURS, "tests"}}


def forbidden(path: Path, names: set[str]) -> set[str]:
    """Names that a module at ``path`` (relative to the root) must not import."""
    top = path.parts[0]
    if path.parts[:2] == ("controller", "app"):
        return {n for n in names if n.startswith("tests")}
    allowed = {"config": set(), "drivers": {"config"}, "sim": {"config", "drivers"}}
    if top in allowed:
        return {n for n in names if n.split(".")[0] not in allowed[top] | {top}}
    bad = {
        n for n in names if n.split(".")[0] in {"sim", "tests"} or n.startswith("controller.app")
    }
    return bad | {n for n in names if n.split(".")[0] == "drivers" and n not in VOCABULARY}


@pytest.mark.parametrize("top", OURS)
def test_every_import_follows_the_table(top: str) -> None:
    modules = sorted((ROOT / top).rglob("*.py"))
    assert modules
    wrong = {
        str(m.relative_to(ROOT)): bad
        for m in modules
        if (bad := forbidden(m.relative_to(ROOT), imported(m.read_text())))
    }
    assert wrong == {}


def test_the_walk_catches_a_wrong_arrow() -> None:
    assert forbidden(Path("config/x.py"), imported("from drivers.types import JointState"))
    assert forbidden(Path("drivers/x.py"), imported("import sim.bus.line"))
    assert forbidden(
        Path("controller/motion/x.py"), imported("from drivers.bus import DynamixelBus")
    )
    assert forbidden(Path("controller/shape/x.py"), imported("from controller.app import cli"))
    assert not forbidden(Path("controller/app/x.py"), imported("from sim.bus.line import SimLine"))
