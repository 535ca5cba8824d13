"""Habits of a crowd's species: they school, feed, pursue, flee and swim; one is steered."""

import numpy as np
import pytest

from snakewalk.config.arrays import Floats
from snakewalk.config.ground import build_ground, water_surface_m
from snakewalk.config.heightfield import HeightField
from snakewalk.config.loader import load_robot, load_world
from snakewalk.controller.repertoire.behaviour import DEPTH_LENGTHS, PITCH_RAD, Wandering
from snakewalk.controller.repertoire.habit import Habit
from snakewalk.controller.repertoire.repertoire import Repertoire
from snakewalk.controller.repertoire.repertoire_recording import ACTIONS, record
from snakewalk.controller.repertoire.species import Species, joined

pytestmark = pytest.mark.costs("the first test compiles the loops of a crowd")

GROUND = HeightField(np.zeros((41, 41)), 0.25, -5.0, -5.0)


def species(
    repertoire: Repertoire, bodies: int, habit: Habit, size: float = 0.25, links: int = 17
) -> Species:
    return Species(repertoire, np.full(bodies, size), np.full(links, 0.025), habit)


@pytest.fixture(scope="module")
def small() -> Repertoire:
    """Quick actions of a robot with fewer links."""
    quick = tuple(one for one in ACTIONS if one.frequency_hz > 0.4)
    return record(load_robot("printed12"), load_world("flat"), quick)


@pytest.fixture(scope="module")
def swimmer() -> Repertoire:
    quick = tuple(one for one in ACTIONS if one.frequency_hz > 0.4 and one.kind != "brake")
    return record(load_robot("yaw16"), load_world("pool"), quick)


def order(crowd: Wandering) -> float:
    """Length of the mean direction of all bodies: 1 if they swim alike."""
    ahead = crowd.crowd.rotation[:, [0, 3]]
    return float(np.linalg.norm(ahead.mean(axis=0)))


def spread_m(crowd: Wandering) -> float:
    at = crowd.crowd.origin_m[:, :2]
    return float(np.linalg.norm(at - at.mean(axis=0), axis=1).mean())


@pytest.mark.slow
def test_a_school_goes_one_way_and_stays_together(repertoire: Repertoire) -> None:
    ended = {}
    for habit in (Habit.SCHOOL, Habit.WANDER):
        crowd = Wandering([species(repertoire, 20, habit)], GROUND, seed=3)
        orders = []
        for _ in range(40):
            crowd.step(60)
            orders.append(order(crowd))
        ended[habit] = float(np.mean(orders[20:])), spread_m(crowd)
    assert ended[Habit.SCHOOL][0] > 2.0 * ended[Habit.WANDER][0]
    assert ended[Habit.SCHOOL][1] < 0.6 * ended[Habit.WANDER][1]


@pytest.mark.slow
def test_bodies_that_feed_reach_food_and_others_none(repertoire: Repertoire) -> None:
    both = [species(repertoire, 8, Habit.FEED), species(repertoire, 8, Habit.WANDER)]
    crowd = Wandering(both, GROUND, seed=1)
    before = crowd.food_m.copy()
    assert len(before) == 2
    crowd.step(2400)
    assert crowd.reached[:8].sum() >= 4
    assert crowd.reached[8:].sum() == 0
    assert (crowd.food_m != before).any()


