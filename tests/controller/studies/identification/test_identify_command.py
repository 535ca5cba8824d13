"""``snakewalk robot identify``: BAM's files in and out, and what it refuses."""

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot, with_keys
from snakewalk.controller.cli.command_line import app
from snakewalk.controller.studies.identification.servo_constants import (
    CONSTANTS,
    NAMES,
    ServoConstants,
    ranges,
    robot_with,
)
from snakewalk.sim.servo.motor import gears_of, motors_of, p_gain_per_rad
from tests.controller.studies.identification.conftest import PLANTED, swing, write

BAM = {
    "kt": PLANTED["torque_constant_n_m_a"],
    "R": PLANTED["resistance_ohm"],
    "armature": PLANTED["armature_kg_m2"],
    "friction_base": PLANTED["dry_n_m"],
    "friction_stribeck": PLANTED["stribeck_n_m"],
    "dtheta_stribeck": PLANTED["stribeck_rad_s"],
    "alpha": 2.0,
    "friction_viscous": PLANTED["viscous_n_m_s"],
    "error_gain": PLANTED["p_unit_per_rad"],
    "command_delay": 0.003,
    "model": "m2",
    "actuator": "xl330",
}


def run(*words: str | Path) -> str:
    done = CliRunner().invoke(app, ["robot", "identify", *map(str, words)], catch_exceptions=False)
    return done.stdout


def refused(*words: str | Path) -> str:
    done = CliRunner().invoke(app, ["robot", "identify", *map(str, words)])
    assert isinstance(done.exception, InputError), done.output
    return str(done.exception)


def test_constants_are_judged_and_written(files: list[Path], tmp_path: Path) -> None:
    start, out = tmp_path / "bam.json", tmp_path / "out.json"
    start.write_text(json.dumps(BAM))
    words = (*files[:2], "--judge", files[2], "--start", start, "--no-fit", "-o", out)
    told = json.loads(run(*words, "--json"))
    assert told["mean_error_deg"] < 0.1
    assert set(told["errors_deg"]) == set(map(str, files))
    assert told["fitted"] == []
    written = json.loads(out.read_text())
    assert {key: written[key] for key in BAM if key != "model"} == {
        key: value for key, value in BAM.items() if key != "model"
    }
    assert written["model"] == "m5"
    assert written["load_friction_motor"] == 0.0
    again = json.loads(run(*files, "--start", out, "--no-fit", "--json"))
    assert again["constants"] == told["constants"]
    assert "out.json: exists; --force" in refused(*words)


def test_backlash_and_goal_current_are_read_and_written(tmp_path: Path) -> None:
    start, out, robot = tmp_path / "bam.json", tmp_path / "out.json", tmp_path / "mine.toml"
    start.write_text(json.dumps(BAM | {"backlash": 0.0175}))
    loose = swing(400, lambda t: 1.4 * np.sin(5.1 * t), 3.0, backlash_rad=0.0175, limit_a=1.2)
    path = write(loose, tmp_path / "loose.json").path
    words = (path, "--start", start, "--no-fit", "--robot", "xl330-16", "--robot-out", robot)
    told = json.loads(run(*words, "-o", out, "--json"))
    assert told["constants"]["backlash_rad"] == 0.0175
    assert told["mean_error_deg"] < 0.1
    assert told["robot_errors_deg"][str(path)][1] < 0.1
    assert json.loads(out.read_text())["backlash"] == 0.0175
    assert load_robot(str(robot)).motors[0].backlash_rad == 0.0175
    bad = json.loads(path.read_text()) | {"goal_current_a": 0.0}
    path.write_text(json.dumps(bad))
    assert "goal_current_a is 0; give the Goal Current" in refused(path)
    assert "--backlash: needs a fit" in refused(path, "--backlash", "--no-fit", "--start", start)
    assert "--backlash: are for pendulums" in refused("a.mcap", "--backlash")


def test_models_that_do_not_ask_for_the_side(files: list[Path], tmp_path: Path) -> None:
    start = tmp_path / "m3.json"
    start.write_text(json.dumps(BAM | {"model": "m3", "load_friction_base": 0.3}))
    told = json.loads(run(files[0], "--start", start, "--no-fit", "--json"))
    assert told["constants"]["by_motor"] == told["constants"]["by_load"] == 0.3


def test_a_model_with_squares_comes_back(files: list[Path], tmp_path: Path) -> None:
    start, out = tmp_path / "m6.json", tmp_path / "out.json"
    squares = {"load_friction_motor_quad": 0.4, "load_friction_external_quad": 0.3}
    start.write_text(json.dumps(BAM | squares | {"model": "m6"}))
    told = json.loads(run(files[0], "--start", start, "--no-fit", "--json", "-o", out))
    written = json.loads(out.read_text())
    assert written["model"] == "m6"
    assert {key: written[key] for key in squares} == squares
    assert told["constants"]["by_load_square"] == 0.3


