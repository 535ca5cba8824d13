"""Frictions planted in a simulated run come back inside their intervals; wrong logs are refused."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot, load_world
from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import FrictionConfig
from snakewalk.controller.cli.command_line import app
from snakewalk.controller.run.deviation import NO_DEVIATION
from snakewalk.controller.run.kinds.gait_factory import prepare_gait
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.runlog.reader import read_log
from snakewalk.controller.runlog.record import RunRecord
from snakewalk.controller.studies.identification.friction_fit import (
    FrictionLog,
    fit_friction,
    resistance_of,
    with_mass,
    with_resistance,
)
from snakewalk.controller.studies.identification.law_fit import LawFit, fit_laws
from tests.helpers.uneven import UNEVEN

PLANTED = {"along": 0.16, "across": 0.45}
DRAG = {"drag_along": 0.06, "drag_across": 1.4}


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Log of a short body that undulates, on a ground that is not the shipped one."""
    parameters = {"winding_rad": 0.9, "waves": 1.0}
    prepared = prepare_gait("lateral-undulation", robot="yaw16", parameters=parameters, seconds=4.0)
    robot = RobotConfig(name="short", joint_axes="yyyy", link_mass_kg=0.4)
    run = prepared.run.model_copy(update={"physics_step_s": 0.005, "cycle_hz": 25.0})
    friction = FrictionConfig(**PLANTED)
    world = prepared.world.model_copy(update={"friction": friction})
    folder = tmp_path_factory.mktemp("run") / "planted"
    short = replace(prepared, robot=robot, run=run, world=world)
    return run_robot(RunRequest(short, folder, stoppable=False)).log


@pytest.mark.nightly("a complete identification: 5 s of CPU")
def test_a_planted_law_is_found(log: Path) -> None:
    """The same goals on ground with the law of scales, which moves the body far less."""
    given = FrictionLog.of(read_log(log), load_world("flat"))
    friction = FrictionConfig(**PLANTED, law="scales")
    seen = FrictionLog.simulated(given.with_friction(friction), NO_DEVIATION)
    seen = replace(seen, goals=given.goals)  # the file has another friction, and states no law
    found = fit_laws([seen])
    assert found.best == "scales"
    assert found.misfit["scales"] == 0.0
    assert min(found.misfit["ellipse"], found.misfit["wheels"]) > 1.0


def test_laws_that_fit_alike_are_not_decided() -> None:
    alike = LawFit({"ellipse": 0.0, "scales": 9.0, "wheels": 1.0})
    assert not alike.is_decided
    assert "cannot decide" in alike.text()
    clear = LawFit({"ellipse": 20.0, "scales": 0.0, "wheels": 17.0})
    assert clear.is_decided
    assert clear.text().startswith("law of friction: scales;")


@pytest.fixture(scope="module")
def record(log: Path) -> RunRecord:
    return read_log(log)


def refused(*words: str | Path) -> str:
    done = CliRunner().invoke(app, ["robot", "identify", *map(str, words)])
    assert isinstance(done.exception, InputError), done.output
    return str(done.exception)


@pytest.mark.nightly("a whole identification: 8 s of CPU")
def test_planted_friction_comes_back_and_goes_into_a_world(log: Path, tmp_path: Path) -> None:
    out = tmp_path / "found.toml"
    words = (
        "robot",
        "identify",
        str(log),
        "--world",
        "flat",
        "--workers",
        "1",
        "-o",
        str(out),
        "--json",
    )
    done = CliRunner().invoke(app, words, catch_exceptions=False)
    told = json.loads(done.stdout)
    true = PLANTED | {"across_over_along": PLANTED["across"] / PLANTED["along"]}
    for name, value in true.items():
        low, high = told["interval_95"][name]
        assert low <= value <= high, (name, told)
        assert told["friction"][name] == pytest.approx(value, rel=0.1)
    assert told["not_told"] == []
    (before_mm, after_mm) = told["errors"][str(log)]["way_mm"]
    assert after_mm < 0.1 * before_mm
    world = load_world(str(out))
    assert (world.name, world.ground.kind) == ("found", "flat")
    assert world.friction.along == pytest.approx(told["friction"]["along"], rel=1e-3)
    assert told["settings"][0] == f"world.friction.along={world.friction.along:.4g}"
    assert "found.toml: exists" in refused(log, "-o", out)


@pytest.mark.slow
def test_a_body_without_its_currents_still_tells_the_ratio(record: RunRecord) -> None:
    given = FrictionLog.of(record, load_world("flat"))
    answers = given.answers.copy()
    answers[0] = np.nan
    fit = fit_friction([replace(given, answers=answers)])
    ratio = fit.found["across_over_along"]
    assert ratio.determined
    assert ratio.low <= PLANTED["across"] / PLANTED["along"] <= ratio.high


def test_what_tells_no_friction_is_refused(record: RunRecord, log: Path, tmp_path: Path) -> None:
    header = record.header
    estimated = replace(header, run=header.run.model_copy(update={"pose": "imu"}))
    with pytest.raises(InputError, match="estimated by imu, which assumes the friction"):
        FrictionLog.of(replace(record, header=estimated))
    on_metal = replace(header, backend="dynamixel")
    with pytest.raises(InputError, match="estimated by the IMU or the joints"):
        FrictionLog.of(replace(record, header=on_metal))
    with pytest.raises(InputError, match="needs a level floor"):
        FrictionLog.of(record, load_world("ramp-10"))
    pose = replace(record.pose, links_m=np.full_like(record.pose.links_m, np.nan))
    with pytest.raises(InputError, match="does not hold where the body was"):
        FrictionLog.of(replace(record, pose=pose))
    still = replace(record.pose, links_m=record.pose.links_m[:1] + 0.0 * record.pose.links_m)
    with pytest.raises(InputError, match="less than 20 mm in each second"):
        FrictionLog.of(replace(record, pose=still))
    recording = tmp_path / "kp200.json"
    recording.write_text("{}")
    assert "give one kind" in refused(log, recording)
    assert "and --backlash: are for pendulums" in refused(log, "--start", recording)
    assert "ends in .toml" in refused(log, "-o", tmp_path / "a.json")
    assert "a pendulum has none" in refused(recording, "--world", "flat")
    assert "No such file" in refused(tmp_path / "none.mcap")


