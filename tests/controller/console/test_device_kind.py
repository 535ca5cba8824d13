"""A port that is not a serial device is rejected by its name, before a command does any work."""

import os
from pathlib import Path

import pytest
from typer.testing import CliRunner

from snakewalk.controller.cli.command_line import app
from snakewalk.controller.console.options import check_port_name
from snakewalk.drivers.errors import PortError


def test_serial_devices_urls_and_missing_names_pass() -> None:
    master, slave = os.openpty()
    try:
        for name in (None, os.ttyname(slave), "socket://host:5000", "/dev/ttyNONE", "sim", "robot"):
            assert check_port_name(name) == name
    finally:
        os.close(master)
        os.close(slave)


def test_other_devices_files_and_links_of_servers_that_ended_are_rejected(tmp_path: Path) -> None:
    file, link = tmp_path / "file", tmp_path / "tty"
    file.touch()
    link.symlink_to("/dev/pts/none")
    for name in ("/dev/null", str(file), str(tmp_path)):
        with pytest.raises(PortError, match=f"{name}: is not a serial device; name one such as"):
            check_port_name(name)
    with pytest.raises(PortError, match="leads to /dev/pts/none, which is gone: its server has"):
        check_port_name(str(link))
    with pytest.raises(PortError) as found:
        check_port_name(f"1-8=/dev/null,9-16={file}")
    assert len(found.value.faults) == 2


@pytest.mark.parametrize(
    "command",
    ["run flat-square", "gait run rolling", "doctor", "bus scan", "bus calibrate -o mine.toml"],
)
def test_commands_reject_it_before_any_plan(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(app, [*command.split(), "--port", "/dev/null"])
    assert isinstance(result.exception, PortError), result.output
    assert not list(tmp_path.iterdir())