def test_a_robots_file_gets_the_constants(files: list[Path], tmp_path: Path) -> None:
    start, out = tmp_path / "bam.json", tmp_path / "mine.toml"
    start.write_text(json.dumps(BAM))
    words = (files[0], "--start", start, "--no-fit", "--robot", "xl330-16", "--robot-out", out)
    told = json.loads(run(*words, "--json"))
    before_deg, after_deg = told["robot_errors_deg"][str(files[0])]
    assert after_deg < 0.3 < before_deg
    robot, was = load_robot(str(out)), load_robot("xl330-16")
    motor = motors_of(robot)[3]
    for name in ("torque_constant_n_m_a", "resistance_ohm"):
        assert getattr(motor, name) == pytest.approx(PLANTED[name])
    assert float(p_gain_per_rad(400, motor)) == pytest.approx(400 * PLANTED["p_unit_per_rad"])
    assert gears_of(robot)[3].dry_n_m == PLANTED["dry_n_m"]
    assert gears_of(robot)[3].armature_kg_m2 == PLANTED["armature_kg_m2"]
    assert robot.over_current_a == was.over_current_a
    assert robot.model_copy(update={"name": was.name, "servo": was.servo}) == was
    assert "mine.toml: exists; --force" in refused(*words)
    assert "its simulated servo is" in run(*words, "--force")


def test_joints_with_another_servo_keep_theirs() -> None:
    joints = [{}] * 15 + [{"model": "XL430-W250"}]
    robot = with_keys(load_robot("xl330-16"), {"joints": joints}, "mixed")
    values = np.array([constant.start for constant in CONSTANTS])
    unknown = np.full(len(values), np.nan)
    known = robot_with(robot, ServoConstants(values, unknown, unknown, "xl330"))
    assert known.motors[0] is not None
    assert known.motors[15] is None
    assert known.armatures_kg_m2 == (0.002,) * 16
    assert known.gear_drags_n_m_s == (0.02,) * 15 + (0.006,)
    assert motors_of(known)[15] == motors_of(robot)[15]


def test_what_is_refused_of_a_robot(files: list[Path], tmp_path: Path) -> None:
    start, out = tmp_path / "bam.json", tmp_path / "mine.toml"
    start.write_text(json.dumps(BAM))
    words = (files[0], "--start", start, "--no-fit")
    assert "go together" in refused(*words, "--robot", "xl330-16")
    assert "go together" in refused(*words, "--robot-out", out)
    json_out = tmp_path / "mine.json"
    assert "ends in .toml" in refused(*words, "--robot", "xl330-16", "--robot-out", json_out)
    assert "of a servo xl330, robot yaw16 has XM430-W350" in refused(
        *words, "--robot", "yaw16", "--robot-out", out
    )
    assert "the robot of a run is in its log" in refused("a.mcap", "--robot", "yaw16")
    assert "ends in .toml" in refused("a.mcap", "--robot-out", json_out)
    assert not out.exists()


def test_what_is_refused(files: list[Path], tmp_path: Path) -> None:
    bad = tmp_path / "bad.json"
    bad.write_text("{")
    assert "bad.json: is not JSON" in refused(bad)
    bad.write_text('{"kp": 200, "entries": []}')
    assert "mass: is missing" in refused(bad)
    bad.write_text(json.dumps({"mass": 1, "length": 1, "kp": 1, "entries": [{"position": 1}]}))
    assert "is not a log of a pendulum" in refused(bad)
    bad.write_text(json.dumps(BAM | {"model": "m7"}))
    assert "model is 'm7'" in refused(files[0], "--start", bad)
    bad.write_text(json.dumps(BAM | {"kt": "much"}))
    assert "kt: expected a number, found much" in refused(files[0], "--start", bad)
    assert "give them with --start" in refused(files[0], "--no-fit")
    other = json.loads(files[1].read_text()) | {"motor": "mx64"}
    bad.write_text(json.dumps(other))
    assert "several servos: mx64, xl330" in refused(files[0], bad)
    assert "no/such.json: No such file" in refused("no/such.json")


@pytest.mark.parametrize("line", ["resistance ohm", "mean"])
def test_a_person_reads_a_table(files: list[Path], tmp_path: Path, line: str) -> None:
    start = tmp_path / "bam.json"
    start.write_text(json.dumps(BAM))
    assert line in run(files[0], "--start", start, "--no-fit")


def test_ranges_follow_the_data_of_a_servo() -> None:
    """An STS3215 has 0.165 of full output for a radian and unit (Rhoban, on an oscilloscope)."""
    at = NAMES.index("p_unit_per_rad")
    feetech, unshipped, xl330 = (ranges(name) for name in ("sts3215", "sts3032", "xl330"))
    assert feetech.low[at] < 0.165 / 2.0
    assert feetech.high[at] > 0.165 * 2.0
    assert unshipped.high[at] == feetech.high[at]
    assert (xl330.low[at], xl330.high[at]) == pytest.approx((5e-4, 2e-2))
    assert ranges("").high[at] > feetech.high[at]


def test_a_constant_on_a_bound_is_reported() -> None:
    searched = ranges("sts3215")
    values = searched.start.copy()
    values[NAMES.index("dry_n_m")] = 0.0  # no friction is a value
    assert searched.bounds_reached(values) == {}
    values[NAMES.index("p_unit_per_rad")] = searched.high[NAMES.index("p_unit_per_rad")]
    values[NAMES.index("offset_rad")] = searched.low[NAMES.index("offset_rad")]
    assert searched.bounds_reached(values) == {
        "offset_rad": (-0.13, "lower"),
        "p_unit_per_rad": (searched.high[NAMES.index("p_unit_per_rad")], "upper"),
    }
