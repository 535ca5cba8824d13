"""Spine gaits: their table, the standing form that goes nowhere, and the water they swim in."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from snakewalk.config.loader import load_robot, load_world
from snakewalk.config.world import WaterGround
from snakewalk.controller.gaits.registry import make_gait
from snakewalk.controller.gaits.spine import Anguilliform, SpineParameters, offset, spine_bends_rad
from snakewalk.sim.physics.plant import MujocoPlant
from snakewalk.sim.physics.water import floating_height_m, immersed
from tests.helpers.swimming import a_still_drive, follow
from tests.helpers.tiers import slow_after
from tests.oracles.numpy_steps import numpy_plant
from tests.oracles.planar_swimmer import swim

YAW16 = load_robot("yaw16")
MODES = ("anguilliform", "subcarangiform", "carangiform", "thunniform")
TURN = 2.0 * np.pi
PHASES = np.linspace(0.0, TURN, 64, endpoint=False)


def pool(**changes: float) -> WaterGround:
    ground = load_world("pool").ground
    assert isinstance(ground, WaterGround)
    return ground.model_copy(update=changes)


@pytest.mark.parametrize(
    ("mode", "nose", "tail", "alpha", "omega"),
    [
        ("anguilliform", 0.0, 0.3, 1.5, 1.0),
        ("subcarangiform", 0.0, 1.0, 0.75, 2.0),
        ("carangiform", 0.1, 0.1, 1.0, 2.0),
        ("thunniform", 0.0, 1.0, 0.25, 1.0),
        ("thunniform-dolphin", 1.0, 1.0, 0.75, 1.3),
    ],
)
def test_modes_are_the_papers_table(
    mode: str, nose: float, tail: float, alpha: float, omega: float
) -> None:
    p = make_gait(mode).params
    assert (p.nose, p.tail, p.waves, p.frequency_hz) == (nose, tail, alpha, omega)
    assert p.standing is False


def test_the_travelling_wave_runs_to_the_tail_and_the_printed_one_stands() -> None:
    """Zero crossings go back along the body with time in one form and stay in the other."""
    u = np.linspace(0.3, TURN, 4000)
    for standing, speed in ((False, 1.0 / 1.5), (True, 0.0)):
        p = SpineParameters(standing=standing)
        now, later = offset(u, np.array([1.0, 1.2]), p)
        zeros = [u[:-1][np.diff(np.sign(y)) != 0][0] for y in (now, later)]
        assert zeros[1] - zeros[0] == pytest.approx(0.2 * speed, abs=3e-3)


def test_bends_of_a_slight_wave_are_its_second_difference() -> None:
    """Closed form for a small amplitude: the headings are the slopes between equal parts."""
    p = SpineParameters(nose=1e-3, tail=1e-3, waves=1.0)
    bends = spine_bends_rad(PHASES, 16, p)
    edges = np.linspace(0.0, TURN, 18)
    y = 1e-3 * np.sin(edges - PHASES[:, None])
    wanted = np.diff(y, n=2, axis=1) / (TURN / 17)
    np.testing.assert_allclose(bends, wanted, atol=2e-6)


@pytest.mark.parametrize("mode", MODES)
def test_printed_standing_wave_is_its_own_reverse_and_has_no_thrust_direction(mode: str) -> None:
    """[GC] Eq. 11: played backwards it is the same motion, so it pushes neither way.

    In a medium without memory a motion and its reverse go opposite ways (E. M. Purcell, Life at low
    Reynolds number, 1977); one that is both goes nowhere. The travelling form is not.
    """
    standing, travelling = (make_gait(mode, {"standing": flag}) for flag in (True, False))
    forth, back = (standing.joints_rad(YAW16, each) for each in (PHASES, np.pi - PHASES))
    np.testing.assert_allclose(forth, back, atol=1e-12)
    forth = travelling.joints_rad(YAW16, PHASES)
    apart = [np.abs(forth - travelling.joints_rad(YAW16, shift - PHASES)).max() for shift in PHASES]
    assert min(apart) > 0.1 * np.abs(forth).max()


@pytest.mark.slow_cases(1, "3 cases of 0.9 s of CPU")
@pytest.mark.costs("simulates a swimmer")
@pytest.mark.parametrize("mode", slow_after(1, MODES))
def test_every_mode_swims_forward_as_the_planar_model_says(mode: str) -> None:
    """The physics against a model that shares no code with it, with the joints as they moved."""
    run = follow(make_gait(mode), "yaw16", "pool", 6.0, grow_s=2.0)
    ground = pool()
    time_s = np.concatenate([[0.0], run.time_s])
    moved = CubicSpline(time_s, np.vstack([np.zeros(16), run.joint_rad]))
    rate = moved.derivative()
    r, link, mass = YAW16.body_radius_m, YAW16.mean_link_length_m, YAW16.mean_link_mass_kg
    way = swim(
        17,
        link,
        mass,
        mass * (3 * r**2 + link**2) / 12,
        (
            0.5 * ground.density_kg_m3 * ground.drag_across * 2 * r,
            0.5 * ground.density_kg_m3 * ground.drag_along * np.pi * r,
        ),
        lambda t: (moved(t), rate(t)),
        run.time_s,
    )
    came = run.centre_m[:, :2] - (-0.5 * 16 * link, 0.0)
    print(mode, "physics", came[-1], "planar", way[-1])
    assert came[-1, 0] > 0.15
    np.testing.assert_allclose(came[-1], way[-1], atol=0.02 * float(np.hypot(*way[-1])))


def test_the_standing_wave_swims_far_less_than_the_travelling_one() -> None:
    """On the physics a body has inertia: what is left is not exactly nothing."""
    speeds = []
    for standing in (False, True):
        gait = Anguilliform.of({"standing": standing})
        speeds.append(follow(gait, "yaw16", "pool", 8.0, grow_s=2.0).way_m(4)[0])
    print("m a cycle, travelling and standing:", speeds)
    assert abs(speeds[1]) < 0.15 * speeds[0]


def test_a_trimmed_body_stays_at_its_depth_and_a_light_one_at_the_surface() -> None:
    """Archimedes: the share under water is one over the buoyancy."""
    for buoyancy in (1.0, 1.8):
        world = load_world("pool").model_copy(update={"ground": pool(buoyancy=buoyancy)})
        plant = MujocoPlant(YAW16, world)
        before = plant.link_positions_m[:, 2].copy()
        plant.advance(1.0, a_still_drive(YAW16))
        np.testing.assert_allclose(plant.link_positions_m[:, 2], before, atol=1e-4)
    height = floating_height_m(pool(buoyancy=1.8), 0.03)
    assert immersed(height, 0.03, 0.6) == pytest.approx(1.0 / 1.8, abs=1e-9)
    assert floating_height_m(pool(buoyancy=0.5), 0.03) == 0.03


def test_a_straight_body_is_braked_by_the_water_as_written() -> None:
    """``m v' = -c v^2`` has the solution ``v0 / (1 + c v0 t / m)``, along and across."""
    ground = pool()
    r = YAW16.body_radius_m
    for axis, per_m in (
        (0, 0.5 * ground.density_kg_m3 * ground.drag_along * np.pi * r),
        (1, 0.5 * ground.density_kg_m3 * ground.drag_across * 2.0 * r),
    ):
        plant = MujocoPlant(YAW16, load_world("pool"), step_s=0.001)
        plant.mechanics.data.qvel[axis] = 1.0
        start = plant.link_positions_m.mean(axis=0)[axis]
        plant.mechanics.start_at_rest()
        plant.advance(1.0, a_still_drive(YAW16))
        k = per_m * YAW16.mean_link_length_m / YAW16.mean_link_mass_kg
        way = plant.link_positions_m.mean(axis=0)[axis] - start
        assert way == pytest.approx(np.log(1.0 + k) / k, rel=0.02)
        lost = 0.5 * 17 * YAW16.mean_link_mass_kg * (1.0 - 1.0 / (1.0 + k) ** 2)
        assert plant.mechanics.totals[0] == pytest.approx(lost, rel=0.03)


