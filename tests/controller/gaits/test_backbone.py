"""Curves in space in, joint angles out: closed forms, exact links, and honest residuals."""

import numpy as np
import pytest
from numpy.typing import NDArray

from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot, load_world
from snakewalk.controller.gaits.backbone import fit_backbone
from snakewalk.controller.kinematics.links import body_in_world, chain_axes, chain_points_m
from snakewalk.sim.physics.plant import MujocoPlant
from tests.helpers.physics import link_rotations

Floats = NDArray[np.float64]
ROBOTS = ("yaw16", "alternating16", "alternating32")
RUN = np.linspace(0.0, 1.5, 400)


def helix(radius_m: float, rise_rad: float, hand: float = 1.0) -> Floats:
    """From the head, which is on top, down."""
    turn = RUN * np.cos(rise_rad) / radius_m
    return np.stack(
        [radius_m * np.cos(turn), -hand * radius_m * np.sin(turn), -RUN * np.sin(rise_rad)], axis=1
    )


def arc(radius_m: float) -> Floats:
    """Head at 0 facing along x, the body behind on a circle to its right."""
    turn = RUN / radius_m
    return np.stack([-radius_m * np.sin(turn), radius_m * (np.cos(turn) - 1.0), 0 * RUN], axis=1)


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("way", [(-1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.6, -0.48, 0.64)])
def test_straight_is_all_zeros_whatever_its_direction(
    name: str, way: tuple[float, float, float]
) -> None:
    fit = fit_backbone(load_robot(name), RUN[:, None] * np.array(way))
    assert np.abs(fit.joint_rad).max() < 1e-6
    assert fit.residual_m < 1e-7
    np.testing.assert_allclose(fit.head_rotation[:, 0], -np.array(way), atol=1e-6)


@pytest.mark.parametrize("radius_m", [0.3, 0.5, 2.0])
def test_an_arc_is_met_exactly_by_yaw_joints(radius_m: float) -> None:
    """Links are chords: each joint turns by twice the angle between chord and tangent."""
    robot = load_robot("yaw16")
    fit = fit_backbone(robot, arc(radius_m))
    bend = 2.0 * np.arcsin(robot.mean_link_length_m / (2.0 * radius_m))
    np.testing.assert_allclose(np.abs(fit.joint_rad), bend, atol=1e-5)
    assert len(set(np.sign(fit.joint_rad))) == 1
    assert fit.residual_m < 1e-6


def test_a_bend_to_the_left_and_one_upwards_have_our_signs() -> None:
    """Head side turned left: positive yaw; head side lifted: positive pitch."""
    turn = RUN / 0.5
    behind = np.stack([-0.5 * np.sin(turn), 0.5 * (1.0 - np.cos(turn)), 0 * RUN], axis=1)
    robot = load_robot("alternating16")
    left = fit_backbone(robot, behind).joint_rad  # it came from the left and has turned left
    assert (left[list(robot.yaw_joints)] > 0.1).all()
    up = fit_backbone(robot, behind[:, [0, 2, 1]]).joint_rad  # it came from above
    assert (up[list(robot.pitch_joints)] > 0.1).all()


@pytest.mark.fast_cases(3)
@pytest.mark.parametrize(("name", "most_m"), [("alternating16", 0.011), ("alternating32", 0.003)])
@pytest.mark.parametrize("hand", [1.0, -1.0])
@pytest.mark.parametrize("roll_rad", [0.0, 0.7])
def test_a_helix_is_met_within_a_part_of_the_body(
    name: str, most_m: float, hand: float, roll_rad: float
) -> None:
    """Joints of one axis alternate: a chain of links of 70 mm zigzags about a helix."""
    robot = load_robot(name)
    curve = helix(0.13, 0.35, hand)
    fit = fit_backbone(robot, curve, roll_rad)
    seed = fit_backbone(robot, curve, roll_rad, refine=False)
    print(f"{name}: {1e3 * fit.residual_m:.2f} mm, first step {1e3 * seed.residual_m:.2f} mm")
    assert fit.residual_m < most_m
    assert fit.residual_m < 0.5 * seed.residual_m


