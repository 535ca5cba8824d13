"""Support from pitch torques: beams whose balance is known."""

import numpy as np
import pytest

from benchmarks.support import measured
from snakewalk.config.constants import GRAVITY_M_S2
from snakewalk.config.loader import load_robot
from snakewalk.controller.kinematics.links import body_in_world, chain_axes, chain_points_m, pose_at
from snakewalk.controller.metrics.ground_contact import lifted, support_n
from tests.helpers.uneven import UNEVEN

ROBOT = load_robot("alternating16")
L = ROBOT.joint_count + 1
WEIGHT_N = ROBOT.mean_link_mass_kg * GRAVITY_M_S2


def torques_n_m(joint_rad: np.ndarray, bears_n: np.ndarray) -> np.ndarray:
    """Torque on each joint under these support forces, link by link."""
    body = body_in_world(ROBOT, pose_at(np.zeros(2), 0.4), joint_rad)
    joints_m, axes = chain_points_m(ROBOT, body)[1:-1], chain_axes(ROBOT, body)
    torque = np.zeros(ROBOT.joint_count)
    for j in range(ROBOT.joint_count):
        for i in range(j + 1, L):
            force = np.array([0.0, 0.0, bears_n[i] - WEIGHT_N])
            torque[j] -= axes[j] @ np.cross(body.link_m[i] - joints_m[j], force)
    return torque


def found_n(joint_rad: np.ndarray, torque: np.ndarray) -> np.ndarray:
    body = body_in_world(ROBOT, pose_at(np.zeros(2), 0.4), joint_rad)
    return support_n(ROBOT, body, torque)


def test_no_torque_is_an_even_load() -> None:
    for bend in (0.0, 0.3):
        joints = np.zeros(ROBOT.joint_count)
        joints[list(ROBOT.yaw_joints)] = bend
        bears = found_n(joints, np.zeros(ROBOT.joint_count))
        np.testing.assert_allclose(bears, WEIGHT_N, rtol=1e-6)
        assert not lifted(ROBOT, bears).any()


def test_a_bridge_on_its_two_ends() -> None:
    """A straight body on its first and last link: the middle is in the air, the ends bear it."""
    bears = np.zeros(L)
    bears[[0, -1]] = 0.5 * L * WEIGHT_N
    straight = np.zeros(ROBOT.joint_count)
    found = found_n(straight, torques_n_m(straight, bears))
    assert found.sum() == pytest.approx(L * WEIGHT_N, rel=0.02)
    # two links beside each other, without a pitch joint between them, are told together
    assert found[:2].sum() == pytest.approx(bears[0], rel=0.05)
    assert found[-2:].sum() == pytest.approx(bears[-1], rel=0.05)
    assert lifted(ROBOT, found)[2:-2].all()
    assert not lifted(ROBOT, found)[[0, -1]].any()


def test_a_winding_body_on_three_links() -> None:
    """Three supports under a bent body are its whole balance; each is found, within a link."""
    at = (3, 9, 15)
    joints = np.zeros(ROBOT.joint_count)
    yaw = list(ROBOT.yaw_joints)
    joints[yaw] = 0.5 * np.sin(np.linspace(0.0, 2.0 * np.pi, len(yaw)))
    body = body_in_world(ROBOT, pose_at(np.zeros(2), 0.4), joints)
    middle = (body.link_m - body.centre_m)[list(at), :2]
    rows = np.vstack([np.ones(3), middle.T])
    three_n = np.linalg.solve(rows, [L * WEIGHT_N, 0.0, 0.0])
    assert (three_n > 0.0).all()
    bears = np.zeros(L)
    bears[list(at)] = three_n
    found = found_n(joints, torques_n_m(joints, bears))
    for link, force in zip(at, three_n, strict=True):
        near = found[max(link - 1, 0) : link + 2].sum()
        assert near == pytest.approx(force, rel=0.1)


def test_currents_of_a_sidewinding_body_tell_what_the_ground_bears() -> None:
    """Against the physics' own contact forces; four fifths of the links are in the air."""
    told = measured("sidewinding", "flat", seconds=5.0)
    assert told.correlation > 0.8
    assert told.agree > 0.75


def test_no_torque_is_the_weight_of_each_link_where_links_differ() -> None:
    body = body_in_world(UNEVEN, pose_at(np.zeros(2), 0.4), np.zeros(UNEVEN.joint_count))
    bears = support_n(UNEVEN, body, np.zeros(UNEVEN.joint_count))
    weight_n = np.array(UNEVEN.link_masses_kg) * GRAVITY_M_S2
    np.testing.assert_allclose(bears, weight_n, rtol=1e-6)
    assert not lifted(UNEVEN, bears).any()
