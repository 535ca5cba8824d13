"""Each example runs with its defaults, explains itself, is short, and needs only the library."""

import ast
import runpy
import sys
from importlib import import_module
from pathlib import Path

import pytest

from tests.helpers.in_process import InProcessExecutor
from tests.helpers.tiers import slow_after

FOLDER = Path(__file__).resolve().parents[2] / "examples"
NAMES = (
    "drive_chain",
    "bus_in_a_test",
    "live_gait",
    "own_motion",
    "read_log",
    "sweep",
    "learn_wave",
    "send_pose",
)
WITH_TORCH = "learn_policy"
"""Trains with packages that are no extra of ours; that it ran is told in docs/policies.md."""
ALLOWED = {"snakewalk", "numpy", "pytest", "gymnasium"} | set(sys.stdlib_module_names)


def shown_help(path: Path, monkeypatch: pytest.MonkeyPatch, out: pytest.CaptureFixture[str]) -> str:
    """What a script prints for ``--help``, on one line; it runs in this process."""
    monkeypatch.setattr(sys, "argv", [str(path), "--help"])
    with pytest.raises(SystemExit) as end:
        runpy.run_path(str(path), run_name="__main__")
    assert not end.value.code
    return " ".join(out.readouterr().out.split())


def test_these_are_the_examples() -> None:
    assert {file.stem for file in FOLDER.glob("*.py")} == {*NAMES, WITH_TORCH}


def test_what_the_training_takes_of_the_library_is_there() -> None:
    tree = ast.parse((FOLDER / f"{WITH_TORCH}.py").read_text(encoding="utf-8"))
    taken = [
        (node.module, each.name)
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and str(node.module).startswith("snakewalk")
        for each in node.names
    ]
    assert taken
    for module, name in taken:
        assert hasattr(import_module(str(module)), name)


@pytest.mark.costs("runs an example in a process of its own")
@pytest.mark.parametrize("name", slow_after(2, NAMES))
def test_it_runs_and_leaves_nothing(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """In this process: seven others would each import for two seconds."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("concurrent.futures.ProcessPoolExecutor", InProcessExecutor)
    path = FOLDER / f"{name}.py"
    monkeypatch.setattr(sys, "argv", [str(path)])
    code: object = 0
    try:
        runpy.run_path(str(path), run_name="__main__")
    except SystemExit as end:
        code = end.code
    shown = capfd.readouterr()
    assert not code, shown.err
    assert shown.out.strip()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", NAMES)
def test_it_explains_itself(
    name: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    source = (FOLDER / f"{name}.py").read_text(encoding="utf-8")
    first_line = str(ast.get_docstring(ast.parse(source))).splitlines()[0]
    assert first_line in shown_help(FOLDER / f"{name}.py", monkeypatch, capsys)


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


@pytest.mark.parametrize("tool", ["film_strip", "gallery", "landing_film", "overhead_picture"])
def test_the_tools_that_draw_the_pages_explain_themselves(
    tool: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = FOLDER.parent / "docs" / "pictures" / "tools" / f"{tool}.py"
    shown = shown_help(path, monkeypatch, capsys)
    assert "usage" in shown
    assert "docs/" in shown or "film" in shown