@pytest.mark.slow
def test_prey_flees_and_is_pursued(repertoire: Repertoire, small: Repertoire) -> None:
    """The hunters are nearer to their prey than bodies that wander; the prey goes from them."""
    near = {}
    for habit in (Habit.PURSUE, Habit.WANDER):
        herd = [
            species(repertoire, 12, Habit.WANDER, 0.2),
            species(small, 3, habit, 0.6, small.segments[0].link_m.shape[1]),
        ]
        crowd = Wandering(herd, GROUND, seed=4)
        gaps = []
        for _ in range(30):
            crowd.step(60)
            at = crowd.crowd.origin_m[:, :2]
            gaps.append(np.linalg.norm(at[12:, None] - at[None, :12], axis=2).min(axis=1).mean())
        near[habit] = float(np.mean(gaps[10:]))
    assert near[Habit.PURSUE] < 0.7 * near[Habit.WANDER]
    crowd = Wandering([herd[0], species(repertoire, 1, Habit.PURSUE)], GROUND, seed=4)
    crowd.crowd.origin_m[12, :2] = crowd.crowd.origin_m[0, :2] + [0.3, 0.0]
    assert crowd.aim(0) == crowd.fastest_m_s[0]
    away = crowd.goal_m[0] - crowd.crowd.origin_m[0]
    np.testing.assert_allclose(away[:2], [-0.3, 0.0], atol=1e-9)


@pytest.mark.slow
def test_fish_ascend_and_descend_in_the_water_and_snakes_stay_on_land(
    swimmer: Repertoire, repertoire: Repertoire
) -> None:
    world = load_world("shore")
    ground = build_ground(world)
    assert ground is not None
    surface = water_surface_m(world, ground)
    assert surface is not None
    both = [species(swimmer, 6, Habit.WANDER, 0.12), species(repertoire, 6, Habit.WANDER, 0.2)]
    crowd = Wandering(both, ground, seed=2, surface_m=float(surface[0][2]))
    heights: list[Floats] = []
    for _ in range(60):
        crowd.step(30)
        at = crowd.crowd.origin_m
        bed = ground.elevation_m(at[:, 0], at[:, 1])
        margin = DEPTH_LENGTHS * crowd.length_m[:6] - 0.01
        assert (at[:6, 2] > bed[:6] + margin).all()
        assert (at[:6, 2] < surface[0][2] - margin).all()
        assert (bed[6:] > surface[0][2] - 0.03).all()
        slope = np.arcsin(crowd.crowd.rotation[:6, 6])
        assert np.abs(slope).max() < PITCH_RAD + 0.1
        heights.append(at[:6, 2].copy())
    assert np.ptp(np.array(heights), axis=0).max() > 0.03


@pytest.mark.slow
def test_a_body_is_steered_and_sent(repertoire: Repertoire) -> None:
    crowd = Wandering([species(repertoire, 1, Habit.WANDER)], GROUND, seed=0)
    ahead = crowd.crowd.rotation[0, [0, 3]].copy()
    crowd.pilot(float(crowd.fastest_m_s[0]), 0.9)
    crowd.step(60)
    turned = crowd.crowd.rotation[0, [0, 3]]
    assert ahead[0] * turned[1] - ahead[1] * turned[0] > 0.4
    goal = 0.7 * crowd.crowd.origin_m[0]  # towards the middle of the ground
    crowd.send(goal)
    gap = [np.linalg.norm((crowd.crowd.origin_m[0] - goal)[:2])]
    for _ in range(40):
        crowd.step(60)
        gap.append(np.linalg.norm((crowd.crowd.origin_m[0] - goal)[:2]))
    assert min(gap) < crowd.length_m[0]


def test_species_with_other_numbers_of_links_have_one_crowd(
    repertoire: Repertoire, small: Repertoire
) -> None:
    links = small.segments[0].link_m.shape[1]
    assert links < 17
    both = [species(repertoire, 1, Habit.WANDER), species(small, 1, Habit.WANDER, links=links)]
    together, radii = joined(both)
    assert len(together.segments) == len(repertoire.segments) + len(small.segments)
    assert [len(each) for each in radii] == [17, 17]
    shape = together.segments[-1].link_m[0]
    given = small.segments[-1].link_m[0]
    np.testing.assert_allclose(shape[[0, -1]], given[[0, -1]], atol=1e-12)
    off = np.linalg.norm(shape[:, None] - given[None], axis=2).min(axis=1)
    assert off.max() < np.linalg.norm(np.diff(given, axis=0), axis=1).max()
