"""The stop button: who sees it, who may press it, and what is left of it."""

import os
from pathlib import Path

import pytest

from snakewalk.config.errors import InputError
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import SafetyConfig
from snakewalk.controller.bench.emergency_stop import runs_of
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.errors import SafetyTrippedError
from snakewalk.drivers.safety.limits import SafetyLimits
from snakewalk.drivers.safety.safe_link import SafeLink
from snakewalk.drivers.safety.stop_button import (
    PressedButton,
    StopButton,
    button_folder,
    stoppable_runs,
)
from snakewalk.drivers.types import JointCommand
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant

ROBOT = RobotConfig(name="trio", joint_axes="yyy")


@pytest.fixture(autouse=True)
def own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    for name in ("TMPDIR", "HOME"):
        monkeypatch.setenv(name, str(tmp_path / name))
        (tmp_path / name).mkdir()
    return tmp_path / "snakewalk"


def a_link(button: StopButton) -> tuple[SafeLink, SimLine]:
    line = SimLine(ServoBank(ROBOT.servo_ids), BenchPlant(3))
    chain = ServoChain(DynamixelBus(line, ROBOT.models_by_id), ROBOT)
    limits = SafetyLimits.from_config(ROBOT, SafetyConfig())
    return SafeLink(chain, limits, line.clock, stop_requested=button.pressed), line


def test_a_button_is_private_seen_while_it_is_held_and_gone_after(own_folder: Path) -> None:
    with StopButton("walk", "/dev/null", own_folder) as button:
        assert button.path.stat().st_mode & 0o777 == 0o600
        assert own_folder.stat().st_mode & 0o777 == 0o700
        (seen,) = stoppable_runs()
        assert seen.run == button.run
        assert (seen.run.process, seen.run.ports) == (os.getpid(), ("/dev/null",))
        assert seen.is_held
        assert seen.end is None
    assert seen.end == ""
    assert not seen.is_held
    assert list(stoppable_runs()) == []
    assert list(own_folder.iterdir()) == []
    seen.close()


def test_a_run_on_several_ports_is_found_by_each(own_folder: Path) -> None:
    with StopButton("walk", ["/dev/null", "/dev/zero"], own_folder):
        for port in ("/dev/null", "/dev/zero", "1-8=/dev/full,9-16=/dev/zero"):
            (found,) = runs_of(port=port)
            assert found.run.ports == ("/dev/null", "/dev/zero")
            found.close()
        assert runs_of(port="1-8=/dev/full,9-16=/dev/tty") == []


def test_a_url_is_the_same_port_in_every_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with StopButton("far", "socket://snake.example:5000") as button:
        assert button.run.ports == ("socket://snake.example:5000",)
        monkeypatch.chdir(tmp_path)
        (found,) = runs_of(port="socket://snake.example:5000")
        found.close()
        assert runs_of(port="socket://snake.example:5001") == []


def test_the_newest_comes_first_and_what_a_killed_program_left_is_deleted(own_folder: Path) -> None:
    with StopButton("old") as old, StopButton("new") as new:
        os.utime(old.path, (1.0, 1.0))
        left = own_folder / "123-x.stop"
        left.write_bytes(new.path.read_bytes())  # nobody locks it
        runs = list(stoppable_runs())
        assert [each.run.name for each in runs] == ["new", "old"]
        assert not left.exists()
        for each in runs:
            each.close()


def test_a_press_latches_until_the_run_ends_whatever_an_operator_resets() -> None:
    with StopButton("walk") as button, PressedButton(button.path) as outside:
        link, line = a_link(button)
        with link:
            state = link.enable()
            link.write(JointCommand(line.clock.now_s(), state.position_rad))
            outside.press("é" * 300)  # longer than its place
            link.read()
            assert link.tripped is not None
            assert "stop requested by é" in link.tripped
            assert line.bank["Torque Enable"].tolist() == [0] * 3
            link.reset("somebody")
            with pytest.raises(SafetyTrippedError, match="stop requested"):
                link.enable()


