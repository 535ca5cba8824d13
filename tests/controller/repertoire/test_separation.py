"""Bodies of a crowd do not enter each other."""

import numpy as np
import pytest

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.heightfield import HeightField
from snakewalk.controller.kinematics.frame import Frame
from snakewalk.controller.repertoire import separation
from snakewalk.controller.repertoire.behaviour import Wandering
from snakewalk.controller.repertoire.crowd import Crowd
from snakewalk.controller.repertoire.repertoire import Repertoire
from snakewalk.controller.repertoire.separation import NONE, SeparatedCrowd
from snakewalk.controller.repertoire.species import Species

pytestmark = pytest.mark.costs("the first test compiles the loops of a crowd")

RADIUS_M = np.full(17, 0.025)


def gap_m(one: Floats, other: Floats) -> float:
    """Distance of two centre lines in the plane, by dense points."""
    share, links = np.linspace(0.0, 16.0, 321), np.arange(17.0)
    a, b = (
        np.column_stack([np.interp(share, links, line[:, k]) for k in (0, 1)])
        for line in (one, other)
    )
    return float(np.linalg.norm(a[:, None] - b[None], axis=2).min())


@pytest.mark.slow
def test_two_bodies_that_meet_head_on_stop_before_they_touch(repertoire: Repertoire) -> None:
    fast = repertoire.index("forward-fast")
    free, apart = (Crowd(repertoire, 2) for _ in range(2))
    for crowd in (free, apart):
        crowd.place(0, Frame.flat(-0.9, 0.0, 0.0), segment=fast)
        crowd.place(1, Frame.flat(0.9, 0.0, np.pi), segment=fast)
        crowd.step()
    separated = SeparatedCrowd(apart, RADIUS_M, repertoire.length_m)
    through, least, waits = np.inf, np.inf, 0
    for _ in range(150):
        free.step()
        waits += int((~separated.step()).sum())
        through = min(through, gap_m(free.link_m(0), free.link_m(1)))
        least = min(least, gap_m(apart.link_m(0), apart.link_m(1)))
    assert through < 0.01
    assert 0.05 <= least < 0.06
    assert waits > 5
    assert not len(separated.intersecting())


def test_the_body_that_moves_into_a_resting_one_is_the_one_that_waits(
    repertoire: Repertoire,
) -> None:
    crowd = Crowd(repertoire, 2)
    crowd.place(0, Frame.flat(0.9, 0.0, 0.5 * np.pi), segment=repertoire.index("rest"))
    crowd.place(1, Frame.flat(0.0, 0.0, 0.0), segment=repertoire.index("forward-fast"))
    crowd.step()
    separated = SeparatedCrowd(crowd, RADIUS_M, repertoire.length_m)
    rested = crowd.origin_m[0].copy()
    for _ in range(60):
        separated.step()
    assert separated.blocker.tolist() == [NONE, 0]
    assert separated.met[1] < 0.2
    np.testing.assert_allclose(crowd.origin_m[0], rested, atol=2e-3)


def test_compiled_loops_find_what_python_finds(repertoire: Repertoire) -> None:
    random = np.random.default_rng(1)
    crowd = Crowd(repertoire, 12)
    for body in range(12):
        at = random.uniform(-0.8, 0.8, 2)
        crowd.place(body, Frame.flat(*at, random.uniform(-3, 3)), scale=random.uniform(0.4, 1.0))
    crowd.step()
    found = SeparatedCrowd(crowd, RADIUS_M, repertoire.length_m).intersecting().tolist()
    expected = set()
    pairs = 0
    for i in range(12):
        for j in range(i):
            one, other = crowd.link_m(i), crowd.link_m(j)
            near = gap_m(one, other) < 0.025 * (crowd.scale[i] + crowd.scale[j])
            pairs += near
            expected |= {i} if near else set()
            plain = separation._meeting(
                crowd.points_m[i],
                RADIUS_M * crowd.scale[i],
                crowd.points_m[j],
                RADIUS_M * crowd.scale[j],
            )
            assert (plain[0] != NONE) == near
    assert pairs > 5
    assert found == sorted(expected)


def test_an_interrupted_body_goes_on_from_its_own_shape(repertoire: Repertoire) -> None:
    crowd = Crowd(repertoire, 1)
    crowd.place(0, Frame.flat(0.2, 0.1, 0.4), segment=repertoire.index("forward-fast"))
    crowd.step(31)
    before, frame = crowd.link_m(0), crowd.origin_m[0].copy()
    crowd.interrupt(0, repertoire.index("reverse"))
    crowd.step()
    assert np.abs(crowd.link_m(0) - before).max() < 0.025
    crowd.step(90)
    moved = (crowd.origin_m[0] - frame)[:2] @ [np.cos(0.4), np.sin(0.4)]
    assert moved < -0.2


@pytest.mark.slow
def test_a_crowd_wanders_without_intersections(repertoire: Repertoire) -> None:
    ground = HeightField(np.zeros((9, 9)), 1.0, -4.0, -4.0)
    sizes = np.full(40, 0.4)
    apart, through = (
        Wandering([Species(repertoire, sizes, RADIUS_M)], ground, seed=3, separate=separate)
        for separate in (True, False)
    )
    assert apart.separated is not None
    counter = SeparatedCrowd(through.crowd, RADIUS_M, repertoire.length_m)
    met = 0
    start = apart.crowd.origin_m.copy()
    for _ in range(30):
        apart.step(10)
        through.step(10)
        assert not len(apart.separated.intersecting())
        met += len(counter.intersecting())
    assert met > 10
    gone = np.linalg.norm(apart.crowd.origin_m - start, axis=1)
    assert np.median(gone) > 0.4


def test_a_ground_without_room_is_rejected(repertoire: Repertoire) -> None:
    small = HeightField(np.zeros((4, 4)), 0.5, 0.0, 0.0)
    with pytest.raises(InputError, match="too small for them"):
        Wandering([Species(repertoire, np.ones(40), RADIUS_M)], small)
