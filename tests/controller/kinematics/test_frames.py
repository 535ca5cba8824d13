"""Frames that go with the body: invariant under rigid motion, and without jumps."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from snakewalk.config.arrays import Floats
from snakewalk.config.loader import load_robot
from snakewalk.controller.gaits.registry import make_gait
from snakewalk.controller.kinematics.frame import Frame
from snakewalk.controller.kinematics.links import body_in_world
from snakewalk.controller.kinematics.virtual_chassis import virtual_chassis
from snakewalk.drivers.types import BodyPose

ROBOT = load_robot("alternating16")
GAIT = make_gait("sidewinding", {"lift_rad": 0.3})
angles = st.floats(-3.0, 3.0)


def chassis_at(pose: BodyPose, joint_rad: Floats, last: Frame | None = None) -> Frame:
    links = body_in_world(ROBOT, pose, joint_rad).link_m
    return virtual_chassis(links, pose.rotation[:, 2], last)


def at(pose: BodyPose, phase_rad: float, last: Frame | None = None) -> Frame:
    return chassis_at(pose, GAIT.joints_rad(ROBOT, np.array([phase_rad]))[0], last)


@settings(max_examples=50)
@given(turn=st.tuples(angles, angles, angles), shift=st.tuples(angles, angles, angles), p=angles)
def test_the_chassis_moves_with_the_body_and_the_body_looks_the_same_from_it(
    turn: tuple[float, float, float], shift: tuple[float, float, float], p: float
) -> None:
    moved = Rotation.from_euler("zyx", turn).as_matrix()
    here = BodyPose(0.0, np.zeros(3), np.eye(3))
    there = BodyPose(0.0, np.array(shift), moved)
    joints = GAIT.joints_rad(ROBOT, np.array([p]))[0]
    a, b = chassis_at(here, joints), chassis_at(there, joints)
    np.testing.assert_allclose(b.rotation, moved @ a.rotation, atol=1e-9)
    np.testing.assert_allclose(b.origin_m, moved @ a.origin_m + shift, atol=1e-9)
    links = [body_in_world(ROBOT, pose, joints).link_m for pose in (here, there)]
    np.testing.assert_allclose(a.to_local_m(links[0]), b.to_local_m(links[1]), atol=1e-9)


def test_it_never_jumps_over_cycles_although_the_head_swings() -> None:
    pose = BodyPose(0.0, np.zeros(3), np.eye(3))
    frame = at(pose, 0.0)
    head_swing, chassis_swing = [], []
    for phase in np.linspace(0.0, 4.0 * np.pi, 400):
        frame, before = at(pose, phase, frame), frame
        turned = np.arccos(np.clip((np.trace(frame.rotation.T @ before.rotation) - 1) / 2, -1, 1))
        assert turned < 0.1
        assert np.linalg.det(frame.rotation) == pytest.approx(1.0)
        joints = GAIT.joints_rad(ROBOT, np.array([phase]))[0]
        mean = body_in_world(ROBOT, pose, joints).headings_rad.mean()
        head_swing.append(-mean)  # the head link against the body's mean direction
        chassis_swing.append(frame.heading_rad - mean)
    assert np.ptp(chassis_swing) < 0.35 * np.ptp(head_swing)


def test_axes_are_forward_left_and_up_for_a_flat_and_for_a_straight_body() -> None:
    arc = np.linspace(0.0, 1.0, 17)
    flat = np.stack([-arc, 0.1 * np.sin(6.0 * arc), np.zeros(17)], axis=1)
    for links in (flat, flat * [1, 0, 0]):
        frame = virtual_chassis(links, np.array([0.0, 0.0, 1.0]))
        assert frame.rotation[0, 0] > 0.95
        assert frame.rotation[2, 2] == pytest.approx(1.0)
        np.testing.assert_allclose(frame.origin_m, links.mean(axis=0))
    upside_down = virtual_chassis(flat, np.array([0.0, 0.0, -1.0]))
    assert upside_down.rotation[2, 2] == pytest.approx(-1.0)


def test_there_and_back() -> None:
    frame = at(BodyPose(0.0, np.ones(3), np.eye(3)), 1.0)
    points = np.random.default_rng(0).normal(size=(5, 3))
    np.testing.assert_allclose(frame.to_world_m(frame.to_local_m(points)), points, atol=1e-12)


def test_a_frame_on_the_head_link() -> None:
    pose = BodyPose(0.0, np.array([1.0, 2.0, 0.03]), Rotation.from_euler("z", 0.7).as_matrix())
    frame = Frame(rotation=pose.rotation, origin_m=pose.head_in_world_m)
    assert frame.heading_rad == pytest.approx(0.7)
    np.testing.assert_allclose(frame.to_local_m(pose.head_in_world_m), 0.0, atol=1e-12)
    np.testing.assert_allclose(
        frame.to_world_m(np.array([1.0, 0, 0])), [1.7648, 2.6442, 0.03], atol=1e-4
    )
