"""Legs in the model: order, geometry, weight, grip of the feet, and equal answers of both steps."""

import mujoco
import numpy as np
import pytest

from snakewalk.config.constants import GRAVITY_M_S2
from snakewalk.config.ground import build_ground
from snakewalk.config.heightfield import HeightField
from snakewalk.config.loader import load_robot, load_world
from snakewalk.config.world import RampGround, ShoreGround, WaterGround
from snakewalk.sim.physics.mechanics import foot_geoms
from snakewalk.sim.physics.plant import MujocoPlant
from snakewalk.sim.physics.water import immersed
from snakewalk.sim.servo.motor import MOTORS, make_drive, p_gain_per_rad
from tests.helpers.physics import momentum
from tests.oracles.numpy_steps import numpy_plant

ROBOT = load_robot("salamander")
WORLD = load_world("isotropic")
HIND, FRONT = ROBOT.limbs
SPINE = len(ROBOT.joint_axes)
STAND = np.zeros(ROBOT.joint_count)
STAND[SPINE + 1 :: 2] = -0.6


def drive():
    servo = make_drive([MOTORS["XM430-W350"]] * ROBOT.joint_count, 12.0)
    servo.torque_on[:] = 1.0
    servo.p_gain_per_rad[:] = p_gain_per_rad(800, MOTORS["XM430-W350"])
    servo.goal_rad[:] = STAND
    return servo


def feet_m(joint_rad: np.ndarray) -> np.ndarray:
    """(4, 3) feet about the head's middle: hind left, hind right, front left, front right."""
    body = MujocoPlant(ROBOT, WORLD)
    body.mechanics.data.qpos[:3] = 0.0
    body.mechanics.data.qpos[3:7] = 1.0, 0.0, 0.0, 0.0
    body.mechanics.data.qpos[7:] = joint_rad
    mujoco.mj_kinematics(body.mechanics.model, body.mechanics.data)
    return np.array(body.mechanics.data.geom_xpos[foot_geoms(body.mechanics.model, ROBOT)])


def expected_m(pair: int, side: float, swing: float, lift: float) -> np.ndarray:
    """Closed form: the hip at its link's middle, two segments, swung and lifted."""
    limb = ROBOT.limbs[pair]
    first, second = limb.segments_m
    out = first + second * np.cos(lift)
    return np.array(
        [
            -limb.link * ROBOT.mean_link_length_m + out * np.sin(swing),
            side * (limb.hip_m + out * np.cos(swing)),
            second * np.sin(lift),
        ]
    )


def test_bodies_and_joints_stand_in_the_order_of_the_bus() -> None:
    model = MujocoPlant(ROBOT, WORLD).mechanics.model
    links = range(ROBOT.joint_count + 1)
    assert [model.body(1 + k).name for k in links] == [f"link{k}" for k in links]
    assert [model.joint(1 + k).name for k in links[:-1]] == list(ROBOT.joint_names)
    assert tuple(model.body_parentid[1:] - 1) == ROBOT.link_parents
    assert model.body_mass.sum() == pytest.approx(ROBOT.mass_kg)
    assert model.body_mass[-1] == HIND.segment_mass_kg


@pytest.mark.parametrize(("swing", "lift"), [(0.0, 0.0), (0.5, 0.0), (0.0, -0.6), (-0.4, 0.3)])
def test_yaw_swings_forward_and_roll_lifts_on_both_sides(swing: float, lift: float) -> None:
    joints = np.zeros(ROBOT.joint_count)
    joints[SPINE::2], joints[SPINE + 1 :: 2] = swing, lift
    wanted = [expected_m(pair, side, swing, lift) for pair in (0, 1) for side in (1.0, -1.0)]
    np.testing.assert_allclose(feet_m(joints), wanted, atol=1e-9)


