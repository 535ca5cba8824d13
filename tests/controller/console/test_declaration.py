"""The declaration of a command is read without importing it, and equals that of its function."""

import inspect
import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, get_args

import pytest
import typer

from snakewalk.controller.console.command import command_info, declaration
from snakewalk.controller.console.plugins import builtin_plugins

COMMANDS = [each for each in builtin_plugins() if each.kind == "command"]
HEAVY = ("numpy", "scipy", "numba", "mujoco", "matplotlib", "networkx", "cv2", "mcap", "viser")
PROGRAM = f"""
import json, sys
from snakewalk.controller.cli.command_line import app
import contextlib, io, typer
program = typer.main.get_command(app)
found = {{}}
for words in json.loads(sys.argv[1]):
    before = set(sys.modules)
    with contextlib.suppress(SystemExit), contextlib.redirect_stdout(io.StringIO()):
        program.main([*words.split(), "--help"], standalone_mode=False)
    loaded = {{name.partition(".")[0] for name in set(sys.modules) - before}}
    found[words] = sorted(set({HEAVY}) & loaded)
print(json.dumps(found))
"""


def options(function: Callable[..., Any]) -> dict[str, Any]:
    """Return type, option and default of each parameter, without the identity of functions."""
    found = {}
    for name, one in inspect.signature(function, eval_str=True).parameters.items():
        kind, *infos = get_args(one.annotation) or [one.annotation]
        found[name] = name_of(kind), one.default, [plain(info) for info in infos]
    return found


def name_of(kind: Any) -> Any:
    """Return a class by its name: the declaration evaluates a model of the command once more."""
    return kind.__qualname__ if getattr(kind, "__module__", "").startswith("snakewalk") else kind


def plain(info: Any) -> dict[str, Any] | str:
    if not hasattr(info, "__dict__"):  # a field of pydantic
        return repr(info)
    return {
        key: getattr(value, "__qualname__", value) if callable(value) else value
        for key, value in vars(info).items()
    }


@pytest.mark.slow_cases(12, "58 cases of 0.1 s of CPU")
@pytest.mark.fast_cases(12)
@pytest.mark.parametrize("listed", COMMANDS, ids=lambda each: each.name)
def test_the_declaration_equals_that_of_the_function(listed: Any) -> None:
    declared, function = declaration(listed.target), listed.load()
    assert declared is not None
    assert inspect.getdoc(declared) == inspect.getdoc(function)
    assert command_info(declared) == command_info(function)
    assert options(declared) == options(function)


@pytest.mark.slow
def test_the_help_of_no_command_imports_what_the_command_uses() -> None:
    words = [each.name for each in COMMANDS]
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, json.dumps(words)],
        capture_output=True,
        text=True,
        check=True,
    )
    found = json.loads(done.stdout)
    assert len(found) == len(COMMANDS) > 50
    assert {name: loaded for name, loaded in found.items() if loaded} == {}


def test_only_the_statements_that_the_options_need_are_evaluated(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "planted_command.py").write_text(
        '''
from typing import Annotated

import typer

from nosuch_package import body
from snakewalk.controller.console.command import command

SIZES = (low, high) = (1, 3)
Count = Annotated[int, typer.Option(min=low, callback=lambda value: check(value))]
unused = 1 / 0


def check(value: int) -> int:
    """Reject what is too large."""
    if value > high:
        raise typer.BadParameter("too large")
    return value


@command("planted", examples=("planted",))
def planted(count: Count = high) -> None:
    """Do nothing."""
    body(count)
'''
    )
    monkeypatch.syspath_prepend(tmp_path)
    declared = declaration("planted_command:planted")
    assert declared is not None
    assert inspect.getdoc(declared) == "Do nothing."
    kind, default, [info] = options(declared)["count"]
    assert (kind, default, info["min"]) == (int, 3, 1)
    option: Any = get_args(inspect.signature(declared).parameters["count"].annotation)[1]
    with pytest.raises(typer.BadParameter, match="too large"):
        option.callback(4)


def test_without_a_source_there_is_no_declaration() -> None:
    assert declaration("math:sqrt") is None
