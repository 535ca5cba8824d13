"""Paths and trail of a film: what is in force is bright, what it replaced pale, on the ground."""

import mujoco
import numpy as np
import pytest

from snakewalk.config.arrays import Floats
from snakewalk.config.heightfield import HeightField
from snakewalk.config.loader import load_robot, load_world
from snakewalk.sim.rendering.film import _scale_m
from snakewalk.sim.rendering.looks import (
    REACHED,
    Marks,
    Scene,
    _contours,
    _legs,
    dressed_model,
    mark_reached,
)
from snakewalk.sim.rendering.trail import (
    AXES,
    AXES_GEOMS,
    CENTRE,
    FORMER,
    LIFT_M,
    MOST,
    PATH,
    TRAIL,
    Trail,
    add_axes,
    make_trail,
)

FIRST = np.array([[0.0, 0.0], [1.2, 0.0]])
SECOND = np.array([[0.6, 0.0, 0.0], [0.6, 1.2, 0.0]])
TIMES = np.linspace(0.0, 10.0, 501)
HEAD = np.column_stack([0.2 * TIMES, np.zeros_like(TIMES)])
CENTRE_M = HEAD - [0.5, 0.1]
SLOPE = HeightField(np.tile(np.arange(0.0, 2.01, 0.1), (21, 1)), 0.2, -2.0, -2.0)


def drawn(trail: Trail, now_s: float) -> list[mujoco.MjvGeom]:
    model = mujoco.MjModel.from_xml_string("<mujoco/>")
    scene = mujoco.MjvScene(model, maxgeom=trail.most)
    trail.add(scene, now_s)
    return list(scene.geoms[: scene.ngeom])


def of(geoms: list[mujoco.MjvGeom], rgba: tuple[float, ...]) -> Floats:
    same = [geom.pos.copy() for geom in geoms if np.allclose(geom.rgba, rgba)]
    return np.array(same).reshape(-1, 3)


def test_the_path_in_force_is_bright_and_the_one_before_it_pale() -> None:
    trail = make_trail([(0.0, FIRST), (4.0, SECOND)], TIMES, HEAD, CENTRE_M, None)
    before, after = drawn(trail, 3.9), drawn(trail, 4.0)
    assert np.ptp(of(before, PATH), axis=0) == pytest.approx([1.08, 0.0, 0.0], abs=1e-6)
    assert len(of(before, FORMER)) == 0
    assert np.ptp(of(after, PATH), axis=0) == pytest.approx([0.0, 1.08, 0.0], abs=1e-6)
    assert of(after, FORMER) == pytest.approx(of(before, PATH))


def test_the_trails_end_where_head_and_centre_are_and_their_ends_are_kept() -> None:
    trail = make_trail([], TIMES, HEAD, CENTRE_M, None)
    assert len(drawn(trail, 0.0)) == 0
    for rgba, y_m in ((TRAIL, 0.0), (CENTRE, -0.1)):
        line = of(drawn(trail, 5.0), rgba)
        assert len(line) == pytest.approx(1.0 / 0.03, abs=1)
        assert line[:, 1] == pytest.approx(y_m)
    long = make_trail([], 100.0 * TIMES, 100.0 * HEAD, 100.0 * HEAD, None)
    assert len(drawn(long, 1000.0)) == 2 * MOST <= long.most


def test_lines_lie_on_the_ground() -> None:
    trail = make_trail([(0.0, FIRST)], TIMES, HEAD[:, :2], CENTRE_M, SLOPE)
    for points_m in (*trail.dots_m, *(line.points_m for line in trail.lines)):
        elevation_m = SLOPE.elevation_m(points_m[:, 0], points_m[:, 1])
        assert points_m[:, 2] == pytest.approx(elevation_m + LIFT_M)
        assert np.ptp(points_m[:, 2]) > 0.4


def test_dots_beside_a_small_body_are_as_small_and_as_close() -> None:
    large, small = (
        make_trail([(0.0, FIRST)], TIMES, HEAD, CENTRE_M, None, size) for size in (1.0, 0.5)
    )
    assert small.dot_radius_m == 0.5 * large.dot_radius_m
    spacing_m = [np.diff(trail.dots_m[0][:, 0])[0] for trail in (large, small)]
    assert spacing_m[1] == pytest.approx(0.5 * spacing_m[0])


