"""Trot and walk: when feet step, how girdles turn with them, how far the salamander goes."""

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot, load_world
from snakewalk.controller.gaits.trot import LateralWalk, LegGait, Trot
from snakewalk.sim.physics.plant import MujocoPlant
from snakewalk.sim.servo.motor import MOTORS, make_drive, p_gain_per_rad

ROBOT = load_robot("salamander")
SPINE = len(ROBOT.joint_axes)
SWING = [SPINE + 2 * leg for leg in range(4)]
ROLL = [joint + 1 for joint in SWING]
PHASE = 2.0 * np.pi * np.arange(400) / 400


def in_the_air(gait: LegGait) -> np.ndarray:
    """(T, 4) hind left, hind right, front left, front right."""
    roll = gait.joints_rad(ROBOT, PHASE)[:, ROLL]
    return roll > roll.min() + 1e-3


def test_a_trot_lifts_legs_across_and_a_walk_one_at_a_time() -> None:
    trot = in_the_air(Trot())
    np.testing.assert_array_equal(trot[:, 0], trot[:, 3])
    np.testing.assert_array_equal(trot[:, 1], trot[:, 2])
    assert (trot.sum(axis=1) <= 2).all()
    assert not (trot[:, 0] & trot[:, 1]).any()
    walk = in_the_air(LateralWalk())
    assert (walk.sum(axis=1) <= 1).all()
    lifted = [int(np.flatnonzero(walk[:, leg] & ~np.roll(walk[:, leg], 1))[0]) for leg in range(4)]
    order = np.argsort((np.array(lifted) - lifted[0]) % 400)
    assert order.tolist() == [0, 2, 1, 3]  # hind left, front left, hind right, front right


def test_with_one_height_for_both_feet_as_printed_one_foot_walks_backwards() -> None:
    """[GC] Eq. 9-10: y = sin wt for both feet, z = -cos wt and + cos wt."""
    t = np.linspace(0.0, 2.0 * np.pi, 400, endpoint=False)
    lifted = np.sin(t) > 0.0
    forward = {"right": np.sin(t), "left": -np.sin(t)}  # dz/dt
    assert (forward["right"][lifted] > 0.0).all()
    assert (forward["left"][lifted] < 0.0).all()  # in the air it goes back
    for gait in (Trot(), LateralWalk()):
        joints = gait.joints_rad(ROBOT, PHASE)
        air = in_the_air(gait)
        rate = np.gradient(joints[:, SWING], axis=0)
        for leg in range(4):
            # just lifted, it still goes back as on the ground, and so before it comes down
            margins = (round(100 * (1.0 - gait.duty)), 5)
            inside, ground = (
                np.all([np.roll(where, k) for k in range(-margin, margin + 1)], axis=0)
                for where, margin in zip((air[:, leg], ~air[:, leg]), margins, strict=True)
            )
            assert (rate[inside, leg] > 0.0).all()
            np.testing.assert_allclose(rate[ground, leg], rate[ground, leg].mean(), rtol=1e-6)


def test_the_girdles_turn_with_their_legs_and_the_head_keeps_its_heading() -> None:
    joints = Trot.of({"bend_rad": 0.6}).joints_rad(ROBOT, PHASE)
    hind, front = ROBOT.limbs[0].link, ROBOT.limbs[1].link
    headings = -np.cumsum(np.column_stack([np.zeros(len(PHASE)), joints[:, :SPINE]]), axis=1)
    turned = headings - headings[:, :1]  # about the head
    np.testing.assert_allclose(turned[:, front], -turned[:, hind], atol=1e-12)
    np.testing.assert_allclose(turned[:, -1], 0.0, atol=1e-12)  # the tail as the head
    assert np.abs(turned[:, front]).max() == pytest.approx(0.3)
    # the front girdle to the right where the left front leg is foremost
    foremost = int(np.argmax(joints[:, SWING[2]]))
    assert turned[foremost, front] == pytest.approx(-0.3, abs=0.02)