@pytest.fixture(scope="module")
def swimming(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Log of a short body that swims, in water that is not the shipped one."""
    prepared = prepare_gait("anguilliform", robot="yaw16", seconds=5.0)
    robot = RobotConfig(name="short", joint_axes="y" * 8, link_mass_kg=0.2)
    run = prepared.run.model_copy(update={"physics_step_s": 0.005, "cycle_hz": 25.0})
    water = prepared.world.ground.model_copy(update=DRAG)
    world = prepared.world.model_copy(update={"ground": water})
    folder = tmp_path_factory.mktemp("swim") / "planted"
    short = replace(prepared, robot=robot, run=run, world=world)
    return run_robot(RunRequest(short, folder, stoppable=False)).log


def test_a_log_in_water_begins_at_its_start_and_tells_the_drag(swimming: Path) -> None:
    log = FrictionLog.of(read_log(swimming), load_world("pool"))
    part, names = resistance_of(log.goals.world)
    assert (part.kind, names) == ("water", ("drag_along", "drag_across"))
    linear = part.model_copy(update={"linear_along_m_s": 0.1})
    world = with_resistance(log.goals.world, linear)
    assert resistance_of(world)[1][2:] == ("linear_along_m_s",)
    true = part.model_copy(update=DRAG)
    again = FrictionLog.simulated(log.with_friction(true), NO_DEVIATION)
    np.testing.assert_allclose(again.motion, log.motion, atol=2e-3)
    assert log.errors(part)[0] > 5.0 * log.errors(true)[0]
    with pytest.raises(InputError, match="needs a level floor"):
        FrictionLog.of(read_log(swimming), load_world("shore"))


@pytest.mark.nightly("a complete identification: 8 s of CPU")
def test_planted_drag_comes_back_and_goes_into_a_world(swimming: Path, tmp_path: Path) -> None:
    out = tmp_path / "pool2.toml"
    words = ("robot", "identify", str(swimming), "--world", "pool", "--workers", "1")
    done = CliRunner().invoke(app, [*words, "-o", str(out), "--json"], catch_exceptions=False)
    told = json.loads(done.stdout)
    for name, value in DRAG.items():
        low, high = told["interval_95"][name]
        assert low <= value <= high, (name, told)
    assert told["law"] is None
    assert told["settings"][0].startswith("world.ground.drag_along=")
    water = load_world(str(out)).ground
    assert water.kind == "water"
    assert water.drag_along == pytest.approx(told["friction"]["drag_along"], rel=1e-3)


@pytest.fixture(scope="module")
def lifting(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Log of a short body that winds sideways and lifts, heavier than a robot's file would say."""
    prepared = prepare_gait("sidewinding", robot="alternating12", seconds=4.0)
    robot = RobotConfig(name="short", joint_axes="ypypyp", link_mass_kg=0.13)
    run = prepared.run.model_copy(update={"physics_step_s": 0.005, "cycle_hz": 25.0})
    folder = tmp_path_factory.mktemp("run") / "lifting"
    return run_robot(
        RunRequest(replace(prepared, robot=robot, run=run), folder, stoppable=False)
    ).log


@pytest.mark.nightly("fits lifts of a whole body: 12 s of CPU")
def test_a_planted_mass_comes_back_and_goes_into_a_robot(
    lifting: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The file says 0.1 kg a link where it is 0.13."""
    record, out = read_log(lifting), tmp_path / "mine.toml"
    light = with_mass(record.header.robot, 0.1 / 0.13)
    believed = replace(record, header=replace(record.header, robot=light))
    monkeypatch.setattr("snakewalk.controller.runlog.reader.read_log", lambda path: believed)
    words = ("robot", "identify", str(lifting), "--workers", "1", "--robot-out", str(out), "--json")
    told = json.loads(CliRunner().invoke(app, words, catch_exceptions=False).stdout)
    low_kg, high_kg = told["mass_interval_95_kg"]
    assert low_kg < 0.91 < high_kg < 1.3 * low_kg
    assert told["mass_kg"] == pytest.approx(0.91, rel=0.03)
    robot = load_robot(str(out))
    assert robot.mean_link_mass_kg == pytest.approx(0.13, rel=0.03)
    same = {"name": light.name, "link_mass_kg": light.mean_link_mass_kg}
    assert robot.model_copy(update=same) == light
    assert "mine.toml: exists; --force" in refused(lifting, "--robot-out", out)


def test_what_tells_no_mass_says_what_would(log: Path, lifting: Path, tmp_path: Path) -> None:
    out = tmp_path / "mine.toml"
    assert "has no pitch joints" in refused(log, "--robot-out", out)
    still = FrictionLog.of(read_log(lifting))
    still.answers[1][:, list(still.goals.robot.pitch_joints)] = 0.05
    with pytest.raises(InputError, match=r"lift nothing.*gait run sidewinding --robot short"):
        fit_friction([still], mass=True)
    assert not out.exists()


def test_links_with_a_mass_of_their_own_are_scaled_as_well() -> None:
    heavier = with_mass(UNEVEN, 1.5)
    expected = 1.5 * np.array(UNEVEN.link_masses_kg)
    np.testing.assert_allclose(heavier.link_masses_kg, expected, rtol=1e-5)
