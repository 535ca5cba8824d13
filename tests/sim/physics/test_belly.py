"""What a link touches the world with: its contacts, gaps and slopes, other links, and rest."""

from itertools import pairwise

import numpy as np
import pytest

from snakewalk.config.errors import ConfigError
from snakewalk.config.heightfield import HeightField
from snakewalk.config.loader import checked, load_robot
from snakewalk.config.robot import BellyConfig, RobotConfig
from snakewalk.config.world import FrictionConfig
from snakewalk.sim.physics.body import belly_points_m, straight_part_m
from snakewalk.sim.physics.plant import MujocoPlant
from tests.helpers.physics import FLAT, ROBOT, Floats, a_drive, link_rotations, serpenoid
from tests.oracles.numpy_steps import numpy_plant

BELLIES = (BellyConfig(shape="ball"), BellyConfig(), BellyConfig(shape="rails", width_m=0.1))
NAMES = [belly.shape for belly in BELLIES]


def robot(belly: BellyConfig) -> RobotConfig:
    return ROBOT.model_copy(update={"belly": belly})


def profile(height: Floats, spacing: float, width_m: float = 1.0) -> HeightField:
    """Ground that is the same for every y."""
    rows = round(width_m / spacing) + 1
    return HeightField(
        np.tile(height, (rows, 1)), spacing, -(len(height) - 1) * spacing / 2, -width_m / 2
    )


@pytest.mark.parametrize("belly", BELLIES, ids=NAMES)
def test_on_a_floor_it_has_its_points_and_rests_at_its_radius(belly: BellyConfig) -> None:
    body = MujocoPlant(robot(belly), FLAT)
    contacts = body.mechanics.data.contact
    points = body.link_positions_m[:, None] + belly_points_m(robot(belly), 1).reshape(-1, 3)
    found = np.asarray(contacts.pos)[:, :2]
    assert len(found) == points.shape[0] * points.shape[1]
    gap = np.linalg.norm(found[:, None] - points.reshape(-1, 3)[None, :, :2], axis=2)
    assert gap.min(axis=1).max() < 1e-6
    assert gap.min(axis=0).max() < 1e-6
    np.testing.assert_allclose(body.link_positions_m[:, 2], 0.03, atol=1e-4)


def test_the_ends_of_a_capsule_are_gauss_points_unless_it_is_slender() -> None:
    assert straight_part_m(0.07, 0.03) == pytest.approx(0.07 / np.sqrt(3.0))
    slender = ROBOT.model_copy(update={"link_length_m": 0.2})
    assert straight_part_m(0.2, 0.03) == pytest.approx(0.2 - 1.2 * 0.03)
    row = belly_points_m(slender, 1)[0, :, 0]
    assert np.diff(row).max() <= 1.4 * 0.03  # no hole between the balls that meet a field


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize(
    ("belly", "sinks"), [(BELLIES[0], True), (BELLIES[1], False)], ids=NAMES[:2]
)
def test_a_capsule_bridges_a_trench_that_a_ball_falls_into(belly: BellyConfig, sinks: bool) -> None:
    """5 cm wide under the middle of the third link of a limp body, which hangs from its hinges."""
    x = 0.01 * np.arange(-200, 201)
    edge = -2.0 * ROBOT.mean_link_length_m
    trench = profile(np.where(np.abs(x - edge) < 0.021, 0.0, 0.2), 0.01)
    limp = robot(belly).model_copy(update={"joint_axes": "p" * 16})
    body = MujocoPlant(limp, FLAT, trench)
    body.advance(1.0, a_drive(torque_on=False))
    lowest = body.link_positions_m[2, 2] - 0.2 - limp.body_radius_m
    assert (lowest < -0.004) == sinks


def test_on_a_side_slope_a_round_body_rolls_and_one_on_rails_stays() -> None:
    slope = profile(np.zeros(61), 0.05, 3.0)
    slope = HeightField(np.tile(0.3 * 0.05 * np.arange(61.0)[:, None], (1, 61)), 0.05, -1.5, -1.5)
    down = {}
    for belly in BELLIES[1:]:
        body = MujocoPlant(robot(belly), FLAT, slope)
        start = body.link_positions_m[:, 1].mean()
        body.advance(1.0, a_drive())
        down[belly.shape] = start - body.link_positions_m[:, 1].mean()
    assert down["capsule"] > 0.5
    assert abs(down["rails"]) < 0.02


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("belly", BELLIES, ids=NAMES)
def test_without_torque_motion_dies_and_never_grows(belly: BellyConfig) -> None:
    body, drive = MujocoPlant(robot(belly), FLAT), a_drive()
    for k in range(1, 101):
        drive.goal_rad[:] = serpenoid(0.02 * k)
        body.advance(0.02 * k, drive)
    drive.torque_on[:] = 0.0
    kinetic = [body.energy_j[1]]
    for k in range(1, 601):
        body.advance(2.0 + 0.002 * k, drive)
        kinetic.append(body.energy_j[1])
    assert kinetic[0] > 0.1
    assert all(after <= before + 1e-9 for before, after in pairwise(kinetic))


