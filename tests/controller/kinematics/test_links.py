"""Forward kinematics: closed forms of a chain carried by its head."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from snakewalk.config.loader import load_robot
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.kinematics.links import (
    body_in_world,
    chain_axes,
    chain_jacobian,
    chain_points_m,
    link_weights,
)
from snakewalk.drivers.types import BodyPose
from tests.helpers.uneven import UNEVEN, spelt_out

YAW = load_robot("yaw16")
BOTH = load_robot("alternating16")


def pose(heading: float = 0.0, at=(0.0, 0.0, 0.0)) -> BodyPose:
    c, s = np.cos(heading), np.sin(heading)
    return BodyPose(0.0, np.array(at), np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]]))


def test_a_straight_body_lies_behind_its_head() -> None:
    view = body_in_world(YAW, pose(np.pi / 2, (1.0, 2.0, 0.1)), np.zeros(16))
    np.testing.assert_allclose(view.link_m[:, 0], 1.0, atol=1e-12)
    np.testing.assert_allclose(view.link_m[:, 1], 2.0 - 0.07 * np.arange(17), atol=1e-12)
    np.testing.assert_allclose(view.link_m[:, 2], 0.1)


def test_equal_joints_lie_on_a_circle_and_turn_left_when_positive() -> None:
    q = 0.2
    view = body_in_world(YAW, pose(), np.full(16, q))
    np.testing.assert_allclose(view.headings_rad, -q * np.arange(17), atol=1e-12)
    # centres of links of length l in a regular polygon lie at the inradius from its centre
    inradius = 0.5 * 0.07 / np.tan(q / 2)
    centre = view.link_m[0, :2] + inradius * np.array([0.0, 1.0])  # to the left of the head
    np.testing.assert_allclose(np.hypot(*(view.link_m[:, :2] - centre).T), inradius)


def test_positive_pitch_lifts_the_head_side() -> None:
    q = np.zeros(16)
    q[1] = 0.3
    view = body_in_world(BOTH, pose(), q)
    assert view.forward[1, 2] == pytest.approx(0.0)
    assert view.forward[2, 2] == pytest.approx(-np.sin(0.3))
    assert view.link_m[-1, 2] > 0.0  # level head, tail looking down its way of travel: it is higher


def test_neighbouring_links_meet_at_the_joint() -> None:
    rng = np.random.default_rng(1)
    for robot in (YAW, BOTH):
        view = body_in_world(robot, pose(0.7), rng.uniform(-1, 1, 16))
        half = 0.5 * robot.mean_link_length_m
        rear = view.link_m[:-1] - half * view.forward[:-1]
        front = view.link_m[1:] + half * view.forward[1:]
        np.testing.assert_allclose(rear, front, atol=1e-12)
        np.testing.assert_allclose(np.linalg.norm(view.forward, axis=1), 1.0)


def test_the_axes_of_every_link_are_those_of_the_joints_turned_one_by_one() -> None:
    robot = RobotConfig(name="r", joint_axes="ypypyyp")
    rng = np.random.default_rng(0)
    head, _ = np.linalg.qr(rng.standard_normal((3, 3)))
    head[:, 0] *= np.sign(np.linalg.det(head))
    joints = rng.uniform(-1.0, 1.0, 7)
    view = body_in_world(robot, BodyPose(0.0, np.zeros(3), head), joints)
    frame = head
    for axis, angle, found in zip(robot.joint_axes, joints, view.rotation[1:], strict=True):
        turn = Rotation.from_rotvec([0, 0, -angle] if axis == "y" else [0, angle, 0])
        frame = frame @ turn.as_matrix()
        np.testing.assert_allclose(found, frame, atol=1e-12)
    np.testing.assert_array_equal(view.forward, view.rotation[:, :, 0])


def test_the_jacobian_is_the_slope_of_the_points() -> None:
    rng = np.random.default_rng(2)
    joints, step = rng.uniform(-1.0, 1.0, 16), 1e-6
    body = body_in_world(BOTH, pose(0.3), joints)
    points = chain_points_m(BOTH, body)
    jacobian = chain_jacobian(points, chain_axes(BOTH, body))
    tip = points[0]
    for j in range(16):
        bent = joints + step * (np.arange(16) == j)
        moved = chain_points_m(BOTH, body_in_world(BOTH, pose(0.3), bent))
        np.testing.assert_allclose(jacobian[:, :, 6 + j], (moved - points) / step, atol=1e-5)
    for k in range(3):
        turn = Rotation.from_rotvec(step * np.eye(3)[k]).as_matrix()
        moved = (points - tip) @ turn.T + tip
        np.testing.assert_allclose(jacobian[:, :, 3 + k], (moved - points) / step, atol=1e-5)
        np.testing.assert_array_equal(jacobian[:, :, k], np.tile(np.eye(3)[k], (18, 1)))


def test_links_spelt_out_move_the_same_to_the_digit() -> None:
    joints = np.random.default_rng(3).uniform(-1, 1, 16)
    for robot in (YAW, BOTH):
        one, other = (body_in_world(r, pose(0.4), joints) for r in (robot, spelt_out(robot)))
        for name in ("link_m", "rotation", "centre_m"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def test_links_that_differ_meet_at_their_joints_and_two_axes_at_one_place() -> None:
    joints = np.random.default_rng(3).uniform(-1, 1, UNEVEN.joint_count)
    points = chain_points_m(UNEVEN, body_in_world(UNEVEN, pose(0.7), joints))
    apart = np.linalg.norm(np.diff(points, axis=0), axis=1)
    np.testing.assert_allclose(apart, UNEVEN.link_lengths_m, atol=1e-12)
    weights = link_weights(UNEVEN)
    assert weights.sum() == pytest.approx(UNEVEN.link_count)
    assert weights[0] / weights[1] == pytest.approx(30.0)
    np.testing.assert_array_equal(link_weights(YAW), 1.0)


def test_noise_of_the_heads_rotation_does_not_slow_the_body() -> None:
    """A body at rest whose poses have noise of 3 degrees advances by nothing on average."""
    robot, rng = load_robot("yaw16"), np.random.default_rng(3)
    joint_rad = 0.4 * np.sin(np.arange(robot.joint_count))
    turns = Rotation.from_rotvec(rng.normal(0.0, np.deg2rad(3.0), (400, 3))).as_matrix()
    views = [body_in_world(robot, BodyPose(0.0, np.zeros(3), turn), joint_rad) for turn in turns]
    pairs = list(pairwise(views))
    unbiased = np.mean([now.unbiased_advance_since_m(before) for before, now in pairs])
    biased = np.mean([now.advance_since_m(before) for before, now in pairs])
    assert abs(unbiased) < 1e-4
    assert biased < -1e-3
