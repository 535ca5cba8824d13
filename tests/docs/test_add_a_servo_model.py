"""The steps of the page that adds a servo model, carried out as printed."""

import re
import shlex
import signal
from pathlib import Path

import pytest
from typer.testing import CliRunner

from snakewalk.controller.cli.command_line import app
from tests.helpers.command import snakewalk
from tests.helpers.program import command

pytestmark = pytest.mark.slow

PAGE = Path(__file__).resolve().parents[2] / "docs/how-to/add-a-servo-model.md"
TEXT = PAGE.read_text(encoding="utf-8")
FILES = {
    body.partition("\n")[0].removeprefix("# "): body
    for body in re.findall(r"```toml\n(# .*?)```", TEXT, re.DOTALL)
}
COMMANDS = [
    line
    for block in re.findall(r"```console\n(.*?)```", TEXT, re.DOTALL)
    for line in block.splitlines()
]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Folder with the files of the page, which is the working directory."""
    for name, body in FILES.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(body, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_first_command_is_within_ten_lines() -> None:
    assert any(line.startswith("snakewalk ") for line in TEXT.splitlines()[:10])
    assert list(FILES) == ["servos/XM430-W999.toml", "my-robot.toml"]


def test_the_model_is_shown_and_simulated(folder: Path) -> None:
    shown = [line for line in COMMANDS if " robot show " in line or " gait run " in line]
    assert len(shown) == 2
    for line in shown:
        done = CliRunner().invoke(app, shlex.split(line)[1:])
        assert done.exit_code == 0, done.output
    assert (folder / "first/log.mcap").is_file()


def test_the_served_bus_is_scanned_and_examined(folder: Path) -> None:
    serve = next(line for line in COMMANDS if "--link" in line)
    with command(*shlex.split(serve)[1:]) as process:
        process.stdout.readline()  # it serves
        scan, doctor = (line for line in COMMANDS if "--port ./bus" in line)
        found = snakewalk(*shlex.split(scan)[1:])
        examined = snakewalk(*shlex.split(doctor)[1:])
        process.send_signal(signal.SIGTERM)
    assert found.stdout.count("XM430-W999") == 6, found.stderr
    assert "6 times XM430-W999" in examined.stdout, examined.stderr
    assert "fail" not in examined.stdout
