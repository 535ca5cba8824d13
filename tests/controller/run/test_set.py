"""``--set KEY=VALUE``: what is replaced runs, stands in the log and replays."""

import json
import math
from pathlib import Path

import pytest
from typer.testing import CliRunner

from snakewalk.config.errors import InputError
from snakewalk.controller.cli.command_line import app
from snakewalk.controller.console.options import key_values
from snakewalk.controller.run.factory import prepare_playback, prepare_walk
from snakewalk.controller.run.kinds.gait_factory import prepare_gait
from snakewalk.controller.runlog.reader import read_log
from snakewalk.controller.studies.replay import differences, replay
from tests.helpers.in_process import leave_out_pages


def call(*words: str) -> dict[str, object]:
    found = CliRunner().invoke(app, [*words, "--json"])
    assert found.exit_code == 0, found.output
    return json.loads(found.stdout)


def test_values_are_json_or_text() -> None:
    given = [
        "a=1",
        "b = [[1, 0]]",
        "c=true",
        "d=words",
        "e=null",
        "f=x=y",
        "g=[1",
        "h=" + "9" * 5000,
    ]
    found = key_values("--set", given)
    assert found.pop("h") == "9" * 5000
    expected = {"a": 1, "b": [[1, 0]], "c": True, "d": "words", "e": None, "f": "x=y", "g": "[1"}
    assert found == expected


@pytest.mark.parametrize("text", ["run.seed", "run.seed=", "=3", ""])
def test_a_pair_has_a_key_and_a_value(text: str) -> None:
    with pytest.raises(InputError, match="expected KEY=VALUE"):
        key_values("--set", [text])


def test_a_key_has_one_value() -> None:
    with pytest.raises(InputError, match="--set b=1: b has a value already: leave one"):
        key_values("--set", ["b=1", "a=1", "b=1"])


@pytest.mark.costs("a run and its replay")
def test_what_is_set_moves_the_body_stands_in_the_log_and_replays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Twice the friction across is another way of the head; the replay of either is the same."""
    leave_out_pages(monkeypatch)
    heads = []
    for across in (0.6, 1.2):
        told = call(
            "gait", "run", "lateral-undulation", "--seconds", "1", "--no-film",
            "--out", str(tmp_path / f"{across}"), "--set", f"world.friction.across={across}",
            "--set", "robot.link_mass_kg=0.2", "--set", "run.start_heading_deg=90",
        )  # fmt: skip
        record = read_log(Path(str(told["log"])))
        header = record.header
        assert header.world.friction.across == across
        assert header.robot.mean_link_mass_kg == 0.2
        assert header.run.start_heading_rad == pytest.approx(math.pi / 2.0)
        again = read_log(replay(record, tmp_path / f"{across}.mcap"))
        assert differences(record, again, 1e-12, 1e-12).is_equal
        heads.append(record.pose.head_m[-1])
    assert abs(heads[0] - heads[1]).max() > 1e-3


def test_a_plan_is_made_with_what_is_set() -> None:
    plan = ["plan", "flat-square", "--motion", "serpenoid"]
    plan += ["--set", "run.waypoints_m=[[1.2,0.2]]"]
    one = call(*plan)
    slow = call(*plan, "--set", "run.behaviour.pulse_body_lengths_s=0.125", "--set", "run.seed=5")
    assert slow["seed"] == 5
    assert float(str(slow["duration_s"])) > 1.7 * float(str(one["duration_s"]))


def test_a_table_that_a_file_leaves_out_is_made() -> None:
    walk = prepare_walk("flat-square", keys={"run.compliance.stiffness_a_rad": 0.7})
    assert walk.run.compliance is not None
    assert walk.run.compliance.stiffness_a_rad == 0.7
    assert prepare_walk("flat-square").run.compliance is None


def test_angles_are_also_in_degrees() -> None:
    keys = {"robot.yaw_limit_deg": 80, "run.start_heading_deg": -45.0}
    walk = prepare_walk("flat-square", keys=keys)
    assert walk.robot.limit_rad[0] == pytest.approx(math.radians(80.0))
    assert walk.run.start_heading_rad == pytest.approx(-math.pi / 4.0)


def test_a_gait_and_a_recording_run_with_what_is_set() -> None:
    gait = prepare_gait("rolling", keys={"run.time_limit_s": 9.0, "run.world": "flat-friction-1.5"})
    assert (gait.run.time_limit_s, gait.world.name) == (9.0, "flat-friction-1.5")
    plain = prepare_playback("worm-like")
    slow = prepare_playback("worm-like", keys={"robot.joint_speed_limit_rad_s": 0.5})
    assert slow.speed < plain.speed
    assert slow.run.time_limit_s == slow.duration_s + 30.0
    assert prepare_playback("worm-like", keys={"run.time_limit_s": 9.0}).run.time_limit_s == 9.0


def test_every_wrong_key_is_told_at_once() -> None:
    with pytest.raises(InputError) as caught:
        prepare_gait(
            "rolling",
            keys={"seed": 1, "rbot.servo.baud": 1, "run.gait.name": "x", "run": 1, "run.gait": {}},
        )
    begins = "a key begins with run., robot. or world."
    assert caught.value.faults == (
        f"seed: {begins}; did you mean run.seed?",
        f"rbot.servo.baud: {begins}; did you mean robot.servo.baud?",
        "run.gait.name: is given by the command",
        f"run: {begins}",
        "run.gait: is given by the command",
        "run.gait: is given by --param",
        "run.gait: is given by --seconds",
        "run.gait: is given by --then",
    )
