"""Robots of other servos, written from the pages alone, through every command that runs one."""

import re
from functools import cache, partial
from pathlib import Path

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot, load_world
from snakewalk.config.robot import RobotConfig, ServoConfig
from snakewalk.config.run import SafetyConfig
from snakewalk.config.servo_catalogue import servo_model
from snakewalk.controller.cli.main import main
from snakewalk.controller.repertoire import repertoire_recording
from snakewalk.controller.repertoire.repertoire_recording import ACTIONS, record
from snakewalk.controller.run.factory import prepare_playback, prepare_walk
from snakewalk.controller.run.kinds.gait_factory import prepare_gait
from snakewalk.controller.runlog.reader import read_log
from snakewalk.controller.studies import tune
from snakewalk.controller.studies.sweep_measure import Measurement, measure
from snakewalk.controller.studies.sweep_points import Point
from snakewalk.drivers.chain.joint_codec import JointUnits
from snakewalk.drivers.protocol.registers import ServoUnits
from snakewalk.drivers.safety.limits import SafetyLimits
from snakewalk.sim.servo.register_rules import simulated_models
from tests.helpers.in_process import leave_out_pages, work_in_this_process
from tests.helpers.tiers import slow_after

_DOCS = Path(__file__).resolve().parents[3] / "docs"
_RUN = """
name = "short"
motion = "serpenoid"
waypoints_m = [[0.4, 0.0]]
waypoint_radius_m = 0.15
time_limit_s = 8.0
"""


def _from_pages() -> dict[str, str]:
    """Robot files as ``configuration.md`` and ``how-to/servos-of-other-kinds.md`` print them."""
    found = {}
    for name, page in (("my-robot", "configuration"), ("my-xl430", "how-to/servos-of-other-kinds")):
        text = (_DOCS / f"{page}.md").read_text(encoding="utf-8")
        block = re.search(rf"# {name}\.toml\n(.*?)```", text, re.DOTALL)
        assert block is not None
        found[name] = block[1]
    return {"xl330.toml": found["my-robot"], "xl430.toml": found["my-xl430"]}


