"""Legs of three segments and more: lengths, directions of the bends, angles of living animals."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from snakewalk.config.animal import AnimalConfig, LegPairConfig
from snakewalk.config.arrays import Floats
from snakewalk.config.heightfield import HeightField
from snakewalk.controller.animals.legged.animal_synthesis import ANIMALS, read_animal
from snakewalk.controller.animals.legged.leg import LegFrame, leg_joints_m
from snakewalk.controller.animals.legged.motion_transformation import AnimalMotion, transformed
from snakewalk.controller.animals.legged.prototype import prototype
from snakewalk.controller.terrain.path import SplinePath

GOAT = read_animal("goat")
FRONT, HIND = GOAT.leg_pairs
STRAIGHT = SplinePath(np.array([[0.0, 0.0], [3.0, 0.0], [6.0, 0.0]]))
BLADE, UPPER, LOWER, CANNON, FOOT = range(5)
"""Segments of the goat's front leg; its hind leg has no blade."""


def walked(animal: AnimalConfig) -> AnimalMotion:
    """Two cycles on a level line."""
    time_s = np.linspace(1.0, 3.0, 193) * animal.cycle_s
    return transformed(prototype(animal, time_s), animal, STRAIGHT, None)


def angles_deg(joints_m: Floats) -> Floats:
    """(T, J - 2) inner angles of the joints between the first and the last."""
    step = np.diff(joints_m, axis=1)
    step /= np.linalg.norm(step, axis=-1, keepdims=True)
    return 180.0 - np.degrees(np.arccos((step[:, 1:] * step[:, :-1]).sum(axis=-1)))


def off_line(joints_m: Floats, joint: int) -> Floats:
    """(T,) how far a joint is ahead (+x) of the line between its neighbours."""
    above, here, below = (joints_m[:, joint + k] for k in (-1, 0, 1))
    share = (above[:, 2] - here[:, 2]) / (above[:, 2] - below[:, 2])
    return np.asarray(here[:, 0] - above[:, 0] - share * (below[:, 0] - above[:, 0]))


