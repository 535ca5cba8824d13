"""What a command says beside its result: from a level on to standard error, all to a log file."""

import json
import os
import re
import subprocess
import sys
import warnings
from pathlib import Path
from typing import Any

import pytest
import typer
from pytest_mock import MockerFixture
from typer.core import TyperGroup
from typer.testing import CliRunner

from snakewalk.config.errors import InputError
from snakewalk.controller.cli import command_line
from snakewalk.controller.cli.command_line import app
from snakewalk.controller.console.messages import LOGGER, messages
from snakewalk.controller.console.progress import ProgressBar
from snakewalk.drivers.fallbacks import report_fallback

LINE = re.compile(r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d,\d{3} (DEBUG|INFO|WARNING|ERROR) +(.*)")
SAID = {
    "debug": ["a step", "_user.py:1: UserWarning: of a library", "a choice", "snakewalk: a fault?"],
    "info": ["a choice", "snakewalk: a fault?"],
    "warning": ["snakewalk: a fault?"],
    "error": [],
}


def say() -> None:
    with ProgressBar("frames", 2.0) as bar:
        LOGGER.debug("a step")
        warnings.warn_explicit("of a library", UserWarning, "/somewhere/_user.py", 1)
        bar.on_event("gait", "a choice")
        bar.update(2.0)
    LOGGER.warning("a fault\x1b")


def test_a_home_folder_that_is_not_writable_is_no_message_of_matplotlib() -> None:
    """A service account got two lines about its configuration with each report."""
    code = "import snakewalk.controller.console.messages, matplotlib; matplotlib.get_configdir()"
    environ = os.environ | {"HOME": "/dev/null/none", "MPLCONFIGDIR": "", "XDG_CONFIG_HOME": ""}
    done = subprocess.run(
        [sys.executable, "-c", code], env=environ, capture_output=True, text=True, check=True
    )
    assert done.stderr == ""


@pytest.mark.parametrize("level", SAID)
def test_a_level_shows_what_is_from_it_on_and_the_file_has_all(
    level: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "log.txt"
    file.write_text("of before\n")
    with messages(level, file):
        say()
    shown = capsys.readouterr().err
    bars = [line for line in shown.splitlines() if line.startswith("frames")]
    assert bool(bars) == (level in {"debug", "info"})
    known = {line for lines in SAID.values() for line in lines}
    assert [line for line in shown.splitlines() if line in known] == SAID[level]
    first, *lines = file.read_text().splitlines()
    assert first == "of before"
    kept = [LINE.fullmatch(line) for line in lines]
    assert [found and found[1] for found in kept] == [
        *("DEBUG", "DEBUG", "DEBUG", "INFO", "WARNING", "DEBUG")
    ]
    assert [found[2] for found in kept if found][1:] == [
        *("a step", "_user.py:1: UserWarning: of a library", "a choice", "a fault?", "done")
    ]


def test_afterwards_nothing_is_left_behind(capsys: pytest.CaptureFixture[str]) -> None:
    handlers, shown = list(LOGGER.handlers), warnings.showwarning
    with pytest.raises(InputError), messages("debug"):
        raise InputError("bad")
    assert LOGGER.handlers == handlers
    assert warnings.showwarning is shown
    capsys.readouterr()
    LOGGER.error("nobody asked")
    assert capsys.readouterr().err == ""


def test_how_a_command_ended_is_in_the_file(tmp_path: Path) -> None:
    file = tmp_path / "log.txt"
    run = CliRunner().invoke
    (tmp_path / "bad.toml").write_text("seed = 1.5\n")
    run(app, ["plan", str(tmp_path / "bad.toml"), "--log-file", str(file)])
    assert "ERROR   " in file.read_text()
    assert "bad.toml:1: seed: must be a whole number" in file.read_text()
    with pytest.raises(ZeroDivisionError), messages("error", file):
        raise ZeroDivisionError("by nought")
    assert "Traceback (most recent call last):" in file.read_text()
    with (
        pytest.raises(InputError, match=r"--log-file .*nosuch"),
        messages("info", tmp_path / "nosuch" / "x"),
    ):
        pass


def test_the_result_is_the_same_at_every_level() -> None:
    run = CliRunner().invoke
    loud, still = (run(app, ["robot", "show", "yaw16", "--json", word]) for word in ("-v", "-q"))
    assert json.loads(loud.stdout) == json.loads(still.stdout)
    assert "snakewalk" in loud.stderr
    assert still.stderr == ""


def commands(group: Any, path: str = "snakewalk") -> dict[str, set[str]]:
    """Options of every command."""
    found: dict[str, set[str]] = {}
    for name in group.list_commands(None):
        command = group.get_command(None, name)
        if isinstance(command, TyperGroup):
            found |= commands(command, f"{path} {name}")
        else:
            found[f"{path} {name}"] = {word for one in command.params for word in one.opts}
    return found


def test_a_command_does_not_build_the_options_of_all(mocker: MockerFixture) -> None:
    built = mocker.spy(command_line, "called")
    assert CliRunner().invoke(app, ["--help"]).exit_code == 0
    assert built.call_count == 0
    assert CliRunner().invoke(app, ["tools", "schema", "run"]).exit_code == 0
    assert [call.args[0].__name__ for call in built.call_args_list] == ["schema"]


def test_every_command_has_these_options() -> None:
    every = commands(typer.main.get_command(app))
    assert len(every) > 40
    wanted = {"-v", "--verbose", "-q", "--quiet", "--log-level", "--log-file"}
    assert {name for name, options in every.items() if not wanted <= options} == set()


def test_every_command_that_moves_a_body_may_be_watched() -> None:
    every = commands(typer.main.get_command(app))
    movers = {name: options for name, options in every.items() if {"--port", "--film"} <= options}
    assert {"snakewalk run", "snakewalk gait repertoire run", "snakewalk gait policy run"} <= set(
        movers
    )
    wanted = {"--view", "--view-at", "--ros"}
    assert {name for name, options in movers.items() if not wanted <= options} == set()


def test_a_fallback_reported_at_import_is_shown(
    mocker: MockerFixture, capsys: pytest.CaptureFixture[str]
) -> None:
    mocker.patch.dict("snakewalk.drivers.fallbacks._reported_fallbacks", clear=True)
    report_fallback("numba", "numba 9: loops count references")
    report_fallback("numba", "numba 9: again")
    with messages("warning"):
        report_fallback("mujoco", "MuJoCo 9: public steps")
        report_fallback("mujoco", "MuJoCo 9: again")
    assert capsys.readouterr().err.splitlines() == [
        "snakewalk: numba 9: loops count references",
        "snakewalk: MuJoCo 9: public steps",
    ]


def test_a_full_disk_is_reported_once_and_the_command_goes_on(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with messages("info", Path("/dev/full")):
        LOGGER.info("first")
        LOGGER.info("second")
    shown = capsys.readouterr().err
    assert shown.count("--log-file /dev/full: No space left on device; it ends here") == 1
    assert "Traceback" not in shown
    assert {"first", "second"} <= set(shown.splitlines())


def test_a_log_file_whose_folder_was_deleted_is_written_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "logs" / "log.txt"
    file.parent.mkdir()
    with messages("warning", file):
        LOGGER.info("before")
        file.unlink()
        file.parent.rmdir()
        LOGGER.info("after")
        assert "was deleted meanwhile; it is written again" in capsys.readouterr().err
    texts = [line.split(" ", 3)[-1].strip() for line in file.read_text().splitlines()]
    assert texts[-3:] == ["before", "after", "done"]
