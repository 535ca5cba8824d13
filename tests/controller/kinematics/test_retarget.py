"""Retargeting: headings preserved, closed forms of arcs, exact on the robot's own shapes."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from snakewalk.config.loader import load_robot
from snakewalk.controller.kinematics.retarget import Retarget
from tests.helpers.uneven import UNEVEN, spelt_out

YAW = load_robot("yaw16")
BOTH = load_robot("alternating16")
S = (np.arange(100) + 0.5) / 100


@given(st.floats(-3, 3), st.floats(-20, 20))
def test_an_arc_gives_equal_joints_whatever_its_heading(bend: float, heading: float) -> None:
    joints = Retarget(YAW).joints_rad(heading - bend * S)
    # samples are constant over a segment, of which a link holds a broken number
    np.testing.assert_allclose(joints, bend / 17, atol=3e-4 * abs(bend) + 1e-9)


def test_yaw_joints_of_an_alternating_robot_carry_the_whole_bend() -> None:
    joints = Retarget(BOTH).joints_rad(-1.6 * S)
    assert not joints[list(BOTH.pitch_joints)].any()
    # eight yaw joints, groups of 1, 2, ... 2 and 2 links: bends by distance of the groups' middles
    middles = np.array([0.5, *np.arange(2.0, 17.0, 2.0)]) / 17
    np.testing.assert_allclose(joints[list(BOTH.yaw_joints)], 1.6 * np.diff(middles), atol=5e-4)


def test_a_batch_is_the_same_as_one_by_one() -> None:
    shapes = np.random.default_rng(2).normal(size=(7, 3, 100)).cumsum(axis=-1) * 0.05
    retarget = Retarget(YAW)
    batch = retarget.joints_rad(shapes)
    np.testing.assert_array_equal(batch[4, 1], retarget.joints_rad(shapes[4, 1]))


def test_the_residual_is_zero_when_straight_and_small_against_the_bend() -> None:
    retarget = Retarget(YAW)
    assert retarget.residual_m(np.full(100, 0.7)) == pytest.approx(0.0, abs=1e-12)
    wave = 0.7 * np.sin(2 * np.pi * 1.2 * S)
    assert 0.0 < retarget.residual_m(wave) < 0.02
    assert Retarget(BOTH).residual_m(wave) > retarget.residual_m(wave)


def test_links_that_differ_take_the_mean_angle_over_their_own_length() -> None:
    joints = Retarget(UNEVEN).joints_rad(-1.6 * S)
    ends = np.array(UNEVEN.link_ends) / UNEVEN.link_count
    edges = np.array([0.0, *ends[np.array(UNEVEN.yaw_joints) + 1], 1.0])
    bends = 1.6 * np.diff(0.5 * (edges[1:] + edges[:-1]))
    np.testing.assert_allclose(joints[list(UNEVEN.yaw_joints)], bends, atol=5e-4)
    assert Retarget(UNEVEN).residual_m(np.full(100, 0.7)) == pytest.approx(0.0, abs=1e-12)


def test_links_spelt_out_are_retargeted_the_same_to_the_digit() -> None:
    shape = np.random.default_rng(2).normal(size=100).cumsum() * 0.05
    for robot in (YAW, BOTH):
        one, other = (Retarget(r).joints_rad(shape) for r in (robot, spelt_out(robot)))
        np.testing.assert_array_equal(one, other)
