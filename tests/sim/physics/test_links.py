"""Links that differ: what each weighs, is held up by, floats by; and alike ones as before."""

import numpy as np
import pytest

from snakewalk.config.constants import GRAVITY_M_S2
from snakewalk.config.heightfield import HeightField
from snakewalk.config.loader import load_robot, load_world
from snakewalk.config.world import WorldConfig
from snakewalk.sim.physics.body import mjcf, overlapping_links
from snakewalk.sim.physics.plant import MujocoPlant
from snakewalk.sim.physics.water import water_constants
from snakewalk.sim.plant import ServoDrive
from snakewalk.sim.servo.motor import MOTORS, make_drive, p_gain_per_rad
from tests.helpers.uneven import UNEVEN, spelt_out
from tests.oracles.numpy_steps import numpy_plant

FLAT, POOL = load_world("flat"), load_world("pool")
X = np.arange(-2.0, 2.001, 0.05)
HILLS = HeightField(0.03 * np.cos(5.0 * X)[:, None] * np.sin(4.0 * X), 0.05, -2.0, -2.0)


def held() -> ServoDrive:
    drive = make_drive([MOTORS["XM430-W350"]] * UNEVEN.joint_count, 12.0)
    drive.torque_on[:] = 1.0
    drive.p_gain_per_rad[:] = p_gain_per_rad(800, MOTORS["XM430-W350"])
    return drive


def crawl(body: MujocoPlant) -> np.ndarray:
    """Joint angles and the head's place after a part of a wave."""
    drive = held()
    for k in range(6):
        drive.goal_rad[::2] = 0.5 * np.sin(0.3 * k - np.arange(UNEVEN.joint_count)[::2])
        body.advance(0.05 * (k + 1), drive)
    return body.mechanics.data.qpos.copy()


def test_links_spelt_out_make_the_same_model_to_the_digit() -> None:
    for name in ("yaw16", "alternating12", "xl330-16"):
        robot = load_robot(name)
        same = spelt_out(robot)
        for ground in (None, HILLS):
            args = WorldConfig(name="w"), ground, 0.002
            assert mjcf(same, *args) == mjcf(robot, *args)
        np.testing.assert_array_equal(water_constants(POOL, same), water_constants(POOL, robot))


def test_the_ground_bears_what_each_link_weighs() -> None:
    body = MujocoPlant(UNEVEN, FLAT)
    bears = [shape != "none" for shape in UNEVEN.link_shapes]
    np.testing.assert_allclose(body.link_positions_m[:, 2], 0.04, atol=2e-4)  # held straight
    body.advance(0.5, held())
    load = body.mechanics.load_n
    assert abs(load.sum() - UNEVEN.mass_kg * GRAVITY_M_S2) < 0.01
    assert not load[~np.array(bears)].any()
    assert (load[[0, 2, 4]] > 0.0).all()
    assert load[-1] == 0.0  # it is half as thick as the others


def test_modules_of_two_axes_do_not_touch_themselves() -> None:
    pairs = overlapping_links(UNEVEN)
    assert {(0, 2), (2, 4), (4, 6), (6, 8), (8, 10)} <= set(pairs)
    assert (0, 4) not in pairs


def test_each_link_floats_by_its_own_weight() -> None:
    """As heavy as its water: nothing sinks, rises or turns, though the links differ."""
    body = MujocoPlant(UNEVEN, POOL)
    before = body.link_positions_m.copy()
    body.advance(1.0, make_drive([MOTORS["XM430-W350"]] * UNEVEN.joint_count, 12.0))
    np.testing.assert_allclose(body.link_positions_m, before, atol=1e-6)


@pytest.mark.slow
def test_compiled_and_numpy_steps_agree_on_links_that_differ() -> None:
    for ground in (None, HILLS):
        world = FLAT if ground is None else WorldConfig(name="hills")
        compiled, plain = (
            crawl(make(UNEVEN, world, ground, 0.002)) for make in (MujocoPlant, numpy_plant)
        )
        np.testing.assert_allclose(compiled, plain, atol=1e-6)


def test_on_hills_no_link_sinks_in() -> None:
    body = MujocoPlant(UNEVEN, WorldConfig(name="hills"), HILLS)
    radius_m = np.array(UNEVEN.link_radii_m)
    clear = body.link_positions_m[:, 2] - HILLS.elevation_m(*body.link_positions_m[:, :2].T)
    assert (clear > radius_m - 5e-3)[::2].all()  # the odd ones have no length and no belly
