"""``snakewalk setup``: its steps, its questions, and how it goes on after a stop."""

import json
import os
import pty
import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest

from snakewalk.config.loader import load_robot
from snakewalk.controller.bench.guided_setup import STEPS, GuidedSetup, RobotFiles
from snakewalk.sim.serve.servo_bus import ServoBus
from tests.helpers.command import snakewalk

Answer = str | Callable[[], str]
COMMAND = "from snakewalk.controller.cli.main import main; main()"


class Bench:
    """A person who answers, and the commands that the setup ran."""

    def __init__(self, folder: Path) -> None:
        self.ran: list[list[str]] = []
        self.answers: list[str] = []
        self.codes: list[int] = []
        self.folder = folder

    def _run(self, words: Sequence[str]) -> int:
        self.ran.append(list(words))
        if list(words[:2]) == ["bus", "inventory"]:
            (self.folder / "found.toml").write_text('name = "found"\njoint_axes = "ypyp"\n')
        if list(words[:2]) == ["bus", "calibrate"]:
            shutil.copyfile(self.folder / "found.toml", self.folder / "robot.toml")
        return self.codes.pop(0) if self.codes else 0

    def sets_up(self, *answers: str) -> list[str]:
        """First words of the commands that were run for these answers."""
        self.ran.clear()
        self.answers = list(answers)
        GuidedSetup(
            self.folder, "/dev/ttyUSB7", lambda question: self.answers.pop(0), self._run
        ).carry_on()
        assert not self.answers
        return [" ".join(words[:2]) for words in self.ran]


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return Bench(tmp_path / "snake")


WHOLE = ["bus inventory", "doctor --robot", "bus calibrate", "gait show", "gait run"]


def test_it_leads_from_the_bus_to_a_motion(
    bench: Bench, capsys: pytest.CaptureFixture[str]
) -> None:
    ran = bench.sets_up("yp", "", "", "", "", "", "udp:9870", "", "")
    assert ran == [*WHOLE, "pose check", "gait run"]
    assert bench.ran[0][2:4] == ["--axes", "yp"]
    said = capsys.readouterr().out
    for words in bench.ran:  # what is run is what is shown
        assert f"snakewalk {' '.join(words)}" in said
    for words in bench.ran:
        if words[0] in ("bus", "doctor") or words is bench.ran[-1]:
            assert words[words.index("--port") + 1] == "/dev/ttyUSB7"
    limits, rehearsal = bench.ran[3:5]
    assert "--port" not in rehearsal
    assert {"-p", "frequency_hz=0.2"} <= set(limits) & set(rehearsal)  # of the same motion
    assert bench.sets_up() == []  # all of it is done


def test_an_answer_that_is_none_of_the_letters_runs_nothing(bench: Bench) -> None:
    with pytest.raises(SystemExit):
        bench.sets_up("yp", "ypypyp", "1", "q")
    assert bench.ran == []


def test_it_stops_at_any_question_and_goes_on_there(bench: Bench) -> None:
    with pytest.raises(SystemExit) as stop:
        bench.sets_up("", "", "", "q")
    assert stop.value.code == 0
    assert bench.sets_up("", "", "", "", "s") == ["bus calibrate", "gait show", "gait run"]


def test_a_command_that_fails_is_tried_again_or_left(
    bench: Bench, capsys: pytest.CaptureFixture[str]
) -> None:
    bench.codes = [0, 1, 0]
    with pytest.raises(SystemExit):
        bench.sets_up("", "", "", "", "q")
    assert [words[0] for words in bench.ran] == ["bus", "doctor", "doctor"]
    bench.codes = [2]
    with pytest.raises(SystemExit) as stop:
        bench.sets_up("", "q")
    assert stop.value.code == 2
    assert "exit code 2: correct the faults above" in capsys.readouterr().out


def test_a_command_that_the_person_leaves_has_no_fault(
    bench: Bench, capsys: pytest.CaptureFixture[str]
) -> None:
    bench.codes = [0, 0, 130]
    with pytest.raises(SystemExit):
        bench.sets_up("", "", "", "", "q")
    assert "exit code" not in capsys.readouterr().out


