"""The command line on paper: plans, lists, and refuses bad input with exit code 2."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.controller.run.factory import prepare_walk
from tests.helpers.command import snakewalk


@pytest.mark.slow
@pytest.mark.parametrize("run", ["flat-square", "flat-slalom"])
@pytest.mark.parametrize("motion", ["walk", "serpenoid"])
def test_the_walk_and_the_baseline_reach_every_waypoint_on_paper(run: str, motion: str) -> None:
    prepared = prepare_walk(run, motion=motion, seed=3)
    ahead = prepared.forecast()
    assert ahead.reached == len(prepared.run.waypoints_m)
    assert ahead.joint_speed_rad_s.max() <= 1.1 * prepared.robot.joint_speed_limit_rad_s


@pytest.mark.slow
def test_without_feedback_slip_carries_the_body_off_its_path() -> None:
    prepared = prepare_walk("flat-slalom", motion="walk-blind", time_limit_s=80.0)
    assert prepared.forecast().reached < 5


def test_the_same_seed_gives_the_same_joints_bit_for_bit() -> None:
    one, two = (prepare_walk("flat-slalom", seed=5, time_limit_s=8.0).forecast() for _ in range(2))
    assert one.joint_rad.tobytes() == two.joint_rad.tobytes()
    other = prepare_walk("flat-slalom", seed=6, time_limit_s=8.0).forecast()
    assert not np.array_equal(one.joint_rad, other.joint_rad)


def test_a_plan_as_json() -> None:
    done = snakewalk("plan", "flat-slalom", "--motion", "serpenoid", "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["waypoints_reached"] == found["waypoints"] == 5
    assert found["friction_law"] == "ellipse"


@pytest.mark.slow_cases(1, "2 cases of 1.0 s of CPU")
@pytest.mark.slow
@pytest.mark.parametrize(("program", "warnings"), [("/nosuch/relay", 1), (sys.executable, 0)])
def test_a_stop_output_that_cannot_be_started_is_a_warning(program: str, warnings: int) -> None:
    """The run rejected it after a plan without a warning."""
    output = f"run.safety.stop_output=command:{program}"
    done = snakewalk("plan", "flat-square", "--json", "--set", output)
    found = json.loads(done.stdout)["warnings"]
    assert len(found) == warnings
    assert all(f"stop output {program}: no such program" in line for line in found)


@pytest.mark.costs("plans a route")
def test_a_plan_tells_the_slopes_under_the_body_and_warns() -> None:
    done = snakewalk("plan", "ramp-15-up", "--motion", "serpenoid", "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["under_body_slope_median_deg"] == 15.0
    assert found["up_slope_max_deg"] == 15.0
    assert found["side_slope_max_deg"] == 0.0
    steep, climb = found["warnings"]
    assert steep.startswith("waypoint 1 (0.00, 0.00) is on a slope of 15.0 deg")
    assert climb == "the path climbs 15.0 deg; the world's climb limit is 11.5 deg"


@pytest.mark.nightly("a further walk: 4 s of CPU")
def test_a_section_that_the_body_cannot_climb_is_reported_by_plan_and_run() -> None:
    keys = {"world.ground.slope_deg": 18.0, "world.planner.variance_limit_m2": 0.01}
    words = [word for key, value in keys.items() for word in ("--set", f"{key}={value}")]
    done = snakewalk("plan", "ramp-10-up", "--motion", "serpenoid", *words, "--json")
    assert done.returncode == 1, "the forecast does not arrive"
    found = json.loads(done.stdout)
    (section,) = found["too_steep"]
    assert section["slope_deg"] == 18.0
    assert section["end_m"] - section["begin_m"] > 2.0
    line = found["warnings"][0]
    assert line.startswith("the path climbs 18.0 deg from 0.8 to 4.0 m, beginning at (-1.56, ")
    assert ": this body is known to climb 15.5 deg; " in line

    events = list[tuple[str, str]]()
    prepared = prepare_walk("ramp-10-up", motion="serpenoid", keys=keys)
    prepared.make_source(lambda kind, text: events.append((kind, text)))
    assert events == [("climb", line)]
    advice = "add --motion walk --set run.walk.pitch.p_gain=800 --set "
    assert advice in line
    keys |= {"run.walk.pitch.p_gain": 800, "run.walk.pitch.current_limit_a": 0.4}
    (rolls,) = prepare_walk("ramp-10-up", keys=keys).climb_warnings
    assert rolls.endswith("its pitch joints let it roll up there")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["plan", "nosuch"], "nosuch: no such run"),
        (["plan", "missing.toml"], "missing.toml: no such file"),
        (["plan", "--motion", "fly"], "motion"),
        (["plan", "--seed", "-1"], "seed"),
    ],
)
def test_bad_input_is_one_clear_line_and_exit_code_2(words: list[str], said: str) -> None:
    done = snakewalk(*words)
    assert done.returncode == 2
    assert said in done.stderr
    assert "Traceback" not in done.stderr
    assert done.stdout == ""


def test_a_robot_that_cannot_bend_enough_is_refused_before_torque(tmp_path: Path) -> None:
    (tmp_path / "stiff.toml").write_text(
        'name = "stiff"\njoint_axes = "yyyyyyyy"\nlink_length_m = 0.13\nyaw_limit_rad = 0.1\n'
    )
    run = tmp_path / "run.toml"
    run.write_text('name = "r"\nrobot = "stiff.toml"\nwaypoints_m = [[2, 0]]\n')
    with pytest.raises(InputError, match="joint limits"):
        prepare_walk(str(run)).forecast()


def test_a_path_that_the_time_cannot_hold_is_told() -> None:
    far = prepare_walk("flat-square", motion="serpenoid", keys={"run.waypoints_m": [[100.0, 0.0]]})
    (told,) = far.warnings
    assert told.startswith("path: 100.0 m at a pulse of 0.30 m/s need at least 336 s"), told
    assert "speed of the walk with behaviour.pulse_body_lengths_s" in told
    assert prepare_walk("flat-square", motion="serpenoid").warnings == ()
