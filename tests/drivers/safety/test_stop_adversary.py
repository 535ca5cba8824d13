"""Stop file and stop output against faults of folder, file, program and other runs."""

import errno
import os
import shutil
import signal
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from pytest_mock import MockerFixture

from snakewalk.config.errors import InputError
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import SafetyConfig
from snakewalk.controller.bench.supply_check import wiggle
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.errors import PortError, SafetyTrippedError
from snakewalk.drivers.safety.limits import SafetyLimits
from snakewalk.drivers.safety.safe_link import SafeLink
from snakewalk.drivers.safety.stop_button import StopButton, button_folder, stoppable_runs
from snakewalk.drivers.safety.stop_output import StopCommand, parse_stop_output
from snakewalk.drivers.types import JointCommand
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant

ROBOT = RobotConfig(name="trio", joint_axes="yyy")
URL = "socket://127.0.0.1:5000"


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Folder of the stop files; a button makes it."""
    for name in ("XDG_RUNTIME_DIR", "TMPDIR", "HOME"):
        monkeypatch.setenv(name, str(tmp_path))
    return tmp_path / "snakewalk"


def _delete(path: Path) -> None:
    path.unlink()


def _truncate(path: Path) -> None:
    os.truncate(path, 0)


def _cut(path: Path) -> None:
    os.truncate(path, 100)


def _replace(path: Path) -> None:
    other = path.with_name("other")
    other.write_bytes(bytes(4096))
    other.replace(path)


def _rename(path: Path) -> None:
    path.rename(path.with_suffix(".old"))


def _link(path: Path) -> None:
    path.rename(path.with_suffix(".old"))
    path.symlink_to(path.with_suffix(".old"))


def _delete_folder(path: Path) -> None:
    shutil.rmtree(path.parent)


def _move_folder(path: Path) -> None:
    path.parent.rename(path.parent.with_name("elsewhere"))


@pytest.mark.fast_cases(4)
@pytest.mark.parametrize(
    ("change", "said"),
    [
        *((change, "was truncated") for change in (_truncate, _cut)),
        *((change, "was deleted or moved") for change in (_delete, _replace, _rename, _link)),
        *((change, "was deleted or moved") for change in (_delete_folder, _move_folder)),
    ],
)
def test_a_run_that_lost_its_stop_file_stops(change: Callable[[Path], None], said: str) -> None:
    """It went on, and no other program could stop it; a truncated file killed it with SIGBUS."""
    line = SimLine(ServoBank(ROBOT.servo_ids), BenchPlant(3))
    limits = SafetyLimits.from_config(ROBOT, SafetyConfig())
    with StopButton("walk") as button:
        chain = ServoChain(DynamixelBus(line), ROBOT)
        link = SafeLink(chain, limits, line.clock, stop_requested=button.pressed)
        link.enable()
        change(button.path)
        with suppress(SafetyTrippedError):
            for _ in range(20):
                line.clock.advance(0.02)
                link.read()
                link.write(JointCommand(line.clock.now_s(), np.zeros(3)))
        assert said in str(link.tripped)
        assert not line.bank["Torque Enable"].any()


@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EFBIG])
def test_a_full_disk_is_reported_before_the_run(mocker: MockerFixture, code: int) -> None:
    """Not as bad input; the error names the folder."""
    mocker.patch("os.write", side_effect=OSError(code, os.strerror(code)))
    with pytest.raises(OSError, match=os.strerror(code)) as full:
        StopButton("walk")
    assert full.value.errno == errno.ENOSPC
    assert full.value.filename == str(button_folder())


@pytest.mark.parametrize("kind", ["link", "pipe", "folder", "zeros", "empty"])
def test_other_files_of_the_folder_are_no_stop_files(kind: str, folder: Path) -> None:
    with StopButton("walk"):
        other = folder / "1-x.stop"
        if kind == "link":
            other.symlink_to("/etc/passwd")
        elif kind == "pipe":
            os.mkfifo(other)
        elif kind == "folder":
            other.mkdir()
        else:
            other.write_bytes(bytes(4096 if kind == "zeros" else 0))
        (seen,) = stoppable_runs()
        assert seen.run.name == "walk"
        seen.close()


def test_a_second_run_on_a_url_is_rejected_and_names_the_first() -> None:
    """No system locks a URL: both runs wrote goals to the same servos."""
    with StopButton("first", URL):
        with pytest.raises(InputError, match=rf"{URL}: the run first \(process {os.getpid()}\)"):
            StopButton("second", URL)
        with StopButton("other", "socket://127.0.0.1:5001"):
            pass
    with StopButton("third", URL):
        pass


def test_a_stop_during_the_wiggle_of_the_doctor_ends_it() -> None:
    line = SimLine(ServoBank(ROBOT.servo_ids), BenchPlant(3))

    def press() -> None:
        for button in stoppable_runs():
            with button:
                button.press("somebody")

    line.firmware.events.schedule(line.clock.now_s() + 1.0, press)
    found = wiggle(DynamixelBus(line), ROBOT, SafetyConfig())
    assert "stop requested by somebody" in str(found.fault)
    assert not line.bank["Torque Enable"].any()


@pytest.mark.parametrize("kind", ["missing", "not executable", "folder"])
def test_a_stop_command_that_cannot_start_is_rejected_before_the_run(
    kind: str, tmp_path: Path
) -> None:
    """It was first noticed when torque off had failed, and the command was needed."""
    program = tmp_path / "relay"
    if kind == "not executable":
        program.write_text("#!/bin/sh\n", encoding="utf-8")
        program.chmod(0o644)
    elif kind == "folder":
        program.mkdir()
    with (
        pytest.raises(PortError, match=r"no such program|is not executable"),
        StopCommand((str(program),)),
    ):
        pass


@pytest.mark.parametrize("text", ["command:/bin/true 'all", "command:/bin/true\0", "rts:/dev/x\0"])
def test_a_stop_output_with_a_damaged_text_is_rejected(text: str) -> None:
    with pytest.raises(ValueError, match=r"quotation|NUL"):
        parse_stop_output(text)


def test_a_stop_command_has_its_own_session(tmp_path: Path) -> None:
    """Ctrl-C in the terminal ended it before it had cut the supply."""
    target = tmp_path / "session"
    code = "import os, pathlib, sys; pathlib.Path(sys.argv[1]).write_text(str(os.getsid(0)))"
    StopCommand((sys.executable, "-c", code, str(target))).activate()
    assert int(target.read_text(encoding="utf-8")) != os.getsid(0)


def test_a_stop_command_that_is_killed_has_failed() -> None:
    code = f"import os; os.kill(os.getpid(), {int(signal.SIGKILL)})"
    with pytest.raises(OSError, match="exit code -9"):
        StopCommand((sys.executable, "-c", code)).activate()
