"""``snakewalk gait`` over the real bytes: list, show, run, refusals, derating, head steering."""

import json
import os
import pty
import re
import struct
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from snakewalk.config.errors import InputError
from snakewalk.config.run import SafetyConfig
from snakewalk.controller.cli.command_line import app
from snakewalk.controller.cli.main import main
from snakewalk.controller.console.progress import TimeBar
from snakewalk.controller.gaits.registry import GAITS
from snakewalk.controller.metrics.displacement import gait_displacement
from snakewalk.controller.motion.operator import Operator
from snakewalk.controller.run.factory import prepare_run, prepare_walk
from snakewalk.controller.run.kinds.gait_factory import prepare_gait
from snakewalk.controller.run.kinds.gait_run import GaitRun
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.runlog.reader import read_log
from snakewalk.controller.studies.replay import differences, replay
from tests.helpers.in_process import leave_out_pages

pytestmark = pytest.mark.usefixtures("legible_figures")

runner = CliRunner()


def call(*words: str) -> dict[str, object]:
    result = runner.invoke(app, list(words))
    assert result.exit_code == 0, result.output
    found: dict[str, object] = json.loads(result.stdout.splitlines()[-1])
    return found


def test_list_names_every_gait_with_its_source_and_the_shipped_sets() -> None:
    found = call("gait", "list", "--json")
    assert [row["name"] for row in found["gaits"]] == list(GAITS)  # type: ignore[index]
    assert all(row["source"] for row in found["gaits"])  # type: ignore[index]
    assert "concertina-yaw16" in [row["name"] for row in found["sets"]]  # type: ignore[index]
    assert "sidewinding" in runner.invoke(app, ["gait", "list"]).output


@pytest.mark.slow
def test_show_tells_ranges_and_draws_the_body(tmp_path: Path) -> None:
    picture = tmp_path / "side.png"
    found = call("gait", "show", "sidewinding", "--picture", str(picture), "--json")
    row = found["parameters"]["lift_rad"]  # type: ignore[index]
    assert (row["low"], row["high"]) == (0.0, 0.8)
    assert picture.read_bytes().startswith(b"\x89PNG")
    text = runner.invoke(app, ["gait", "show", "concertina-yaw16"]).output
    assert "folds" in text
    assert "yaw16" in text


@pytest.mark.parametrize("command", ["list", "show", "run"])
def test_help_gives_an_example(command: str) -> None:
    assert f"snakewalk gait {command}" in runner.invoke(app, ["gait", command, "--help"]).output


@pytest.mark.fast_cases(5)
@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["run", "sidewinding", "--robot", "yaw16"], "needs pitch joints; robot yaw16 has none"),
        (["run", "hop"], "hop: no such gait"),
        (["run", "sidewinding", "--param", "waves"], "expected NAME=VALUE"),
        (["show", "sidewinding", "--param", "waves=9"], "waves: must be at most"),
        (["run", "rolling", "--look-at", "here"], "expected X,Y in metres"),
        (["show", "rolling", "--picture", "body.txt"], "a picture ends in .png"),
        (["run", "rolling", "--live"], "keys from a terminal"),
        (["run", "rolling", "--gamepad", "/dev/nosuch"], "no gamepad"),
        (["run", "rolling", "--seconds", "-1"], "--seconds: must be at least 0.1 (got '-1')"),
        (["run", "rolling", "--port", "/dev/nosuch"], "/dev/nosuch"),
    ],
)
def test_bad_input_ends_with_code_2_and_one_line(
    words: list[str],
    said: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["snakewalk", "gait", *words])
    with Path(os.devnull).open() as nothing:
        monkeypatch.setattr(sys, "stdin", nothing)
        with pytest.raises(SystemExit) as left:
            main()
    assert left.value.code == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert said in lines[-1]
    assert sum(line.startswith("snakewalk:") for line in lines) == 1
    assert list(tmp_path.iterdir()) == [], "refused before anything is written"


@pytest.fixture(scope="module")
def sidewound(tmp_path_factory: pytest.TempPathFactory):
    folder = tmp_path_factory.mktemp("side")
    return run_robot(RunRequest(prepare_gait("sidewinding", seconds=9.0), folder))