@pytest.mark.slow_cases(1, "3 cases of 0.9 s of CPU")
@pytest.mark.slow
@pytest.mark.parametrize("belly", BELLIES, ids=NAMES)
def test_compiled_and_numpy_steps_agree_on_hills(belly: BellyConfig) -> None:
    y, x = 0.05 * np.mgrid[-40:41, -40:41]
    hills = HeightField(0.03 * np.sin(9.0 * x) * np.cos(7.0 * y), 0.05, -2.0, -2.0)
    both = []
    for make in (MujocoPlant, numpy_plant):
        body, drive = make(robot(belly), FLAT, hills), a_drive()
        for k in range(1, 16):
            drive.goal_rad[:] = serpenoid(0.7 + 0.02 * k)
            body.advance(0.02 * k, drive)
        both.append(body)
    np.testing.assert_allclose(both[0].qpos, both[1].qpos, atol=1e-9)


def test_a_body_that_curls_up_meets_itself() -> None:
    """Every joint is told to turn by 50 degrees: the links would lie in two turns on each other."""
    body, drive = MujocoPlant(ROBOT, FLAT), a_drive()
    body.reset((0.0, 0.0), 0.0, np.full(16, 0.25))
    for k in range(1, 101):
        drive.goal_rad[:] = 0.25 + 0.62 * min(1.0, k / 50)
        body.advance(0.02 * k, drive)
    axes = link_rotations(body)
    points = body.link_positions_m[:, None] + belly_points_m(ROBOT, 1)[0] @ axes.swapaxes(1, 2)
    apart = np.linalg.norm(points[:, None, :, None] - points[None, :, None], axis=-1).min((2, 3))
    far = np.abs(np.subtract.outer(np.arange(17), np.arange(17))) >= 3
    assert apart[far].min() > 2 * ROBOT.body_radius_m - 0.004
    bodies = body.mechanics.model.geom_bodyid[body.mechanics.data.contact.geom]
    assert (bodies > 0).all(axis=1).any()


@pytest.mark.parametrize("name", ["yaw16", "alternating32", "xl330-16"])
def test_a_straight_body_does_not_touch_itself(name: str) -> None:
    body = MujocoPlant(load_robot(name), FLAT)
    bodies = body.mechanics.model.geom_bodyid[body.mechanics.data.contact.geom]
    assert (bodies == 0).any(axis=1).all()


@pytest.mark.parametrize(("speed_m_s", "mu"), [(1.0, 0.2), (-1.0, 0.4)])
def test_thrown_back_it_stops_after_the_way_of_its_own_friction(
    speed_m_s: float, mu: float
) -> None:
    friction = FrictionConfig(along=0.2, across=0.5, back=0.4)
    body = MujocoPlant(ROBOT, FLAT.model_copy(update={"friction": friction}))
    x0 = body.link_positions_m[0, 0]
    body.mechanics.data.qvel[0] = speed_m_s
    body.mechanics.start_at_rest()
    body.advance(1.0, a_drive(torque_on=False))
    way = body.link_positions_m[0, 0] - x0
    assert way == pytest.approx(speed_m_s / (2.0 * mu * 9.81), abs=2e-3)


@pytest.mark.parametrize(
    ("belly", "words"),
    [
        ({"shape": "rails"}, "rails need their width"),
        ({"shape": "ball", "width_m": 0.1}, "width_m is of rails"),
        ({"shape": "rails", "width_m": 0.05}, "over twice body_radius_m"),
        ({"shape": "box"}, "capsule"),
    ],
)
def test_a_belly_that_cannot_be_is_refused(belly: dict[str, object], words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        checked(RobotConfig, {"name": "a", "joint_axes": "yy", "belly": belly}, "a.toml")
