"""The drawn robot: its skin lies on the ground, its eyes look ahead, and a waypoint is a pole."""

import mujoco
import numpy as np
import pytest

from snakewalk.config.loader import load_robot, load_world
from snakewalk.config.robot import RobotConfig
from snakewalk.sim.rendering.looks import (
    AHEAD,
    BACK,
    EYE,
    HIDDEN,
    PUPIL,
    Marks,
    Scene,
    dressed_model,
)

ROBOT = load_robot("yaw16")
CAPSULE, CYLINDER, SPHERE = (
    int(kind)
    for kind in (
        mujoco.mjtGeom.mjGEOM_CAPSULE,
        mujoco.mjtGeom.mjGEOM_CYLINDER,
        mujoco.mjtGeom.mjGEOM_SPHERE,
    )
)


def drawn(robot: RobotConfig = ROBOT, marks: Marks | None = None) -> mujoco.MjModel:
    scene = Scene(robot, load_world("flat"), None)
    return dressed_model(scene) if marks is None else dressed_model(scene, marks=marks)


def of_colours(model: mujoco.MjModel, kind: int, *colours: tuple[float, ...]) -> np.ndarray:
    same = [np.abs(model.geom_rgba - np.array(colour)).max(axis=1) < 1e-6 for colour in colours]
    return np.flatnonzero(np.any(same, axis=0) & (model.geom_type == kind))


def skin(model: mujoco.MjModel) -> np.ndarray:
    return of_colours(model, CAPSULE, *BACK)


def test_the_skin_swells_to_the_middle_tapers_to_the_tail_and_lies_on_the_ground() -> None:
    model = drawn()
    geoms = skin(model)
    radius = np.array(ROBOT.link_radii_m)[1:]
    thick = model.geom_size[geoms, 0]
    assert len(geoms) == ROBOT.link_count - 1
    assert (thick <= radius + 1e-12).all()
    along = np.arange(1, ROBOT.link_count) / (ROBOT.link_count - 1)
    widest = int(np.argmax(thick / radius))
    assert along[widest] == pytest.approx(0.55, abs=0.07)
    share = thick / radius
    assert (np.diff(share)[:widest] > 0.0).all()
    assert (np.diff(share)[widest:] < 0.0).all()
    assert share[-1] == pytest.approx(0.45, abs=0.01)
    # the lower edge is where that of the link itself is
    np.testing.assert_allclose(model.geom_pos[geoms, 2] - thick, -radius, atol=1e-9)


def test_a_link_without_a_length_has_no_skin() -> None:
    lengths_m = [0.07, 0.0, 0.07, 0.0, 0.07]
    links = [{"length_m": length_m} for length_m in lengths_m]
    robot = RobotConfig.model_validate({"name": "crossed", "joint_axes": "ypyp", "links": links})
    assert robot.link_lengths_m == tuple(lengths_m)
    assert len(skin(drawn(robot))) == 2


def test_two_eyes_look_to_both_sides_of_the_front() -> None:
    model = drawn()
    left, right = sorted(of_colours(model, SPHERE, EYE), key=lambda geom: -model.geom_pos[geom, 1])
    one, other = model.geom_pos[left], model.geom_pos[right]
    np.testing.assert_allclose(one * [1.0, -1.0, 1.0], other, atol=1e-12)
    assert (one > 0.0).all()
    assert one[1] < ROBOT.link_radii_m[0]
    pupils = of_colours(model, SPHERE, PUPIL)
    assert len(pupils) == 2
    for pupil, eye in zip(
        sorted(pupils, key=lambda k: -model.geom_pos[k, 1]), (left, right), strict=True
    ):
        off = model.geom_pos[pupil] - model.geom_pos[eye]
        small, large = model.geom_size[[pupil, eye], 0]
        assert small < large
        assert large - small < np.linalg.norm(off) < large, "it shows, and does not come off"
        assert off[0] > 0.0


@pytest.mark.parametrize("hollow", [False, True])
def test_a_waypoint_is_a_pole_on_the_ground_in_a_ring(hollow: bool) -> None:
    marks = Marks([(1.0, 2.0)], 0.25, hollow=hollow)
    model = drawn(marks=marks)
    pole = model.geom("waypoint0")
    assert int(pole.type[0]) == CYLINDER
    assert pole.pos[2] == pytest.approx(pole.size[1])  # from the ground on
    assert 0.2 < 2.0 * pole.size[1] < 0.5
    assert 0.0 < pole.size[0] < 0.02
    np.testing.assert_allclose(pole.pos[:2], (1.0, 2.0))
    np.testing.assert_allclose(pole.rgba, HIDDEN if hollow else AHEAD, atol=1e-6)
    part = model.geom("waypoint0ring0")
    assert np.hypot(*(part.pos[:2] - pole.pos[:2])) == pytest.approx(0.25, rel=0.05)