@pytest.mark.parametrize("mode", MODES)
def test_legs_are_folded_back_while_the_spine_swims(mode: str) -> None:
    robot = load_robot("salamander")
    joints = make_gait(mode, {"fold_rad": 0.9}).joints_rad(robot, PHASES)
    spine = spine_bends_rad(PHASES, 8, make_gait(mode).params)
    np.testing.assert_allclose(joints[:, :8], spine, atol=1e-12)
    np.testing.assert_array_equal(joints[:, 8::2], -0.9)  # yaw: back on both sides
    np.testing.assert_array_equal(joints[:, 9::2], 0.0)


def test_a_salamander_swims_thrice_as_far_with_its_legs_folded() -> None:
    """Legs that stand out brake it; a cycle takes it a quarter of its length with them folded."""
    ways = []
    for fold_rad in (1.1, 0.0):
        gait = make_gait("subcarangiform", {"fold_rad": fold_rad, "frequency_hz": 0.8})
        run = follow(gait, "salamander", "pool", 8.0, grow_s=2.0)
        ways.append(run.way_m(4))
    print("m a cycle, legs folded and straight out:", ways)
    assert ways[0][0] > 2.5 * ways[1][0] > 0.0
    assert 0.2 < ways[0][0] / 0.63 < 0.5


@pytest.mark.slow
def test_compiled_and_numpy_water_agree() -> None:
    ends = [
        follow(Anguilliform(), "yaw16", "pool", 0.5, grow_s=0.25, make_plant=make).centre_m
        for make in (MujocoPlant, numpy_plant)
    ]
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-9)