def test_a_press_before_torque_is_on_switches_it_off_where_an_earlier_program_left_it_on() -> None:
    with StopButton("walk") as button, PressedButton(button.path) as outside:
        link, line = a_link(button)
        line.bank["Torque Enable"][:] = 1
        outside.press("a test")
        with link, pytest.raises(SafetyTrippedError, match="stop requested by a test"):
            link.enable()
        assert line.bank["Torque Enable"].tolist() == [0] * 3


@pytest.mark.parametrize("kind", ["open to others", "link", "file", "nowhere"])
def test_a_folder_that_is_not_private_is_not_used_and_blocks_nothing(
    kind: str, own_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another user could make the folder first, and then no run began and no stop worked."""
    user = f"snakewalk-{os.getuid()}"
    folders = [own_folder, tmp_path / "TMPDIR" / user, tmp_path / "HOME/.cache/snakewalk/stop"]
    for unusable, expected in zip(folders, [*folders[1:], None], strict=True):
        unusable.parent.mkdir(parents=True, exist_ok=True)
        if unusable.exists():  # of the turn before
            unusable.rmdir()
        if kind == "open to others":
            unusable.mkdir()
            unusable.chmod(0o777)
        elif kind == "link":
            unusable.symlink_to("/tmp")
        elif kind == "file":
            unusable.write_text("", encoding="utf-8")
        else:
            unusable.symlink_to("/proc/self/nowhere")
        if expected is None:
            with pytest.raises(InputError) as info:
                StopButton("walk")
            assert len(info.value.faults) == 3
            assert list(stoppable_runs()) == []
        else:
            with StopButton("walk") as button:
                assert button.path.parent == expected
                (run,) = stoppable_runs()
                run.close()


def test_without_a_runtime_folder_it_is_in_the_folder_of_temporary_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "none"))
    assert button_folder() == tmp_path / "TMPDIR" / f"snakewalk-{os.getuid()}"


def test_a_run_of_a_cron_job_is_seen_in_a_login(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as cron:
        cron.setenv("XDG_RUNTIME_DIR", str(tmp_path / "none"))
        button = StopButton("walk")
    with button:
        (run,) = stoppable_runs()
        assert run.run == button.run
        run.close()


@pytest.mark.parametrize("content", [b"", b"\0" * 4096, b"x" * 4096])
def test_a_file_that_is_no_button_is_not_taken_for_one(own_folder: Path, content: bytes) -> None:
    own_folder.mkdir(mode=0o700)
    (own_folder / "1-x.stop").write_bytes(content)
    assert list(stoppable_runs()) == []


@pytest.mark.parametrize("text", ["[" * 2500, '{"ports":' * 270, "[]", "null", '{"ports": 1}', "{"])
def test_a_damaged_button_of_any_depth_is_no_button(own_folder: Path, text: str) -> None:
    with StopButton("whole") as whole:
        damaged = bytearray(whole.path.read_bytes())
        damaged[1552:1554] = len(text).to_bytes(2, "little")
        damaged[1554 : 1554 + len(text)] = text.encode()
        path = own_folder / "9-x.stop"
        path.write_bytes(damaged)
        with pytest.raises((ValueError, TypeError, KeyError)):
            PressedButton(path)
        runs = list(stoppable_runs())
        assert [each.run.name for each in runs] == ["whole"]
        for each in runs:
            each.close()


def test_the_program_of_another_container_is_found_by_its_lock() -> None:
    """Its own number is another program's here, and that one was killed."""
    with StopButton("walk") as button:
        written = button.path.read_bytes()
        inside = str(os.getpid()).encode()
        with button.path.open("r+b") as file:
            file.write(
                written.replace(b'"process": ' + inside, b'"process": 1'.ljust(11 + len(inside)))
            )
        with PressedButton(button.path) as seen:
            assert seen.run.process == 1
            assert seen.process == os.getpid()
    assert seen.process is None
