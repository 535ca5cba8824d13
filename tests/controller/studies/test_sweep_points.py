"""Points of a sweep: in the ranges, allowed by the robot, the same for the same seed."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot, locate
from snakewalk.controller.gaits.gait import fitting_robot, ranges
from snakewalk.controller.gaits.registry import GAITS
from snakewalk.controller.studies.sweep_measure import measure
from snakewalk.controller.studies.sweep_points import SLOWEST_HZ, Space, plan_sweep, points_of


@pytest.mark.parametrize("name", list(GAITS))
def test_points_are_in_range_and_within_the_joints(name: str) -> None:
    gait = GAITS[name]
    robot = load_robot(fitting_robot([gait.needs]) if gait.needs.legs else "alternating16")
    points, _ = points_of(gait, robot, 30, seed=3, seconds=10.0)
    assert len(points) == 30
    assert points[0].parameters == {}
    spans = ranges(gait.model)
    for point in points:
        gait.of(dict(point.parameters)).check(robot)  # raises where a joint would not bend so far
        for key, value in point.parameters.items():
            assert spans[key].low - 1e-3 <= value <= spans[key].high + 1e-3
    assert len({tuple(p.parameters.items()) for p in points}) == 30


@pytest.mark.costs("runs each point")
def test_replaced_values_go_with_each_point_into_its_run() -> None:
    pytest.importorskip("mujoco")
    keys = {"world.friction.across": 0.35, "robot.yaw_limit_rad": 0.7, "run.cycle_hz": 40}
    planned = plan_sweep(["lateral-undulation"], ["yaw16"], 2, seed=0, seconds=4.0, keys=keys)
    plain = plan_sweep(["lateral-undulation"], ["yaw16"], 2, seed=0, seconds=4.0)
    narrow, wide = planned.points[1], plain.points[1]
    assert narrow.parameters != wide.parameters  # its joints bend less
    assert planned.points[0].key != plain.points[0].key
    slick, usual = measure(planned.points[0]), measure(plain.points[0])
    assert slick.ended == usual.ended == "ran to its end"
    assert slick.speed_m_s is not None
    assert usual.speed_m_s is not None
    assert slick.speed_m_s < 0.95 * usual.speed_m_s
    with pytest.raises(InputError, match="did you mean"):
        plan_sweep(None, None, 1, seed=0, seconds=4.0, keys={"wrld.friction.across": 1})
    with pytest.raises(InputError, match="--param"):
        plan_sweep(None, None, 1, seed=0, seconds=4.0, keys={"run.gait.parameters.waves": 1})


def test_what_is_named_twice_is_drawn_once() -> None:
    twice = plan_sweep(["rolling"] * 2, ["alternating16"] * 2, 2, seed=0, seconds=4.0)
    assert len(twice.points) == 2


def test_a_robot_of_ones_own_is_loaded_again_in_another_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("mujoco")
    text = locate("robots", "yaw16").read_text().replace('"yaw16"', '"mine"')
    (tmp_path / "my.toml").write_text(text)
    monkeypatch.chdir(tmp_path)
    planned = plan_sweep(["lateral-undulation"], ["my.toml"], 1, seed=0, seconds=4.0)
    monkeypatch.chdir("/")
    (point,) = planned.points
    assert point.robot == str(tmp_path / "my.toml")
    assert measure(point).ended == "ran to its end"


def test_the_seed_decides_the_points() -> None:
    robot = load_robot("yaw16")
    gait = GAITS["lateral-undulation"]
    same = [points_of(gait, robot, 8, seed=5, seconds=10.0)[0] for _ in range(2)]
    assert same[0] == same[1]
    assert points_of(gait, robot, 8, seed=6, seconds=10.0)[0][1:] != same[0][1:]


@given(st.lists(st.floats(0.0, 1.0), min_size=4, max_size=4))
def test_unit_cube_and_parameters_are_inverse(unit: list[float]) -> None:
    space = Space.of(GAITS["lateral-undulation"])
    values = space.values(np.array(unit))
    assert values["frequency_hz"] >= SLOWEST_HZ
    assert np.allclose(space.unit(values), unit, atol=2e-3)


def test_robots_that_a_gait_does_not_fit_are_left_out() -> None:
    planned = plan_sweep(["sidewinding"], None, 4, seed=0, seconds=10.0)
    assert {point.robot for point in planned.points} == {"alternating16"}
    assert any("pitch" in line for line in planned.left_out)
    with pytest.raises(InputError, match="pitch"):
        plan_sweep(["sidewinding"], ["yaw16"], 4, seed=0, seconds=10.0)
    with pytest.raises(InputError) as caught:
        plan_sweep(["slither", "crawl"], None, 4, seed=0, seconds=10.0)
    assert len(caught.value.faults) == 2
