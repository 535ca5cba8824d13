"""Rolling helices: their shape, which way they go, and how far they climb on the physics."""

import numpy as np
import pytest

from snakewalk.config.loader import load_robot, load_world
from snakewalk.config.world import PipeObstacle, PoleObstacle, WorldConfig
from snakewalk.controller.gaits.gait import Gait
from snakewalk.controller.gaits.helix import HelixPipe, HelixPole, helix_joints_rad
from snakewalk.sim.physics.obstacles import fit_coil
from snakewalk.sim.physics.plant import MujocoPlant
from tests.helpers.physics import link_rotations
from tests.helpers.swimming import follow
from tests.helpers.tiers import slow_after
from tests.oracles.numpy_steps import numpy_plant

ROBOT = load_robot("alternating16")
PHASES = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)


def test_links_of_the_gait_lie_on_the_helix_that_it_states() -> None:
    """Radius and hand from the physics' own kinematics, at every phase; zigzag of 70 mm links."""
    plant = MujocoPlant(ROBOT, load_world("flat"))
    for hand in (1, -1):
        for phase in PHASES[::6]:
            q = helix_joints_rad(ROBOT, np.array([phase]), 0.12, 0.35, hand)[0]
            plant.mechanics.data.qpos[:7] = 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0
            plant.mechanics.data.qpos[7:] = q
            links = plant.link_positions_m
            coil = fit_coil(links)
            assert coil.radius_m.mean() == pytest.approx(0.12, rel=0.07)
            assert np.ptp(coil.radius_m) < 0.025
            assert coil.wound_rad == pytest.approx(16 * 0.07 * np.cos(0.35) / 0.12, rel=0.08)
            away = links - coil.centre_m
            turned = (np.cross(away[1:], away[:-1]) @ coil.axis).sum()
            assert (
                np.sign(turned) == hand
            )  # towards the head, seen from there: left is right-handed


def test_a_cylinder_through_an_exact_helix_is_its_own() -> None:
    turn = np.linspace(0.0, 7.0, 17)
    links = np.stack([0.1 * np.cos(turn), 0.1 * np.sin(turn), -0.03 * turn], axis=1)
    tilt = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
    coil = fit_coil(links @ tilt.T + (1.0, 2.0, 3.0))
    np.testing.assert_allclose(coil.radius_m, 0.1, atol=1e-5)
    np.testing.assert_allclose(np.abs(coil.axis @ tilt[:, 2]), 1.0, atol=1e-6)
    assert coil.axis @ tilt[:, 2] > 0.0
    assert coil.wound_rad == pytest.approx(7.0, abs=1e-3)


@pytest.mark.parametrize("gait", [HelixPole(), HelixPipe()])
def test_opposite_hands_are_mirror_images_and_backward_is_reversed(gait: Gait) -> None:
    kind = type(gait)
    other = kind.of({"left_handed": True}).joints_rad(ROBOT, PHASES)
    mirrored = kind.of({"mirror": True}).joints_rad(ROBOT, np.pi + PHASES)
    np.testing.assert_allclose(other, mirrored, atol=1e-12)
    back = kind.of({"backward": True}).joints_rad(ROBOT, PHASES)
    np.testing.assert_allclose(back, gait.joints_rad(ROBOT, -PHASES), atol=1e-12)


@pytest.mark.slow_cases(1, "3 cases of 0.8 s of CPU")
@pytest.mark.costs("simulates a climb")
@pytest.mark.parametrize(
    ("gait", "world", "sign"),
    slow_after(
        1,
        [
            (HelixPole(), "pole", 1.0),
            (HelixPole.of({"left_handed": True}), "pole", 1.0),
            (HelixPipe(), "pipe", 1.0),
            (HelixPipe.of({"left_handed": True}), "pipe", 1.0),
        ],
    ),
)
def test_it_climbs_as_far_a_cycle_as_a_rolling_body_does(
    gait: HelixPole | HelixPipe, world: str, sign: float
) -> None:
    """``2 pi r cos(rise)``, straight up, against the body's weight, and a fifth to a third more.

    Links of 7 cm are chords of the coil: their ends roll on another circle than their middles.
    """
    run = follow(gait, "alternating16", world, 8.0, hold_s=1.0)
    climb = run.way_m(1)[2]
    print(f"{gait.name}: {climb:.3f} m a cycle, rolling without slip {gait.advance_m():.3f}")
    assert 1.0 < sign * climb / gait.advance_m() < 1.35
    assert run.plant.contact_count >= 3


@pytest.mark.nightly("a further climb: 2 s of CPU")
def test_short_links_climb_a_pole_as_rolling_without_slip_does() -> None:
    gait = HelixPole()
    climb = follow(gait, "alternating32", "pole", 8.0, hold_s=1.0).way_m(1)[2]
    assert climb == pytest.approx(gait.advance_m(), rel=0.05)


@pytest.mark.slow
def test_a_pipe_that_lies_is_crept_through_and_backward_goes_back() -> None:
    lying = PipeObstacle(radius_m=0.15, upright=False)
    world = load_world("pipe").model_copy(update={"obstacle": lying})
    for backward, sign in ((False, 1.0), (True, -1.0)):
        gait = HelixPipe.of({"backward": backward})
        way = follow(gait, "alternating16", world, 8.0, hold_s=1.0).way_m(1)[0]
        assert 1.0 < sign * way / gait.advance_m() < 1.35


def slipping(friction: float) -> WorldConfig:
    pole = PoleObstacle(radius_m=0.09, friction=friction)
    return load_world("pole").model_copy(update={"obstacle": pole})


def test_without_friction_it_falls() -> None:
    held, fell = (
        follow(HelixPole(), "alternating16", slipping(mu), 1.5, hold_s=1.5) for mu in (0.8, 0.01)
    )
    assert held.centre_m[-1, 2] - held.centre_m[0, 2] > -0.02
    assert fell.centre_m[-1, 2] - fell.centre_m[0, 2] < -0.06


def test_a_straight_body_is_laid_beside_a_pole_and_into_a_pipe() -> None:
    beside = MujocoPlant(ROBOT, load_world("pole"))
    assert np.ptp(beside.link_positions_m[:, 2]) < 1e-6
    inside = MujocoPlant(ROBOT, load_world("pipe"))
    assert np.hypot(*inside.link_positions_m[:, :2].T).max() < 1e-6
    assert link_rotations(inside)[0][2, 0] > 0.999


def test_a_coil_starts_just_clear_of_what_it_will_hold() -> None:
    for gait, world, inner, outer in (
        (HelixPole(), "pole", 0.12, 0.15),
        (HelixPipe(), "pipe", 0.09, 0.1201),
    ):
        plant = MujocoPlant(ROBOT, load_world(world))
        plant.reset((0.0, 0.0), 0.0, gait.joints_rad(ROBOT, np.zeros(1))[0])
        thing = load_world(world).obstacle
        assert thing is not None
        away = np.hypot(*(plant.link_positions_m[:, :2] - thing.at_m).T)
        assert inner - 1e-3 <= away.min()
        assert away.max() <= outer


@pytest.mark.slow
def test_compiled_and_numpy_steps_agree_at_a_pole() -> None:
    ends = [
        follow(HelixPole(), "alternating16", "pole", 0.5, hold_s=0.2, make_plant=make).centre_m
        for make in (MujocoPlant, numpy_plant)
    ]
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-6)
