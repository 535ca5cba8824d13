"""Legs that hang down: feet go level and even on the ground, and the chart of contacts is kept."""

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot
from snakewalk.controller.gaits.erect import ErectTrot, ErectWalk, hip_and_knee_rad
from snakewalk.controller.gaits.gait import Gait
from tests.helpers.swimming import follow

ROBOT = load_robot("quadruped")
SPINE = len(ROBOT.joint_axes)
PHASES = np.linspace(0.0, 2.0 * np.pi, 400, endpoint=False)
UPPER_M, LOWER_M = ROBOT.limbs[0].segments_m[1:]


def feet_m(gait: Gait) -> np.ndarray:
    """(T, 4, 2) feet forward of their hips and down in their legs' planes, by the angles."""
    joints = gait.joints_rad(ROBOT, PHASES)[:, SPINE:].reshape(len(PHASES), 4, 3)
    hip, both = joints[..., 1], joints[..., 1] + joints[..., 2]
    forward = UPPER_M * np.sin(hip) + LOWER_M * np.sin(both)
    down = UPPER_M * np.cos(hip) + LOWER_M * np.cos(both)
    return np.stack([forward, down], axis=-1)


def test_hip_and_knee_put_the_foot_where_it_is_asked_and_the_knee_ahead() -> None:
    rng = np.random.default_rng(1)
    forward, down = rng.uniform(-0.06, 0.06, 50), rng.uniform(0.08, 0.16, 50)
    hip, knee = hip_and_knee_rad(forward, down, 0.1, 0.08)
    np.testing.assert_allclose(0.1 * np.sin(hip) + 0.08 * np.sin(hip + knee), forward, atol=1e-12)
    np.testing.assert_allclose(0.1 * np.cos(hip) + 0.08 * np.cos(hip + knee), down, atol=1e-12)
    assert (knee < 0.0).all()  # the lower segment leans back of the upper one
    hip, knee = hip_and_knee_rad(np.array([0.3]), np.array([0.4]), 0.1, 0.08)
    assert knee[0] == 0.0
    assert hip[0] == pytest.approx(np.arctan2(0.3, 0.4))


@pytest.mark.parametrize("kind", [ErectWalk, ErectTrot])
def test_feet_on_the_ground_are_level_and_go_back_alike_so_that_the_body_goes_forward(kind) -> None:
    """A share ``duty`` of the cycle each; in one the body makes ``2 stride leg / duty``."""
    gait = kind()
    feet, leg_m = feet_m(gait), UPPER_M + LOWER_M
    stands = np.abs(feet[..., 1] - gait.params.reach * leg_m) < 1e-9
    np.testing.assert_allclose(stands.mean(axis=0), kind.duty, atol=0.01)
    back = (np.roll(feet[..., 0], -1, axis=0) - feet[..., 0]) / (PHASES[1] / (2.0 * np.pi))
    level = stands & np.roll(stands, -1, axis=0)
    assert level.sum(axis=1).min() >= round(4 * kind.duty) - 2
    wanted = -2.0 * gait.params.stride * leg_m / kind.duty
    np.testing.assert_allclose(back[level], wanted, rtol=1e-6)
    assert feet[..., 1].min() == pytest.approx(
        (gait.params.reach - gait.params.lift) * leg_m, abs=1e-4
    )


def test_a_quadruped_trots_upright_as_far_as_its_feet_go_back() -> None:
    run = follow(ErectTrot(), "quadruped", "isotropic", 10.0)
    bound_m = 2.0 * 0.2 * (UPPER_M + LOWER_M) / ErectTrot.duty
    way_m = run.way_m(3)
    print("m a cycle:", way_m, "of", bound_m)
    assert 0.75 * bound_m < way_m[0] < bound_m
    assert abs(way_m[1]) < 0.1 * way_m[0]
    head = run.plant.head_pose()
    assert head.rotation[2, 2] > np.cos(0.15)
    assert head.head_in_world_m[2] > 0.13


def test_legs_that_stand_out_are_refused_in_one_line() -> None:
    with pytest.raises(InputError, match="needs legs of joint_axes ryy; those of robot salam"):
        ErectTrot().check(load_robot("salamander"))