def test_a_run_without_a_path_has_none() -> None:
    assert make_trail([(0.0, np.zeros((0, 2)))], TIMES, HEAD, CENTRE_M, None).dots_m[0].shape == (
        0,
        3,
    )


def test_the_rods_show_the_axes_and_are_as_long_as_they_say() -> None:
    scene = mujoco.MjvScene(mujoco.MjModel.from_xml_string("<mujoco/>"), maxgeom=AXES_GEOMS)
    add_axes(scene, np.array([1.0, 2.0]), 0.2, None)
    assert [geom.label for geom in scene.geoms[: scene.ngeom] if geom.label] == ["0.2 m", "x", "y"]
    for axis, rgba in enumerate(AXES):
        [rod] = [geom for geom in scene.geoms if np.allclose(geom.rgba, rgba)]
        assert rod.pos[:2] == pytest.approx([0.9, 1.9] + 0.1 * np.eye(3)[axis, :2])
        assert rod.mat[:, 2] == pytest.approx(np.eye(3)[axis], abs=1e-6)
        assert rod.size[2] == pytest.approx(0.1)  # half


def test_no_hill_covers_a_rod() -> None:
    scene = mujoco.MjvScene(mujoco.MjModel.from_xml_string("<mujoco/>"), maxgeom=AXES_GEOMS)
    add_axes(scene, np.array([0.3, 0.4]), 0.2, SLOPE)
    for axis, rgba in enumerate(AXES):
        [rod] = [geom for geom in scene.geoms if np.allclose(geom.rgba, rgba)]
        along = np.linspace(-1.0, 1.0, 21)[:, None] * rod.size[2] * np.eye(3)[axis]
        x, y, z = (rod.pos + along).T
        assert (z - rod.size[0] >= SLOPE.elevation_m(x, y) - 1e-6).all()


@pytest.mark.parametrize("hollow", [False, True])
def test_waypoints_whose_arrival_is_not_measured_are_hollow(hollow: bool) -> None:
    robot, world = load_robot("yaw16"), load_world("flat")
    model = dressed_model(Scene(robot, world, None), Marks([(1.0, 0.0)], hollow=hollow))
    mark_reached(model, 0)
    opacity = {name: model.geom(name).rgba[3] for name in ("waypoint0", "waypoint0ring1")}
    assert opacity == dict.fromkeys(opacity, 0.0 if hollow else 1.0)
    assert tuple(model.geom("waypoint0ring0").rgba) == pytest.approx(REACHED)


@pytest.mark.parametrize(("length_m", "scale_m"), [(1.2, 0.2), (0.6, 0.1), (0.04, 0.005), (5, 1)])
def test_the_scale_is_a_round_length_of_a_fifth_of_the_body_at_most(
    length_m: float, scale_m: float
) -> None:
    assert _scale_m(length_m) == pytest.approx(scale_m)


def test_contour_lines_are_of_one_width_however_steep_the_ground_is() -> None:
    x = np.arange(2000.0)
    level = np.where(x < 1000, 0.02 * x, 20.0 + 0.005 * (x - 1000)) + 0.001
    covered = _contours(np.tile(level, (3, 1)))[1]
    widths = [covered[int(at) - 5 : int(at) + 5].sum() for at in (500, 850, 1199, 1599)]
    assert widths == pytest.approx([2.1] * 4, abs=0.25)
    assert _contours(np.full((4, 4), 3.0)) == pytest.approx(0.0)


def test_a_leg_has_one_colour_at_each_joint_and_those_of_the_other_side() -> None:
    robot, spec = load_robot("quadruped"), mujoco.MjSpec()
    for k in range(robot.link_count + len(robot.limb_joints)):
        spec.worldbody.add_body(name=f"link{k}")
    _legs(spec, robot)
    colours: dict[tuple[int, str], list[tuple[float, ...]]] = {}
    for k, joint in enumerate(robot.limb_joints):
        geoms = spec.body(f"link{robot.link_count + k}").geoms
        colours.setdefault((joint.pair, joint.side), []).append(tuple(geoms[0].rgba))
        balls = [g for g in geoms[1:] if not np.any(g.pos)]
        assert len(balls) == (joint.place > 0)
        for ball in balls:  # two capsules of one radius end here: neither may be seen
            assert ball.size[0] > geoms[0].size[0]
            np.testing.assert_array_equal(ball.rgba, geoms[0].rgba)
    assert colours[0, "left"] == colours[0, "right"] == colours[1, "left"]
