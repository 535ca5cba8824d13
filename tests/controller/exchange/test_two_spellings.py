"""Two spellings of one robot give the same bytes in every command."""

import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

from snakewalk.controller.cli.command_line import app
from snakewalk.controller.report import artifacts
from tests.helpers.tiers import slow_after

CASES = Path(__file__).resolve().parents[2] / "config/two_spellings"
ROBOT = "tiny.toml"
COMMANDS = {
    "show": ["robot", "show", ROBOT, "--json"],
    "power": ["robot", "power", ROBOT],
    "urdf": ["robot", "export", ROBOT, "--urdf", "tiny.urdf"],
    "mjcf": ["robot", "export", ROBOT, "--mjcf", "tiny.xml"],
    "plan": ["plan", "flat-square", "--robot", ROBOT],
    "init": ["init", "mine", "--robot", ROBOT],
    "walk": [
        *("run", "flat-square", "--robot", ROBOT, "--out", "out", "--no-film"),
        *("--set", "run.time_limit_s=1", "--quiet"),
    ],
    "gait": [
        *("gait", "run", "lateral-undulation", "--robot", ROBOT, "--out", "out", "--no-film"),
        *("--seconds", "1", "--quiet"),
    ],
}


def files_and_output(folder: Path, arguments: list[str]) -> dict[str, bytes]:
    """Contents of the files that a command writes, and its output."""
    before = set(folder.rglob("*"))
    done = CliRunner().invoke(app, arguments)
    in_time = "run.time_limit_s=1" not in arguments  # a walk of one second does not arrive: 1
    assert done.exit_code == (0 if in_time else 1), done.output
    files = {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(set(folder.rglob("*")) - before)
        if path.is_file() and path.name != "report.html"
    }
    return {"output": done.stdout.encode(), **files}


@pytest.mark.slow_cases(2, "each command twice: 1 s of CPU")
@pytest.mark.costs("runs commands twice")
@pytest.mark.parametrize("command", slow_after(2, COMMANDS))
def test_a_command_gives_the_same_bytes(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # the report is not compared: it has the time of day
    monkeypatch.setattr(artifacts, "_draw", lambda *_: artifacts.Drawings([], "", ""))
    results = []
    for spelling in ("a", "b"):
        folder = tmp_path / spelling
        folder.mkdir()
        shutil.copy(CASES / f"{spelling}.toml", folder / ROBOT)
        monkeypatch.chdir(folder)
        results.append(files_and_output(folder, COMMANDS[command]))
    scalar, spelt = results
    assert list(spelt) == list(scalar)
    assert [name for name in scalar if scalar[name] != spelt[name]] == []