def test_it_stands_still_on_four_feet_that_bear_all_of_it() -> None:
    body = MujocoPlant(ROBOT, WORLD)
    body.reset((0.2, -0.1), 0.7, STAND)
    body.advance(1.0, drive())
    start = body.link_positions_m
    body.advance(3.0, drive())
    moved = np.abs(body.link_positions_m - start).max()
    assert moved < 1e-3  # a third of a millimetre a second: MuJoCo's cone creeps
    load = body.mechanics.load_n
    feet = body.mechanics.model.geom_bodyid[foot_geoms(body.mechanics.model, ROBOT)] - 1
    assert load[feet].min() > 0.5
    assert load[feet].sum() == pytest.approx(ROBOT.mass_kg * GRAVITY_M_S2, rel=1e-3)
    # the moment about the front feet: what the hind feet bear lifts the rest
    x = body.link_positions_m @ [np.cos(0.7), np.sin(0.7), 0.0]
    mass = body.mechanics.model.body_mass[1:]
    ground_x = body.mechanics.data.geom_xpos[foot_geoms(body.mechanics.model, ROBOT)] @ [
        np.cos(0.7), np.sin(0.7), 0.0,
    ]  # fmt: skip
    lever = (mass @ x) * GRAVITY_M_S2
    assert load[feet] @ ground_x == pytest.approx(lever, rel=2e-3)


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("direction_rad", [0.0, 0.8, 1.57])
def test_feet_hold_up_to_their_friction_in_every_direction(direction_rad: float) -> None:
    """A push of a share of mu m g: under 1 it creeps less than a millimetre a second."""
    mu, weight_n = HIND.foot_friction, ROBOT.mass_kg * GRAVITY_M_S2
    way = {}
    for share in (0.6, 1.5):
        body = MujocoPlant(ROBOT, WORLD)
        body.reset((0.0, 0.0), 0.0, STAND)
        servo = drive()
        body.advance(0.5, servo)
        push = share * mu * weight_n * ROBOT_SHARES  # on each link by its mass
        body.mechanics.data.xfrc_applied[1:, 0] = push * np.cos(direction_rad)
        body.mechanics.data.xfrc_applied[1:, 1] = push * np.sin(direction_rad)
        body.advance(0.8, servo)  # the servos give way first
        was = centre_m(body)
        body.advance(1.1, servo)
        way[share] = float(np.hypot(*(centre_m(body) - was)[:2]))
    assert way[0.6] < 1e-3
    assert way[1.5] > 0.05


def centre_m(body: MujocoPlant) -> np.ndarray:
    mass = body.mechanics.model.body_mass[1:]
    return np.asarray(mass @ body.link_positions_m / mass.sum())


ROBOT_SHARES = np.array(
    [ROBOT.mean_link_mass_kg] * ROBOT.link_count + [HIND.segment_mass_kg] * len(ROBOT.limb_joints)
)
ROBOT_SHARES = ROBOT_SHARES / ROBOT_SHARES.sum()


@pytest.mark.slow_cases(1, "2 cases of 1.0 s of CPU")
@pytest.mark.slow
@pytest.mark.parametrize("world", ["isotropic", "pool"])
def test_compiled_and_numpy_steps_agree_with_legs(world: str) -> None:
    ends = []
    for make in (MujocoPlant, numpy_plant):
        body, servo = make(ROBOT, load_world(world), None, 0.002), drive()
        body.reset((0.0, 0.0), 0.3, STAND)
        for k in range(30):
            phase = 0.02 * k * 4.0
            servo.goal_rad[:SPINE] = 0.3 * np.sin(phase - 0.7 * np.arange(SPINE))
            servo.goal_rad[SPINE::2] = 0.4 * np.sin(phase + np.array([0.0, np.pi, np.pi, 0.0]))
            servo.goal_rad[SPINE + 1 :: 2] = 0.4 * np.cos(phase)  # it falls on its belly
            body.advance(0.02 * (k + 1), servo)
        ends.append((body.qpos, body.mechanics.totals[0], body.mechanics.load_n.copy()))
    np.testing.assert_allclose(ends[0][0], ends[1][0], atol=1e-9)
    assert ends[0][1] == pytest.approx(ends[1][1], rel=1e-6)
    assert ends[0][1] > 0.0  # bellies slid, or water was stirred
    np.testing.assert_allclose(ends[0][2], ends[1][2], atol=1e-6)


def test_thrown_through_the_air_momentum_and_spin_stay() -> None:
    """Links by their parents, not by their numbers: no force arises within the tree."""
    body, servo = MujocoPlant(ROBOT, WORLD, None, 0.0005), drive()
    body.mechanics.model.opt.gravity[:] = 0.0
    body.mechanics.data.qpos[2] = 5.0
    mujoco.mj_forward(body.mechanics.model, body.mechanics.data)
    body.mechanics.start_at_rest()
    for k in range(50):
        servo.goal_rad[SPINE:] = 0.5 * np.sin(0.1 * k + np.arange(8))
        body.advance(0.01 * (k + 1), servo)
    assert np.abs(body.position_rad[SPINE:]).max() > 0.2
    linear, spin = momentum(body)
    assert np.abs(linear).max() / ROBOT.mass_kg < 2e-3
    assert np.abs(spin).max() < 2e-4