def test_a_gait_runs_over_the_bus_without_clamp_or_miss_and_goes_its_way(sidewound) -> None:
    assert sidewound.outcome.tripped is None
    numbers = sidewound.summary
    assert numbers.outcome == "ran to its end"
    assert (numbers.clamps, numbers.missed_deadlines, numbers.failed_reads) == (0, 0, 0)
    record = read_log(sidewound.log)
    assert record.header.run.gait.name == "sidewinding"
    way = gait_displacement(record)
    assert way.cycles >= 2
    assert numbers.speed_m_s == pytest.approx(way.speed_m_s, rel=1e-5)  # one definition of speed
    assert way.left_bl > 0.25
    assert abs(way.forward_bl) < 0.1
    asked = record.cycle.asked_rad[25:]  # behind the ramp over the last encoder step
    acceleration = np.diff(asked, n=2, axis=0) / 0.02**2
    assert np.abs(acceleration).max() < 1.06 * record.header.robot.joint_acceleration_limit_rad_s2
    np.testing.assert_allclose(asked[-1], asked[-2], atol=1e-3)


def test_its_pitch_joints_are_stiff_enough_to_lift(sidewound) -> None:
    robot = read_log(sidewound.log).header.robot
    assert robot.servo.pitch_p_gain == robot.servo.position_p_gain


@pytest.mark.slow
def test_a_log_of_a_gait_replays_exactly_and_becomes_a_job_again(sidewound, tmp_path: Path) -> None:
    record = read_log(sidewound.log)
    again = read_log(replay(record, tmp_path / "again.mcap"))
    assert differences(record, again, 1e-9, 1e-9).is_equal
    job = prepare_run(record.header.run, record.header.robot, record.header.world)
    assert isinstance(job, GaitRun)


@pytest.mark.slow
def test_a_warm_robot_slows_down_says_so_and_does_not_trip(tmp_path: Path) -> None:
    prepared = prepare_gait("turn-in-place", seconds=6.0)
    tight = SafetyConfig(current_limit_a=0.5, current_time_s=5.0)
    run = prepared.run.model_copy(update={"safety": tight})
    said: list[str] = []
    job = GaitRun(run, prepared.robot, prepared.world)
    finished = run_robot(RunRequest(job, tmp_path, on_event=lambda kind, text: said.append(text)))
    assert finished.outcome.tripped is None
    assert finished.outcome.least_rate < 0.9
    assert any(text.startswith("slowing down: joint") for text in said)
    events = [e for e in read_log(finished.log).events if e.kind == "derating"]
    assert events
    assert events[0].level == "warning"


@pytest.mark.slow
def test_the_head_keeps_a_heading_over_the_bus(tmp_path: Path) -> None:
    prepared = prepare_gait(
        "lateral-undulation", seconds=6.0, keys={"run.gait.look_heading_rad": 0.3}
    )
    record = read_log(run_robot(RunRequest(prepared, tmp_path)).log)
    r = record.pose.rotation
    late = record.pose.time_s > record.pose.time_s[0] + 3.0
    heading = np.arctan2(r[late, 1, 0], r[late, 0, 0])[:-60]
    assert np.sqrt(np.mean((heading - 0.3) ** 2)) < 0.15


@pytest.mark.slow
def test_an_operators_keys_change_a_run_over_the_bus(tmp_path: Path) -> None:
    presses = iter(["right", "down", "m", "n"])
    beat = iter(range(10**6))

    def keys() -> list[str]:
        return [next(presses, "?")] if next(beat) % 60 == 59 else []

    said: list[str] = []
    job = replace(
        prepare_gait("sidewinding", seconds=6.0),
        make_operator=lambda m, r, on_event: Operator(m, r, keys, on_event),
    )
    finished = run_robot(RunRequest(job, tmp_path, on_event=lambda kind, text: said.append(text)))
    assert finished.summary.clamps == 0
    assert {"frequency_hz = 0.55", "mirror = True", "gait rolling"} <= set(said)
    kinds = [e.text for e in read_log(finished.log).events if e.kind == "operator"]
    assert kinds == [text for text in said if text in kinds]


