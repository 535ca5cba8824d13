"""What the shell completes, and that neither this nor a page of help loads what is slow to load."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

from snakewalk.config.loader import shipped
from snakewalk.controller.cli.main import main


def completed(line: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    """What bash is offered for the last word of a line."""
    monkeypatch.setenv("_SNAKEWALK_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_WORDS", line)
    monkeypatch.setenv("COMP_CWORD", str(len(line.split(" ")) - 1))
    monkeypatch.setattr("sys.argv", ["snakewalk"])
    with pytest.raises(SystemExit):
        main()
    return capsys.readouterr().out.split()


@pytest.mark.fast_cases(7)
@pytest.mark.parametrize(
    ("line", "offered"),
    [
        ("snakewalk run ramp-1", ["ramp-10-along", "ramp-10-up", "ramp-15-up"]),
        ("snakewalk run my", ["my-run.toml"]),
        ("snakewalk run --robot xl", ["xl330-16"]),
        ("snakewalk plan --world ram", ["ramp-10", "ramp-15"]),
        ("snakewalk run --motion s", ["serpenoid"]),
        ("snakewalk run --track worm", ["worm-like"]),
        ("snakewalk gait run sidew", ["sidewinding", "sidewinding-fast"]),
        ("snakewalk robot show yaw", ["yaw16"]),
        ("snakewalk play lam", ["lamprey-like"]),
        ("snakewalk trials run flat-sq", ["flat-square"]),
        ("snakewalk gait tune roll", ["rolling"]),
        ("snakewalk gait policy run wave-c", ["wave-cma"]),
        ("snakewalk run --set world.friction.ac", ["world.friction.across="]),
        ("snakewalk run --set run.walk.no", []),
        ("snakewalk tools schema ro", ["robot"]),
    ],
)
def test_a_value_is_completed(
    line: str,
    offered: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my-run.toml").write_text("")
    (tmp_path / "my-notes.txt").write_text("")
    assert completed(line, monkeypatch, capsys) == offered


def test_files_in_folders_and_all_names_are_offered(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "run.toml").write_text("")
    assert completed("snakewalk run mine/", monkeypatch, capsys) == ["mine/run.toml"]
    assert completed("snakewalk run nosuch/", monkeypatch, capsys) == []
    assert completed("snakewalk run ", monkeypatch, capsys) == list(shipped("runs"))


@pytest.mark.costs("reads the help of every command")
def test_help_lists_and_completion_load_nothing_heavy() -> None:
    """Counted, for a time would depend on the machine; in the order of what each may load."""
    program = """
import contextlib, io, os, sys
from snakewalk.controller.cli.main import main

def heavy(words, among, **environment):
    os.environ.update(environment)
    sys.argv = ["snakewalk", *words]
    with contextlib.suppress(SystemExit), contextlib.redirect_stdout(io.StringIO()) as out:
        main()
    assert len(out.getvalue()) > 20, words
    loaded = {name.partition(".")[0] for name in sys.modules} | set(sys.modules)
    print(words, sorted(among & loaded))

slow = {"scipy", "numba", "mujoco", "matplotlib", "networkx", "cv2", "mcap", "av", "plotly"}
heavy(["--help"], slow | {"numpy", "pydantic"})
heavy(["run", "--help"], slow | {"numpy"})
schemas = {f"snakewalk.config.{name}" for name in ("robot", "run", "world")}  # slow to build
heavy(["gait", "list"], slow | schemas)
heavy(["list"], slow)
words = {"COMP_WORDS": "snakewalk gait run ", "COMP_CWORD": "3"}
heavy([], slow, _SNAKEWALK_COMPLETE="complete_bash", **words)
"""
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    lines = done.stdout.splitlines()
    assert len(lines) == 5
    assert [line for line in lines if not line.endswith(" []")] == []


@pytest.mark.slow
def test_help_loses_no_words_to_markup() -> None:
    """Text in brackets is a style to what draws the help: ``[power]`` would not be shown."""

    folder = Path(main.__code__.co_filename).parent.parent
    said: list[str] = []
    for file in folder.rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef) and file.parent.name == "commands":
                said.append(ast.get_docstring(node) or "")
            if isinstance(node, ast.keyword) and node.arg == "help":
                said += [
                    str(part.value) for part in ast.walk(node) if isinstance(part, ast.Constant)
                ]
    assert len(said) > 400
    assert [text for text in said if re.search(r"\[[a-z#/@]", text)] == []