def test_first_step_is_the_closed_form_of_a_helix() -> None:
    """Amplitude ``2 k sin(t l) / t`` with curvature k, torsion t and joints 2 l apart."""
    robot = load_robot("alternating32")
    joints = fit_backbone(robot, helix(0.15, 0.4), refine=False).joint_rad
    k = np.cos(0.4) ** 2 / 0.15
    torsion = np.sin(0.4) * np.cos(0.4) / 0.15
    amplitude = 2.0 * k * np.sin(torsion * robot.mean_link_length_m) / torsion
    at = (np.arange(32) + 1.0) * robot.mean_link_length_m
    for own in (robot.yaw_joints, robot.pitch_joints):
        turn = torsion * at[list(own)]
        basis = np.stack([np.cos(turn), np.sin(turn)], axis=1)
        weights, *_ = np.linalg.lstsq(basis, joints[list(own)], rcond=None)
        np.testing.assert_allclose(basis @ weights, joints[list(own)], atol=2e-3)
        assert np.hypot(*weights) == pytest.approx(amplitude, rel=2e-3)


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("name", ROBOTS)
def test_links_keep_their_length_and_joints_their_limits_on_any_curve(name: str) -> None:
    robot = load_robot(name)
    rng = np.random.default_rng(4)
    for _ in range(3):
        phase, size = rng.uniform(0.0, 6.0, 2), rng.uniform(0.02, 0.15, 2)
        curve = np.stack(
            [-RUN, size[0] * np.sin(5 * RUN + phase[0]), size[1] * np.sin(4 * RUN + phase[1])],
            axis=1,
        )
        fit = fit_backbone(robot, curve)
        lengths = np.linalg.norm(np.diff(fit.points_m, axis=0), axis=1)
        np.testing.assert_allclose(lengths, robot.mean_link_length_m, atol=1e-12)
        assert (np.abs(fit.joint_rad) <= np.array(robot.limit_rad) + 1e-12).all()
        beside = np.linalg.norm(fit.points_m[:, None] - curve[None], axis=2).min(axis=1)
        np.testing.assert_allclose(fit.distance_m, beside, atol=3e-3)
        if robot.pitch_joints:
            assert fit.residual_m < 0.012


def test_yaw_joints_alone_say_how_far_they_stay_from_a_space_curve() -> None:
    assert fit_backbone(load_robot("yaw16"), helix(0.13, 0.35)).residual_m > 0.03


def test_the_chain_is_that_of_the_physics() -> None:
    """Points and axes against MuJoCo's own kinematics."""
    robot = load_robot("alternating16")
    q = np.random.default_rng(1).uniform(-0.6, 0.6, 16)
    plant = MujocoPlant(robot, load_world("flat"))
    data = plant.mechanics.data
    data.qpos[7:] = q
    links, turns = plant.link_positions_m, link_rotations(plant)
    body = body_in_world(robot, plant.head_pose(), q)
    points, axes = chain_points_m(robot, body), chain_axes(robot, body)
    np.testing.assert_allclose(body.rotation, turns, atol=1e-9)
    np.testing.assert_allclose(0.5 * (points[:-1] + points[1:]), links, atol=1e-9)
    np.testing.assert_allclose(axes, data.xaxis[1:], atol=1e-9)


@pytest.mark.parametrize(
    ("curve", "words"),
    [
        (np.zeros((3, 3)), "4 or more points"),
        (np.zeros((9, 2)), "4 or more points"),
        (np.linspace(0, 1, 9)[:, None] * [0.5, 0, 0], "0.500 m long"),
        (np.repeat(np.arange(5.0), 2)[:, None] * [1.0, 0, 0], "neighbours must differ"),
    ],
)
def test_useless_curves_are_refused(curve: Floats, words: str) -> None:
    with pytest.raises(InputError, match=words):
        fit_backbone(load_robot("yaw16"), curve)