@pytest.mark.slow
def test_live_from_a_terminal(tmp_path: Path) -> None:
    ours, theirs = pty.openpty()
    command = (  # with a page without pictures
        "from snakewalk.controller.cli.main import main\n"
        "from snakewalk.controller.report import artifacts\n"
        "artifacts._draw = lambda record, made: artifacts.Drawings([], '', made)\n"
        "main()"
    )
    words = ["gait", "run", "rolling", "--live", "--no-film", "--json", "--out", str(tmp_path)]
    process = subprocess.Popen(
        [sys.executable, "-c", command, *words, "--seconds", "600"],
        stdin=theirs, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert process.stderr is not None
    shown = process.stderr.readline()  # the keys are shown once the terminal is ready
    while "Ctrl-C: torque off" not in shown:
        line = process.stderr.readline()
        assert line, shown
        shown += line
    assert "space: halt, go on" in shown
    assert "m: mirror" in shown, "no key breaks inside its words"
    assert "t: torque off" in shown
    said = ""
    for key, obeyed in ((b"m", "mirror = True"), (b"n", "gait ")):
        os.write(ours, key)
        while obeyed not in (line := process.stderr.readline()):
            assert line, said
            if "late and is dropped" in line:  # the machine is busy
                os.write(ours, key)
        said += line
    os.write(ours, b"q")
    printed, rest = process.communicate()
    said += rest
    os.close(ours)
    os.close(theirs)
    assert process.returncode == 0, said
    found = json.loads(printed.splitlines()[-1])
    assert found["duration_s"] < 500.0
    assert "mirror = True" in said
    became = re.search(r"^gait (\S+)$", said, re.M)
    assert became is not None
    assert became[1] != "rolling"
    assert f"\n{became[1]} ━" in said, "the bar has the gait that moves"


@pytest.mark.parametrize("columns", [80, 120])
def test_a_key_and_a_pads_button_switch_torque_off(
    columns: int,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """In the cycle in which it is pressed, during the ramp as well."""
    pad = tmp_path / "js0"
    os.mkfifo(pad)
    monkeypatch.setenv("COLUMNS", str(columns))
    leave_out_pages(monkeypatch)
    words = ["gait", "run", "rolling", "--gamepad", str(pad), "--no-film", "--json"]
    monkeypatch.setattr("sys.argv", ["snakewalk", *words, "--out", str(tmp_path / "run")])
    reader = os.open(pad, os.O_RDONLY | os.O_NONBLOCK)
    writer = os.open(pad, os.O_WRONLY)
    monkeypatch.setattr(  # at the first cycle's end
        TimeBar, "on_progress", lambda *_: os.write(writer, struct.pack("<IhBB", 0, 1, 1, 10))
    )
    with pytest.raises(SystemExit) as ended:
        main()
    os.close(reader)
    os.close(writer)
    printed, said = capsys.readouterr()
    assert ended.value.code == 1
    found = json.loads(printed.splitlines()[-1])
    assert found["tripped"] == "the operator switched torque off"
    assert found["duration_s"] < 0.1
    for told in (
        "hold LB or RB: it moves",
        "right stick pressed: torque off",
        "Ctrl-C: torque off",
    ):
        assert told in said, "no line breaks inside words"


def test_the_main_job_sends_gaits_to_their_own_command() -> None:
    with pytest.raises(InputError, match="snakewalk gait run"):
        prepare_walk("flat-square", motion="gait", gait={"name": "rolling"})


@pytest.mark.parametrize(
    ("world", "parameters", "keys", "warns"),
    [
        ("isotropic", {}, {}, True),
        ("flat", {}, {}, False),
        ("pool", {}, {}, False),
        # scales resist sliding backward: forward the belly grips, backward it does not
        ("flat", {}, {"world.friction.back": 0.7}, False),
        ("flat", {"backward": True}, {"world.friction.back": 0.7}, True),
    ],
)
def test_a_ground_on_which_a_gait_may_go_the_other_way_is_reported(
    world: str,
    parameters: dict[str, object],
    keys: dict[str, object],
    warns: bool,
    caplog: pytest.LogCaptureFixture,
) -> None:
    prepare_gait("lateral-undulation", world=world, parameters=parameters, keys=keys)
    assert ("may go the other way" in caplog.text) is warns