def _robot(servo: ServoConfig) -> RobotConfig:
    return RobotConfig(name="x", joint_axes="yy", servo=servo)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Working folder with both robots and a short run."""
    for name, text in _from_pages().items():
        (tmp_path / name).write_text(text)
    (tmp_path / "short.toml").write_text(_RUN)
    time_s = np.arange(31) / 30.0
    wave = 0.2 * np.sin(2.0 * time_s[:, None] + np.arange(12) / 3.0)
    np.savez(tmp_path / "bends.npz", angles_rad=wave, rate_hz=30.0)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.slow_cases(1, "every command for each model")
@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("robot", ["xl330.toml", "xl430.toml"])
@pytest.mark.parametrize(
    "words",
    slow_after(
        1,
        [
            "run short.toml --no-film",
            "gait run lateral-undulation --seconds 2 --no-film",
            "play bends.npz --no-film",
            "gait sweep lateral-undulation --points 1 --seconds 4 -o sweep.csv",
            "gait tune lateral-undulation --budget 16 --seconds 4 --seeds 1",
            "gait repertoire record",
            "trials run short.toml --motion serpenoid --seeds 1 -o t.csv",
        ],
    ),
)
def test_a_robot_from_the_pages_goes_through_every_command(
    words: str,
    robot: str,
    folder: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    @cache
    def measured_once(robot: str) -> Measurement:
        return measure(Point("lateral-undulation", robot, "flat", 0, 0, 4.0))

    work_in_this_process(monkeypatch)
    leave_out_pages(monkeypatch)
    one = tuple(action for action in ACTIONS if action.name == "forward-fast")
    monkeypatch.setattr(repertoire_recording, "record", partial(record, actions=one))
    # the search itself is tested elsewhere: here each of its runs is the same one
    monkeypatch.setattr(tune, "measure", lambda point, vary=0: measured_once(point.robot))
    monkeypatch.setattr("sys.argv", ["snakewalk", *words.split(), "--robot", robot])
    with pytest.raises(SystemExit) as end:
        main()
    assert not end.value.code, capsys.readouterr().err
    for log in folder.glob("runs/*/log.mcap"):
        log_read = read_log(log)
        assert (
            np.nanmax(np.abs(log_read.cycle.current_a)) > 0.01
        )  # of both kinds, something is watched
    for table in folder.glob("*.csv"):
        assert "refused" not in table.read_text()


def test_a_supply_that_the_servos_do_not_take_is_refused_with_theirs(folder: Path) -> None:
    """Without ``supply_v`` it is 12 V: a small servo would answer with its alarm alone."""
    (folder / "bare.toml").write_text(
        'name = "bare"\njoint_axes = "yyyyyyyyyyyy"\n[servo]\nmodel = "XL330-M288"\n'
    )
    said = r"robot bare: servo\.supply_v = 12: XL330-M288 accepts 3\.1 to 7 V; use supply_v = 5$"
    for prepare in (
        lambda: prepare_walk("short.toml", robot="bare.toml"),
        lambda: prepare_gait("lateral-undulation", robot="bare.toml"),
        lambda: prepare_playback("worm-like", robot="bare.toml"),
        lambda: record(load_robot("bare.toml"), load_world("flat")),
    ):
        with pytest.raises(InputError, match=said):
            prepare()


def test_a_limit_belongs_to_the_servo_and_can_trip() -> None:
    for model in simulated_models():
        robot, stall_a = _robot(ServoConfig(model=model)), servo_model(model).stall_current_a
        assert stall_a is not None
        limit_a = SafetyLimits.from_config(robot, SafetyConfig()).current_limit_a
        assert 0.8 * stall_a < limit_a < stall_a
    with pytest.raises(ValueError, match=r"XL330-M288 draws 1.47 A at most and would never trip"):
        _robot(ServoConfig(model="XL330-M288", supply_v=5.0, over_current_a=2.0))
    with pytest.raises(ValueError, match="stall current of PH54-100-S500 is not known"):
        _robot(ServoConfig(model="PH54-100-S500", supply_v=24.0))


def test_a_runs_limit_that_no_servo_reaches_is_refused(folder: Path) -> None:
    (folder / "loose.toml").write_text(f"{_RUN}[safety]\ncurrent_limit_a = 2.0\n")
    with pytest.raises(InputError, match=r"safety.current_limit_a = 2: XL330-M288 draws 1.47 A"):
        prepare_walk("loose.toml", robot="xl330.toml")


def test_protocol_1_is_refused_with_what_it_lacks(folder: Path) -> None:
    (folder / "ax.toml").write_text('name = "ax"\njoint_axes = "yy"\n[servo]\nmodel = "AX-12A"\n')
    with pytest.raises(InputError, match=r"model AX-12A speaks Protocol 1.0"):
        load_robot("ax.toml")


def test_load_is_read_as_its_share_of_the_stall_current() -> None:
    units = ServoUnits.of(servo_model("XL430-W250"))
    assert not units.measures_current
    assert units.current_a(np.array([-1000, 0, 500])) == pytest.approx([-1.3, 0.0, 0.65])
    joints = JointUnits.of(_robot(ServoConfig(model="XL430-W250")), [units, units])
    assert joints.pwm_raw(1, 0.13, 885) == 88  # a tenth of the stall current: of 885, a tenth
    assert joints.pwm_raw(1, 9.0, 800) == 800


def test_pitch_joints_that_carry_stay_below_the_current_that_trips(folder: Path) -> None:
    for model, carry_a in (("XM430-W350", 1.5), ("XL330-M288", 0.96), ("XC330-T181", 0.52)):
        volts = {"XL": 5.0, "XC": 11.1, "XM": 12.0}[model[:2]]
        (folder / "p.toml").write_text(
            f'name = "p"\njoint_axes = "ypypypypypyp"\n[servo]\nmodel = "{model}"\n'
            f"supply_v = {volts}\n"
        )
        servo = prepare_gait("sidewinding", robot="p.toml").robot.servo
        assert servo.pitch_current_limit_a == pytest.approx(carry_a, abs=0.01)
