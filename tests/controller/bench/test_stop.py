"""``snakewalk stop``: runs of other programs, and servos on a port that no program holds."""

import json
import os
import resource
import subprocess
import sys
import tty
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from subprocess import PIPE, Popen

import pytest

from snakewalk.config.faults import FaultPlan
from snakewalk.controller.bench import emergency_stop
from snakewalk.controller.bench.emergency_stop import Stop, stop_of_words
from snakewalk.controller.bench.torque_off import DYNAMIXEL_OFF, FEETECH_OFF
from snakewalk.controller.cli.main import main
from snakewalk.controller.run.kinds.gait_factory import prepare_gait
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.runlog.reader import read_log
from snakewalk.controller.runtime.drive import Progress
from snakewalk.drivers.port import port_holders
from snakewalk.drivers.protocol.feetech import FeetechInstruction
from snakewalk.drivers.protocol.packet import (
    BROADCAST_ID,
    Instruction,
    InstructionPacket,
    encode_instruction,
)
from snakewalk.drivers.protocol.protocol1 import BROADCAST_ID as FEETECH_BROADCAST
from snakewalk.drivers.protocol.protocol1 import frame
from snakewalk.drivers.safety.stop_button import StopButton
from snakewalk.sim.faults.fault_player import FaultPlayer
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant
from tests.helpers.line_port import OpenedLine, line_port
from tests.helpers.program import Program, command

HUNG = """
import signal, sys
from snakewalk.drivers.safety.stop_button import StopButton
signal.signal(signal.SIGTERM, signal.SIG_IGN)
with StopButton("hung", sys.argv[1]):
    print("up", flush=True)
    signal.pause()
"""


OTHER_LOGIN = """
import os, select, sys
from snakewalk.drivers.safety.stop_button import StopButton
port = os.open(sys.argv[1], os.O_RDWR | os.O_NOCTTY)
with StopButton("walk", sys.argv[1]) as button:
    print("up", flush=True)
    while (why := button.pressed()) is None:
        select.select([], [], [], 1e-3)
    button.end(why)
"""
OUR_COMMAND = """
import os, signal, sys
port = os.open(sys.argv[1], os.O_RDWR | os.O_NOCTTY)
print("up", flush=True)
signal.pause()
"""

LOCKS_THE_PORT = OUR_COMMAND.replace(
    "print", "import fcntl; fcntl.flock(port, fcntl.LOCK_EX)\nprint"
)


@pytest.fixture(autouse=True)
def own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("XDG_RUNTIME_DIR", "TMPDIR", "HOME"):
        monkeypatch.setenv(name, str(tmp_path))


@contextmanager
def program(text: str, path: Path, *words: str, **environment: str) -> Iterator[Popen[str]]:
    """Run a file of this name until it has said that it is up."""
    path.write_text(text)
    command = [sys.executable, str(path), *words]
    environment = {**os.environ, **environment}
    with Popen(command, stdout=PIPE, text=True, env=environment) as child:
        assert child.stdout is not None
        assert child.stdout.readline() == "up\n"
        try:
            yield child
        finally:
            child.kill()


def test_a_run_of_another_login_is_found_by_the_device(
    three: OpenedLine, stop: Callable[..., tuple[int, str, str]], tmp_path: Path
) -> None:
    """It said that no run was under way, while the robot moved."""
    other = tmp_path / "other"
    other.mkdir()
    with (
        line_port(three) as port,
        program(
            OTHER_LOGIN, tmp_path / "run.py", port, XDG_RUNTIME_DIR=str(other), TMPDIR=str(other)
        ) as child,
    ):
        code, out, err = stop("--port", port)
        child.wait()
    assert (code, err) == (0, "")
    assert out.startswith("walk: latched after ")
    assert "stop requested by snakewalk stop" in out
    assert child.returncode == 0


def test_a_command_of_ours_that_has_the_port_is_ended_and_torque_goes_off(
    three: OpenedLine, stop: Callable[..., tuple[int, str, str]], tmp_path: Path
) -> None:
    three.bank["Torque Enable"][:] = 1
    with line_port(three) as port, program(OUR_COMMAND, tmp_path / "snakewalk", port) as child:
        code, out, _ = stop("--port", port)
        child.wait()
    lines = out.splitlines()
    assert code == 0
    assert lines[0].startswith(f"snakewalk {port}: terminated after ")
    assert "3 servos confirm it" in lines[1]
    assert child.returncode == -15
    assert three.bank["Torque Enable"].tolist() == [0] * 3


def test_a_program_that_is_not_ours_is_left_alone(
    three: OpenedLine, stop: Callable[..., tuple[int, str, str]], tmp_path: Path
) -> None:
    with line_port(three) as port, program(OUR_COMMAND, tmp_path / "other.py", port) as child:
        code, out, _ = stop("--port", port, "--baud", "1000000")
        assert child.poll() is None
    assert (code, "terminated" in out) == (0, False)


