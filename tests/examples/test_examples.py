"""Each example runs with its defaults, explains itself, is short, and needs only the library."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "examples"
NAMES = (
    "drive_chain",
    "bus_in_a_test",
    "live_gait",
    "own_motion",
    "read_log",
    "sweep",
    "learn_wave",
)
ALLOWED = {"snakewalk", "numpy", "pytest", "gymnasium"} | set(sys.stdlib_module_names)


def run(name: str, *arguments: str, folder: Path) -> str:
    done = subprocess.run(
        [sys.executable, str(FOLDER / f"{name}.py"), *arguments],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_these_are_the_examples() -> None:
    assert {file.stem for file in FOLDER.glob("*.py")} == set(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_it_runs_and_leaves_nothing(name: str, tmp_path: Path) -> None:
    assert run(name, folder=tmp_path).strip()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", NAMES)
def test_it_explains_itself(name: str, tmp_path: Path) -> None:
    source = (FOLDER / f"{name}.py").read_text(encoding="utf-8")
    first_line = str(ast.get_docstring(ast.parse(source))).splitlines()[0]
    shown = " ".join(run(name, "--help", folder=tmp_path).split())
    assert first_line in shown


@pytest.mark.parametrize("name", NAMES)
def test_it_is_short_and_imports_only_the_library(name: str) -> None:
    source = (FOLDER / f"{name}.py").read_text(encoding="utf-8")
    assert len(source.splitlines()) < 60
    modules = {
        alias.name if isinstance(node, ast.Import) else str(node.module)
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.Import | ast.ImportFrom)
        for alias in node.names
    }
    assert {module for module in modules if module.split(".")[0] not in ALLOWED} == set()
    assert all("." not in module for module in modules if module.startswith("snakewalk"))


@pytest.mark.parametrize("tool", ["film_strip", "gallery", "overhead_picture"])
def test_the_tools_that_draw_the_pages_explain_themselves(tool: str, tmp_path: Path) -> None:
    path = FOLDER.parent / "docs" / "pictures" / "tools" / tool
    shown = run(str(path), "--help", folder=tmp_path)
    assert "usage" in shown
    assert "docs/" in shown or "film" in shown