def test_a_skipped_calibration_says_what_is_assumed(
    bench: Bench, capsys: pytest.CaptureFixture[str]
) -> None:
    bench.sets_up("", "", "s", "s", "s", "s", "", "s")
    assert "assumed: the order of the joints is that of the IDs" in capsys.readouterr().out
    assert load_robot(str(bench.folder / "robot.toml")).joint_axes == "ypyp"


def test_an_interrupted_calibration_is_resumed(bench: Bench) -> None:
    bench.folder.mkdir()
    (bench.folder / "robot.toml.part").write_text("")
    bench.sets_up("", "", "s", "", "s", "s", "", "s")
    assert bench.ran[1][-3:] == ["--resume", "--port", "/dev/ttyUSB7"]


def test_wrong_axes_are_asked_again(bench: Bench, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        bench.sets_up("yaw", "y", "q")
    assert "'yaw': only the letters y and p" in capsys.readouterr().out


def test_a_step_that_all_others_need_is_asked_again(
    bench: Bench, capsys: pytest.CaptureFixture[str]
) -> None:
    assert bench.sets_up("yp", "s", "", "", "", "s", "s", "", "s") == WHOLE[:3]
    said = capsys.readouterr().out
    assert f"{bench.folder / 'found.toml'} is missing, and every later step needs it" in said


def test_a_file_of_the_person_replaces_the_search(bench: Bench) -> None:
    bench.folder.mkdir()
    (bench.folder / "found.toml").write_text('name = "mine"\njoint_axes = "yy"\n')
    assert bench.sets_up("", "s", "s", "s", "s", "s", "", "s") == []
    assert load_robot(str(bench.folder / "robot.toml")).joint_axes == "yy"


@pytest.mark.parametrize(
    ("peak_a", "limit_a"),
    [
        (0.27, 0.54),
        (1.5, 2.0),  # not above the robot's own limit, which is 2 A for an XM430
        (None, 1.0),  # servos that report no current
    ],
)
def test_the_first_motion_has_a_limit_from_its_rehearsal(
    bench: Bench, peak_a: float | None, limit_a: float
) -> None:
    results = bench.folder / "rehearsal"
    results.mkdir(parents=True)
    (results / "summary.json").write_text(json.dumps({"peak_current_a": peak_a}))
    bench.sets_up("", "", "s", "s", "s", "s", "", "")
    assert f"run.safety.current_limit_a={limit_a:g}" in bench.ran[-1]


def test_without_a_rehearsal_the_limit_is_half_of_the_robots(bench: Bench) -> None:
    bench.sets_up("", "", "s", "s", "s", "s", "", "")
    assert "run.safety.current_limit_a=1" in bench.ran[-1]


def test_its_port_has_no_default() -> None:
    _, help_text, _ = snakewalk("setup", "--help")
    assert "default: the simulator" not in " ".join(help_text.split())


def test_without_a_terminal_it_says_so(tmp_path: Path) -> None:
    code, _, said = snakewalk("setup", str(tmp_path))
    assert code == 2
    assert "a terminal is missing" in said


def test_each_command_of_it_exists(tmp_path: Path) -> None:
    state = RobotFiles(tmp_path, "/dev/ttyUSB7", pose="udp:9870")
    state.robot.write_text('name = "found"\njoint_axes = "ypyp"\n')
    for step in STEPS:
        words = step.words(state)
        group = " ".join(words[: 1 if words[0] == "doctor" else 2])
        code, help_text, _ = snakewalk(*group.split(), "--help")
        assert code == 0
        for word in words:
            if word.startswith("-"):
                assert word in help_text, shlex.join(words)


def test_it_goes_back_to_the_step_before(bench: Bench) -> None:
    ran = bench.sets_up("y", "", "b", "yp", "", "", "s", "s", "s", "", "s")
    assert ran == ["bus inventory", "bus inventory", "doctor --robot"]
    assert bench.ran[1][2:4] == ["--axes", "yp"]


@pytest.mark.slow
def test_a_chain_with_ids_of_its_own(tmp_path: Path, servo_bus: Callable[..., ServoBus]) -> None:
    bus = servo_bus("11-14:XL330-M288")
    answers: list[Answer] = ["ypyp", "", "s", "s", "", "", "", "q"]
    text, code = typed(tmp_path, ["setup", "snake", "--port", bus.path], answers)
    assert code == 0, text
    assert "7 of 7" in text
    assert load_robot(str(tmp_path / "snake" / "robot.toml")).servo_ids == (11, 12, 13, 14)
    assert (tmp_path / "snake" / "rehearsal" / "report.html").exists()
    assert bus["Torque Enable"].tolist() == [0] * 4


@pytest.mark.slow
def test_new_servos_share_an_id_and_the_setup_names_the_command(
    tmp_path: Path, servo_bus: Callable[..., ServoBus]
) -> None:
    bus = servo_bus("1-4:XL330-M288", baud=57_600)
    bus.set("ID", 1)
    answers: list[Answer] = ["ypyp", "", "q"]
    text, code = typed(tmp_path, ["setup", "snake", "--port", bus.path], answers)
    assert code == 2, text
    said = " ".join(text.split())
    assert "--axes ypyp: 4 joints, but servos reply with 1 IDs" in said
    assert "snakewalk bus set --baud 57600 --id 1 --new-id 2" in said


@pytest.mark.slow
def test_servos_at_the_baud_rate_of_the_factory_are_set_and_found_again(
    tmp_path: Path, servo_bus: Callable[..., ServoBus]
) -> None:
    bus = servo_bus("1-4:XL330-M288", baud=57_600)

    def sets_baud_rates() -> str:
        for servo_id in "1234":
            words = ("--id", servo_id, "--new-baud", "1000000", "--yes")
            done = snakewalk("bus", "set", "--port", bus.path, "--baud", "57600", *words)
            assert done.returncode == 0, done
        return "b"

    answers: list[Answer] = ["y", "", "", sets_baud_rates, "ypyp", "", "", "q"]
    text, code = typed(tmp_path, ["setup", "snake", "--port", bus.path], answers)
    assert code == 0, text
    assert "snakewalk bus set --id ID --new-baud 1000000" in " ".join(text.split())
    robot = load_robot(str(tmp_path / "snake" / "found.toml"))
    assert (robot.servo_ids, robot.servo.baud) == ((1, 2, 3, 4), 1_000_000)
    assert "fail" not in text.partition("3 of 7")[2]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "keys", "named"),
    [
        ("mute", {"ids": [3]}, "fail servo IDs no answer from servo 3"),
        ("clash", {"id": 3, "takes": 2}, "fail duplicate IDs servo 2 answers with damaged bytes"),
    ],
)
def test_a_servo_that_is_missing_or_has_the_id_of_another_is_named(
    kind: str,
    keys: dict[str, object],
    named: str,
    tmp_path: Path,
    servo_bus: Callable[..., ServoBus],
) -> None:
    bus = servo_bus("1-4:XL330-M288")

    def breaks() -> str:
        bus.set("Homing Offset", 300, ids=[3])  # two servos never stand at the same place
        bus.fault(kind, **keys)
        return ""

    answers: list[Answer] = ["ypyp", "", breaks, "q"]
    text, code = typed(tmp_path, ["setup", "snake", "--port", bus.path], answers)
    assert code == 1, text
    assert named in " ".join(text.split())


def typed(folder: Path, words: list[str], answers: list[Answer]) -> tuple[str, int]:
    """Run the program in a terminal, answer its questions, and return its text and exit code.

    An answer that is a function does what a person does before the answer.
    """
    ours, theirs = pty.openpty()
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path), "TERM": "dumb"}
    environment |= {"XDG_RUNTIME_DIR": str(folder)}
    streams: dict[str, Any] = dict.fromkeys(("stdin", "stdout", "stderr"), theirs)
    text = ""
    asked = 0
    with subprocess.Popen(
        [sys.executable, "-c", COMMAND, *words], cwd=folder, env=environment, **streams
    ) as child:
        os.close(theirs)
        try:
            while True:
                try:
                    text += os.read(ours, 4096).decode(errors="replace")
                except OSError:  # the program has ended
                    break
                if text[asked:].endswith(": ") and answers:
                    asked = len(text)
                    answer = answers.pop(0)
                    word = answer if isinstance(answer, str) else answer()
                    os.write(ours, f"{word}\n".encode())
        except BaseException:
            child.kill()
            raise
        code = child.wait()
    os.close(ours)
    return text, code