def test_torque_off_is_sent_past_a_program_that_is_hidden(
    stop: Callable[..., tuple[int, str, str]], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """It said "close it" of a program that nobody saw, and sent nothing."""
    master, slave = os.openpty()
    tty.setraw(slave)
    port = os.ttyname(slave)
    with program(LOCKS_THE_PORT, tmp_path / "snakewalk", port) as child:
        assert port_holders.lockers_of(port) == {str(child.pid)}
        monkeypatch.setattr(port_holders, "PROC", str(tmp_path))
        code, out, err = stop("--port", port)
        assert child.poll() is None
    sent = os.read(master, 4096)
    os.close(master)
    os.close(slave)
    assert (code, err) == (1, "")
    assert sent == (DYNAMIXEL_OFF + FEETECH_OFF) * 3 * 20
    assert out == (
        f"{port}: port in use: torque off was sent 20 times, but no servo was asked; a program "
        "that is hidden from here has the port open and may switch torque on again; end that "
        f"program, on the host by: sudo snakewalk stop --port {port}\n"
    )


def test_one_port_that_is_missing_does_not_keep_torque_on_at_the_others(
    three: OpenedLine, stop: Callable[..., tuple[int, str, str]]
) -> None:
    three.bank["Torque Enable"][:] = 1
    with line_port(three) as port:
        code, out, _ = stop("--port", f"1-8=/dev/nosuch,9-16={port}", "--baud", "1000000")
    first, second = out.splitlines()
    assert code == 1
    assert first.startswith("/dev/nosuch: not stopped: /dev/nosuch: no such port")
    assert second.startswith(f"{port}: torque off: 3 servos confirm it")
    assert three.bank["Torque Enable"].tolist() == [0] * 3


def cpu_s(*words: str) -> float:
    """CPU of a program, the least of three calls."""
    spent = []
    for _ in range(3):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([sys.executable, *words], capture_output=True, check=False)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        spent.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return min(spent)


def test_a_run_is_stopped_before_anything_slow_is_imported() -> None:
    """It cost 20 times as much, and on a busy computer torque went off after 17 s."""
    snakewalk = "import sys; from snakewalk.controller.cli.main import main; main()"
    with StopButton("walk", "/dev/null"):
        stopping = cpu_s("-c", snakewalk, "stop", "another")
    assert stopping <= 3.0 * cpu_s("-c", "import json, os, socket")


def test_torque_off_is_on_the_wire_before_anything_slow_is_imported() -> None:
    child = (
        "import os, resource, sys\n"
        "from snakewalk.controller.cli.main import main\n"
        "from snakewalk.drivers.port.serial_port import SerialPort\n"
        "def write(port, data):\n"
        "    used = resource.getrusage(resource.RUSAGE_SELF)\n"
        "    slow = sorted({'numba', 'numpy', 'pydantic', 'typer', 'rich'} & {*sys.modules})\n"
        "    print(data.hex(), used.ru_utime + used.ru_stime, *slow, flush=True)\n"
        "    os._exit(0)\n"
        "SerialPort.write = write\n"
        "_, slave = os.openpty()\n"
        "sys.argv = ['snakewalk', 'stop', '--port', os.ttyname(slave)]\n"
        "main()\n"
    )
    done = subprocess.run([sys.executable, "-c", child], capture_output=True, text=True, check=True)
    data, used_s, *slow = done.stdout.split()
    assert data == ((DYNAMIXEL_OFF + FEETECH_OFF) * 3).hex()
    assert slow == []
    assert float(used_s) < 0.5


def test_the_bytes_of_torque_off_are_those_of_the_protocols() -> None:
    write = InstructionPacket(BROADCAST_ID, Instruction.WRITE, bytes([64, 0, 0]))
    assert encode_instruction(write) == DYNAMIXEL_OFF
    assert frame(FEETECH_BROADCAST, FeetechInstruction.WRITE, bytes((40, 0))) == FEETECH_OFF


@pytest.mark.parametrize(
    ("words", "read"),
    [
        ((), Stop()),
        (("walk", "--json"), Stop("walk", as_json=True)),
        (("--port=a=b", "--baud", "57600", "--baud=1"), Stop(None, "a=b", [57600, 1])),
        *(
            (words, None)
            for words in (
                ("--help",),
                ("--port",),
                ("--port", "a", "--port", "b"),
                ("--baud", "x"),
                ("a", "b"),
                ("",),
                ("--quiet",),
            )
        ),
    ],
)
def test_words_that_are_not_simple_are_left_to_the_command_line(
    words: tuple[str, ...], read: Stop | None
) -> None:
    assert stop_of_words(iter(words)) == read


@pytest.fixture
def stop(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[..., tuple[int, str, str]]:
    def call(*words: str) -> tuple[int, str, str]:
        monkeypatch.setattr("sys.argv", ["snakewalk", "stop", *words])
        with pytest.raises(SystemExit) as end:
            main()
        shown = capsys.readouterr()
        return int(end.value.code or 0), shown.out, shown.err

    return call


@pytest.fixture
def three() -> OpenedLine:
    return OpenedLine(ServoBank(range(1, 4)), BenchPlant(3))


@pytest.mark.slow
def test_a_simulated_run_is_stopped_from_another_program_and_its_log_says_so(
    tmp_path: Path,
) -> None:
    pytest.importorskip("mujoco")
    other: list[Program] = []

    def on_progress(progress: Progress) -> None:
        if not other:
            other.append(command("stop", "--json"))
        assert other[0].poll() in {None, 0}, "the stop failed, and nothing ends the run"

    job = prepare_gait("lateral-undulation", seconds=3600.0)
    finished = run_robot(RunRequest(job, tmp_path / "run", on_progress=on_progress))
    said, _ = other[0].communicate()
    (stopped,) = json.loads(said)["stopped"]
    assert other[0].returncode == 0
    assert (stopped["what"], stopped["how"], stopped["safe"]) == (
        "lateral-undulation",
        "latched",
        True,
    )
    assert stopped["folder"] == str(tmp_path / "run")
    why = f"stop requested by snakewalk stop (process {other[0].pid})"
    assert finished.outcome.tripped == why == stopped["text"]
    assert [event.text for event in read_log(finished.log).events if event.kind == "trip"] == [why]


def test_a_run_that_does_not_answer_is_killed_and_its_servos_switched_off_from_here(
    three: OpenedLine,
    stop: Callable[..., tuple[int, str, str]],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for name in ("LATCH_S", "END_S"):
        monkeypatch.setattr(emergency_stop, name, 0.05)
    torque = three.bank["Torque Enable"]
    torque[:] = 1
    with (
        line_port(three) as port,
        subprocess.Popen(
            [sys.executable, "-c", HUNG, port], stdout=subprocess.PIPE, text=True
        ) as child,
    ):
        assert child.stdout is not None
        assert child.stdout.readline() == "up\n"
        code, out, err = stop("--port", port, "--baud", "1000000", "--json")
    killed, off = json.loads(out)["stopped"]
    assert (code, child.returncode) == (0, -9), err
    assert (killed["how"], killed["safe"]) == ("killed", False)
    assert off["text"] == "3 servos confirm it at 1000000 baud"
    assert torque.tolist() == [0] * 3


def test_a_port_where_nobody_answers_ends_with_exit_code_1(
    three: OpenedLine, stop: Callable[..., tuple[int, str, str]]
) -> None:
    three.bank["Baud Rate"][:] = 1
    with line_port(three) as port:
        code, out, _ = stop("--port", port, "--baud", "1000000")
    assert code == 1
    assert "no servo replies; check the power" in out


@pytest.mark.costs("a line that loses requests")
def test_torque_goes_off_on_a_line_that_loses_every_third_request(
    stop: Callable[..., tuple[int, str, str]],
) -> None:
    """Sent once at each rate, and asked three times, it left torque on here and there."""
    confirmed = 0
    for seed in range(20):
        line = OpenedLine(ServoBank(range(1, 4)), BenchPlant(3))
        line.bank["Torque Enable"][:] = 1
        fault = {"kind": "drop", "chance": 0.33, "of": "questions"}
        FaultPlayer(line, FaultPlan.model_validate({"seed": seed, "fault": [fault]}))
        with line_port(line) as port:
            code, out, _ = stop("--port", port)
        assert line.bank["Torque Enable"].tolist() == [0] * 3
        confirmed += code == 0 and "3 servos confirm it" in out
    assert confirmed >= 15  # in the others both broadcast pings got lost


def test_what_is_asked_wrongly_is_one_line(
    stop: Callable[..., tuple[int, str, str]], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr("serial.tools.list_ports.comports", list)
    assert stop("nothing") == (2, "", "snakewalk: nothing: no such run is active\n")
    assert stop("a", "--port", "b")[0] == 2
    code, _, err = stop()
    assert code == 2
    assert "nothing to stop: this user has no run here; --port: no USB serial adapter found" in err
    code, _, err = stop("--port", str(tmp_path / "tty"), "--baud", "7")
    assert "--baud 7: servos have" in err


def test_a_run_is_meant_by_name_folder_log_process_or_port(tmp_path: Path) -> None:
    with StopButton("one", folder=tmp_path / "r") as one, StopButton("two", "/dev/null"):
        for run in ("one", str(tmp_path / "r"), str(tmp_path / "r" / "log.mcap")):
            (found,) = emergency_stop.runs_of(run=run)
            assert found.run == one.run
            found.close()
        names = {}
        for key, buttons in {
            "process": emergency_stop.runs_of(run=str(one.run.process)),
            "port": emergency_stop.runs_of(port="/dev/null"),
            "none": emergency_stop.runs_of(),
        }.items():
            names[key] = sorted(each.run.name for each in buttons)
            for each in buttons:
                each.close()
    assert names == {"process": ["one", "two"], "port": ["two"], "none": ["two"]}