def test_legs_that_stand_out_brake_in_water_as_rods_across_the_way() -> None:
    """``m v' = -c v^2`` has the solution ``v0 / (1 + c v0 t / m)``; c: the spine's skin, the legs.

    Folded back by ``f`` a rod is crossed by ``v cos f`` and slid along by ``v sin f``: its drag
    along the way is ``(c_across cos^3 f + c_along sin^3 f) v^2``.
    """
    ground = load_world("pool").ground
    assert isinstance(ground, WaterGround)
    half_rho = 0.5 * ground.density_kg_m3
    skin, cross = half_rho * ground.drag_along * np.pi, half_rho * ground.drag_across * 2.0
    rod_m = 4.0 * sum(HIND.segments_m)
    for fold_rad in (0.0, 1.1):
        body, servo = MujocoPlant(ROBOT, load_world("pool"), step_s=0.001), drive()
        servo.goal_rad[:] = 0.0
        servo.goal_rad[SPINE::2] = -fold_rad
        body.reset((0.0, 0.0), 0.0, servo.goal_rad)
        body.mechanics.data.qvel[0] = 0.5
        body.mechanics.start_at_rest()
        start = centre_m(body)
        body.advance(1.0, servo)
        along = skin * ROBOT.body_radius_m * ROBOT.length_m
        across = HIND.foot_radius_m * rod_m * cross * np.cos(fold_rad) ** 3
        slid = HIND.foot_radius_m * rod_m * skin * np.sin(fold_rad) ** 3
        k = (along + across + slid) / ROBOT.mass_kg
        way = centre_m(body) - start
        assert way[0] == pytest.approx(np.log(1.0 + 0.5 * k) / k, rel=0.02)
        assert np.abs(way[1:]).max() < 1e-3


@pytest.mark.slow
def test_a_level_field_bears_the_feet_as_the_floor_does() -> None:
    ends = []
    level = HeightField(np.zeros((41, 41)), 0.1, -2.0, -2.0)
    for ground in (None, level):
        body, servo = MujocoPlant(ROBOT, WORLD, ground, 0.001), drive()
        body.reset((0.0, 0.0), 0.3, STAND)
        for k in range(60):
            phase = 0.02 * k * 4.0
            servo.goal_rad[SPINE::2] = 0.4 * np.sin(phase + np.array([0.0, np.pi, np.pi, 0.0]))
            servo.goal_rad[SPINE + 1 :: 2] = -0.4 + 0.2 * np.cos(phase)
            body.advance(0.02 * (k + 1), servo)
        ends.append((body.qpos, body.mechanics.load_n.copy()))
    assert np.abs(ends[0][0][:2]).max() > 0.005  # it went
    np.testing.assert_allclose(ends[1][0], ends[0][0], atol=1e-5)
    assert ends[1][1].sum() == pytest.approx(ends[0][1].sum(), rel=0.02)


def test_feet_on_a_slope_bear_its_cosine_and_hold_until_the_friction_ends() -> None:
    """A body stands still while the tangent of the slope is under the feet's friction, 0.8."""
    weight_n, way_m = ROBOT.mass_kg * GRAVITY_M_S2, {}
    for slope_rad in (0.3, 0.9):
        world = WORLD.model_copy(update={"ground": RampGround(slope_rad=slope_rad, spacing_m=0.05)})
        body = MujocoPlant(ROBOT, world, build_ground(world))
        body.reset((0.2, 0.0), 0.5, STAND)
        body.advance(0.5, drive())
        was = centre_m(body)
        body.advance(1.0, drive())
        way_m[slope_rad] = float(np.linalg.norm(centre_m(body) - was))
        if slope_rad < 0.5:
            feet = body.mechanics.model.geom_bodyid[foot_geoms(body.mechanics.model, ROBOT)] - 1
            load = body.mechanics.load_n
            assert load[feet].sum() == pytest.approx(load.sum())
            assert load.sum() == pytest.approx(weight_n * np.cos(slope_rad), rel=0.01)
    assert way_m[0.3] < 2e-3
    assert way_m[0.9] > 0.05


def test_off_a_shore_it_floats_and_on_the_beach_it_stands() -> None:
    """Archimedes: five sixths of a body of buoyancy 1.2 are under water."""
    world = load_world("shore")
    ground = build_ground(world)
    assert isinstance(world.ground, ShoreGround)
    for x_m, floats in ((-1.5, True), (1.5, False)):
        body, servo = MujocoPlant(ROBOT, world, ground), drive()
        body.reset((x_m, 0.0), 0.0, STAND)
        body.advance(0.5, servo)
        assert (body.contact_count == 0) == floats
        wet = [
            immersed(z, r, world.ground.depth_m)
            for z, r in zip(body.link_positions_m[:, 2], body.mechanics.water[:, 3], strict=True)
        ]
        carried = float(np.dot(wet, body.mechanics.water[:, 5]))
        assert carried == pytest.approx(floats * ROBOT.mass_kg * GRAVITY_M_S2, rel=0.02)