@pytest.mark.parametrize("name", ANIMALS)
def test_segments_keep_their_lengths_and_every_foot_is_reached(name: str) -> None:
    animal = read_animal(name)
    motion = walked(animal)
    for k, joints in enumerate(motion.joints_m):
        length = np.linalg.norm(np.diff(joints, axis=1), axis=-1)
        segments = animal.length_m * np.array(animal.leg_pairs[k // 2].segments)
        np.testing.assert_allclose(length, np.broadcast_to(segments, length.shape), rtol=1e-9)
    np.testing.assert_allclose(motion.end_m, motion.foot_m, atol=1e-9)


def test_the_bones_of_the_goat_have_published_lengths() -> None:
    """Means of J. Clutton-Brock et al. (1990), mm: greatest lengths of goats' bones."""
    mm = 1000.0 * GOAT.length_m
    front = np.array([FRONT.upper, FRONT.lower, FRONT.cannon, FRONT.foot]) * mm
    hind = np.array([HIND.upper, HIND.lower, HIND.cannon, HIND.foot]) * mm
    phalanges = 43.91 + 31.06 + 33.41
    np.testing.assert_allclose(front, [190.5, 185.4, 121.32, phalanges], rtol=2e-3)
    np.testing.assert_allclose(hind, [202.7, 246.3, 133.05, phalanges], rtol=2e-3)
    assert (FRONT.duty, HIND.duty) == (0.663, 0.689)  # J. Kim and G. J. Breur (2008)


@pytest.mark.parametrize("leg", range(4))
def test_a_goat_bends_its_joints_as_goats_do(leg: int) -> None:
    motion = walked(GOAT)
    joints, on = motion.joints_m[leg], motion.on_ground[:, leg]
    if leg < 2:
        assert off_line(joints, LOWER).max() < 0.0  # the elbow is behind
        folded = off_line(joints, CANNON)
        assert folded.min() > 0.0  # the carpus is in front
        assert folded[~on].max() > 3.0 * folded[on].max()  # and bends in the air
    else:
        assert off_line(joints, UPPER).min() > 0.0  # the knee is ahead
        assert off_line(joints, LOWER).max() < 0.0  # the hock is behind


# flexion and extension of living sheep, degrees: V. M. Govoni et al. (2012)
SHOULDER, ELBOW, CARPUS = (88.0, 144.0), (34.0, 145.0), (20.0, 170.0)
STIFLE, HOCK = (46.0, 146.0), (35.0, 163.0)


@pytest.mark.parametrize("leg", range(4))
def test_joints_stay_within_the_range_of_living_animals(leg: int) -> None:
    motion = walked(GOAT)
    found = angles_deg(motion.joints_m[leg])
    limits = (SHOULDER, ELBOW, CARPUS) if leg < 2 else (STIFLE, HOCK)
    on = motion.on_ground[:, leg]
    for k, (low, high) in enumerate(limits):
        stance, air = found[on, k], found[~on, k]
        assert low - 0.5 <= stance.min() < stance.max() <= high + 0.5
        assert low - 5.0 <= air.min() < air.max() <= high + 5.0  # SD of the measurements: 2 to 7


def test_the_goat_stands_upright() -> None:
    """Thighs of 62 to 65 degrees from the vertical, over the stance, are a crouch."""
    motion = walked(GOAT)
    for leg in (2, 3):
        thigh = motion.joints_m[leg][motion.on_ground[:, leg]][:, :2]
        step = thigh[:, 1] - thigh[:, 0]
        tilt = np.degrees(np.arctan2(step[:, 0], -step[:, 2]))
        assert -30.0 < tilt.min() < tilt.max() < 55.0
        assert np.mean(tilt) < 30.0


@pytest.mark.parametrize("name", ANIMALS)
def test_no_joint_is_below_the_ground(name: str) -> None:
    animal = read_animal(name)
    rng = np.random.default_rng(3)
    ground = HeightField(0.02 * rng.standard_normal((81, 81)), 0.25, -10.0, -10.0)
    made = prototype(animal, np.linspace(0.0, 3.0, 97) * animal.cycle_s)
    for joints in (*walked(animal).joints_m, *transformed(made, animal, STRAIGHT, ground).joints_m):
        low = joints[..., 2]
        level = (
            0.0 if joints.shape[0] == 193 else ground.elevation_m(joints[..., 0], joints[..., 1])
        )
        assert (low - level).min() > -1e-9


def level(frames: int) -> LegFrame:
    x, y, z = (np.tile(axis, (frames, 1)) for axis in np.eye(3))
    return LegFrame(x, y, z)


@settings(deadline=None, max_examples=60)
@given(
    blade=st.sampled_from([0.0, 0.15]),
    cannon=st.sampled_from([0.0, 0.2]),
    foot=st.sampled_from([0.0, 0.1]),
    turn_deg=st.floats(-60.0, 60.0),
    seed=st.integers(0, 999),
)
def test_any_leg_keeps_its_lengths_and_reaches_what_it_can(
    blade: float, cannon: float, foot: float, turn_deg: float, seed: int
) -> None:
    fields = FRONT.model_dump() | {
        "blade": blade, "upper": 0.3, "lower": 0.25, "cannon": cannon, "foot": foot,
        "cannon_deg": turn_deg, "foot_out_deg": turn_deg,
        "knee": ["out", "ahead", "behind"][seed % 3],
    }  # fmt: skip
    pair = LegPairConfig.model_validate(fields)
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(20, 3))
    toe = root + rng.uniform(0.05, 1.2, (20, 1)) * np.array([0.2, 0.1, -1.0])
    joints = leg_joints_m(pair, 1.0, root, toe, rng.random(20), level(20), 1.0)
    length = np.linalg.norm(np.diff(joints, axis=1), axis=-1)
    np.testing.assert_allclose(length, np.broadcast_to(pair.segments, length.shape), atol=1e-9)
    np.testing.assert_allclose(joints[:, 0], root)
    aim = joints[:, -2] if foot else joints[:, -1]
    wanted = toe - (joints[:, -1] - joints[:, -2]) if foot else toe
    miss = np.linalg.norm(aim - wanted, axis=-1)
    assert (miss < 1e-9).any() or miss.min() > 0.0
    across = np.cross(aim - root, wanted - root)  # too long or too short, never aside
    assert np.abs(across).max() < 1e-9
    far = np.linalg.norm(wanted - root, axis=-1)
    out = np.linalg.norm(aim - root, axis=-1)
    assert (np.abs(out - far)[miss > 1e-9] > 1e-9).all()


def test_a_leg_of_two_segments_is_the_triangle() -> None:
    """The files of users, which know upper and lower only, keep their legs."""
    fields = {"at": 0.3, "hip_side": 0.1, "foot_side": 0.1, "upper": 0.3, "lower": 0.25,
              "thick": 0.02, "knee": "ahead", "duty": 0.6, "left": 0.0, "right": 0.5,
              "lift": 0.1}  # fmt: skip
    pair = LegPairConfig.model_validate(fields)
    root, toe = np.zeros((1, 3)), np.array([[0.0, 0.0, -0.45]])
    joints = leg_joints_m(pair, 1.0, root, toe, np.zeros(1), level(1), 1.0)
    cosine = (0.3**2 + 0.45**2 - 0.25**2) / (2.0 * 0.3 * 0.45)
    knee = 0.3 * np.array([np.sqrt(1.0 - cosine**2), 0.0, -cosine])
    np.testing.assert_allclose(joints[0], [root[0], knee, toe[0]], atol=1e-12)
