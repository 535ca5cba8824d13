"""Pitch goals: level ground needs none, a hill bends the body over it, a stiff robot reports it."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from snakewalk.config.heightfield import HeightField
from snakewalk.config.loader import load_robot
from snakewalk.controller.kinematics.links import body_in_world
from snakewalk.controller.mechanics.ground_step import GroundStep
from snakewalk.controller.mechanics.pitch_fit import PitchFitter
from snakewalk.drivers.types import BodyPose
from tests.helpers.uneven import UNEVEN

YAW, BOTH, LONG = (load_robot(name) for name in ("yaw16", "alternating16", "alternating32"))
ALIKE_THICK = UNEVEN.model_copy(
    update={"links": tuple(link.model_copy(update={"radius_m": None}) for link in UNEVEN.links)}
)
X = np.arange(-3.0, 3.001, 0.05)


def ridge(height_m: float) -> HeightField:
    """Across the x axis, a cosine of 2 m."""
    return HeightField(np.tile(height_m * np.cos(np.pi * X), (len(X), 1)), 0.05, -3.0, -3.0)


def headings(robot, amplitude: float) -> np.ndarray:
    links = robot.joint_count + 1
    return amplitude * np.sin(2 * np.pi * 1.2 * np.arange(links) / links)


@pytest.mark.parametrize("robot", [YAW, BOTH, LONG])
def test_nothing_lifts_on_a_floor_or_on_an_incline(robot) -> None:
    incline = HeightField(np.tile(0.3 * X, (len(X), 1)), 0.05, -3.0, -3.0)
    for ground in (None, incline):
        straight = PitchFitter(robot, ground)((0.6, 0.1), headings(robot, 0.0) + 0.4)
        np.testing.assert_allclose(straight.goal_rad, 0.0, atol=2e-3)
        assert straight.residual_m < 1e-4
    bent = PitchFitter(robot, None)((0.6, 0.1), headings(robot, 0.8))
    np.testing.assert_allclose(bent.goal_rad, 0.0, atol=1e-9)


def test_over_a_ridge_the_joints_carry_the_change_of_slope() -> None:
    # head on the far side, tail on the near one: the body is bent down at both ends
    fit = PitchFitter(BOTH, ridge(0.08))((0.5, 0.0), np.zeros(17))
    goals = fit.goal_rad[list(BOTH.pitch_joints)]
    assert not fit.goal_rad[list(BOTH.yaw_joints)].any()
    assert goals[1:-1].max() < 0.0
    change = fit.pitch_rad[0] - fit.pitch_rad[-1]
    assert goals.sum() == pytest.approx(change, rel=0.2)


def test_a_gain_bends_the_body_by_more_than_fits_up_to_the_joints_limit() -> None:
    place, along = (0.5, 0.0), headings(BOTH, 0.6)
    fits = PitchFitter(BOTH, ridge(-0.08))(place, along)
    more = PitchFitter(BOTH, ridge(-0.08), 1.12)(place, along)
    np.testing.assert_allclose(more.goal_rad, 1.12 * fits.goal_rad)
    assert more.residual_m > fits.residual_m
    most = PitchFitter(BOTH, ridge(-0.08), 100.0)(place, along)
    assert np.abs(most.goal_rad).max() == BOTH.limit_rad[BOTH.pitch_joints[0]]


def test_in_a_valley_the_signs_turn_over() -> None:
    over, under = (
        PitchFitter(BOTH, ridge(h))((0.5, 0.0), np.zeros(17)).goal_rad for h in (0.08, -0.08)
    )
    np.testing.assert_allclose(over, -under, atol=2e-3)


def test_a_robot_without_pitch_joints_reports_how_badly_it_lies() -> None:
    stiff = [PitchFitter(YAW, ridge(h))((0.5, 0.0), np.zeros(17)).residual_m for h in (0.02, 0.04)]
    free = PitchFitter(BOTH, ridge(0.04))((0.5, 0.0), np.zeros(17)).residual_m
    assert not PitchFitter(YAW, ridge(0.04))((0.5, 0.0), np.zeros(17)).goal_rad.any()
    assert stiff[1] == pytest.approx(2 * stiff[0], rel=0.05)
    assert free < 0.1 * stiff[1]


@pytest.mark.parametrize("robot", [BOTH, LONG])
def test_the_real_chain_with_these_goals_lies_on_the_ground(robot) -> None:
    rng = np.random.default_rng(4)
    noise = gaussian_filter(rng.normal(size=(len(X), len(X))), 6.0)
    ground = HeightField(noise / noise.std() * 0.05, 0.05, -3.0, -3.0)
    fitter, stiff = PitchFitter(robot, ground), []
    for _ in range(20):
        heading = headings(robot, 0.7) + rng.uniform(-3, 3)
        head = rng.uniform(-1, 1, 2)
        joints = np.zeros(robot.joint_count)
        yaw = list(robot.yaw_joints)
        joints[yaw] = (heading[:-1] - heading[1:])[yaw]
        rms = []
        for goals in (joints + fitter(head, heading).goal_rad, joints):
            view = body_in_world(robot, pose(head, heading[0]), goals)
            # free height, roll and pitch of the body as a whole: what is left must be small
            plane = np.column_stack([np.ones(len(heading)), view.link_m[:, :2]])
            off = view.link_m[:, 2] - ground.elevation_m(view.link_m[:, 0], view.link_m[:, 1])
            rms.append(float(np.std(off - plane @ np.linalg.lstsq(plane, off, rcond=None)[0])))
        stiff.append(rms)
    with_goals, without = np.mean(stiff, axis=0)
    assert with_goals < 0.5 * without
    assert with_goals < 0.005


def pose(head_m: np.ndarray, heading: float) -> BodyPose:
    c, s = np.cos(heading), np.sin(heading)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return BodyPose(0.0, np.array([*head_m, 0.0]), turn)


def test_goals_stay_within_the_joint_limits() -> None:
    goals = PitchFitter(BOTH, ridge(2.0))((0.9, 0.0), np.zeros(17)).goal_rad
    assert np.abs(goals).max() <= BOTH.limit_rad[BOTH.pitch_joints[0]]


def test_links_that_differ_lie_on_an_incline_too() -> None:
    incline = HeightField(np.tile(0.3 * X, (len(X), 1)), 0.05, -3.0, -3.0)
    fit = PitchFitter(ALIKE_THICK, incline)((0.6, 0.1), headings(ALIKE_THICK, 0.0) + 0.4)
    np.testing.assert_allclose(fit.goal_rad, 0.0, atol=2e-3)
    assert fit.residual_m < 1e-4
    skeleton = GroundStep(ridge(0.1)).place(
        headings(UNEVEN, 0.5), (0.3, 0.1), UNEVEN.link_lengths_m, 0.03, from_end="head"
    )
    apart = np.linalg.norm(np.diff(skeleton.points_m, axis=0), axis=1)
    np.testing.assert_allclose(apart, UNEVEN.link_lengths_m, atol=1e-9)