@pytest.mark.parametrize("gait", [Trot, LateralWalk])
def test_mirrored_left_and_right_are_exchanged(gait: type[LegGait]) -> None:
    one = gait.of({"turn": 0.4}).joints_rad(ROBOT, PHASE)
    other = gait.of({"turn": 0.4, "mirror": True}).joints_rad(ROBOT, PHASE)
    legs = [SPINE + k for k in (2, 3, 0, 1, 6, 7, 4, 5)]
    np.testing.assert_allclose(other[:, :SPINE], -one[:, :SPINE])
    np.testing.assert_allclose(other[:, SPINE:], one[:, legs])


def travel(gait: LegGait, cycles: int = 3) -> tuple[np.ndarray, float]:
    """Way of the head (2,) over ``cycles`` after one cycle at 0.25 Hz, body lengths; heading."""
    body = MujocoPlant(ROBOT, load_world("isotropic"))
    servo = make_drive([MOTORS["XM430-W350"]] * ROBOT.joint_count, 12.0)
    servo.torque_on[:] = 1.0
    servo.p_gain_per_rad[:] = p_gain_per_rad(800, MOTORS["XM430-W350"])
    body.reset((0.0, 0.0), 0.0, gait.joints_rad(ROBOT, np.zeros(1))[0])
    seen = []
    for k in range(200 * (cycles + 1)):
        goal = gait.joints_rad(ROBOT, np.array([2.0 * np.pi * k / 200]))[0]
        servo.goal_rad[:] = goal
        body.advance(0.02 * (k + 1), servo)
        if (k + 1) % 200 == 0:
            pose = body.head_pose()
            x, y = pose.rotation[:2, 0]
            seen.append((*pose.head_in_world_m[:2], np.arctan2(y, x)))
    first, last = np.array(seen[0]), np.array(seen[-1])
    return (last - first)[:2] / cycles / ROBOT.length_m, float((last - first)[2]) / cycles


@pytest.mark.slow
def test_it_walks_forward_by_less_than_its_strides_and_farther_with_a_bent_spine() -> None:
    limb = ROBOT.limbs[0]
    way: dict[float, float] = {}
    for bend in (0.0, 0.5):
        gait = Trot.of({"bend_rad": bend})
        moved, turned = travel(gait, 2)
        p = gait.params
        reach = limb.segments_m[0] + limb.segments_m[1] * np.cos(p.stance_rad)
        legs = 4.0 * reach * np.sin(p.stride_rad)  # two steps, each from front to back
        girdle = 4.0 * (limb.hip_m + reach) * np.sin(0.5 * bend)
        assert 0.5 < moved[0] * ROBOT.length_m / (legs + girdle) < 1.0
        assert abs(moved[1]) < 0.05
        assert abs(turned) < 0.05
        way[bend] = moved[0]
    assert way[0.5] > 1.1 * way[0.0]


@pytest.mark.parametrize("gait", [Trot, LateralWalk])
def test_legs_never_step_in_speed(gait: type[LegGait]) -> None:
    fine = np.linspace(0.0, 2.0 * np.pi, 4001)
    rate = np.diff(gait().joints_rad(ROBOT, fine)[:, SWING], axis=0) / np.diff(fine)[:, None]
    steps = np.abs(np.diff(np.vstack([rate, rate[:1]]), axis=0)).max()
    assert steps < 0.02 * np.abs(rate).max()


def test_shorter_strides_inside_turn_the_body() -> None:
    _, left = travel(Trot.of({"turn": 0.6}), 1)
    _, right = travel(Trot.of({"turn": -0.6}), 1)
    assert left > 0.1
    assert right == pytest.approx(-left, abs=0.05)


def test_a_snake_has_no_legs_to_trot_on() -> None:
    with pytest.raises(InputError, match="two pairs of legs; robot yaw16 has 0"):
        Trot().check(load_robot("yaw16"))
