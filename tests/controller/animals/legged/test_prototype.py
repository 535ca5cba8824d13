"""The prototype of an animal that goes straight, against closed forms."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from snakewalk.config.animal import AnimalConfig
from snakewalk.controller.animals.legged.animal_synthesis import ANIMALS, read_animal
from snakewalk.controller.animals.legged.prototype import (
    LEGS,
    SEGMENTS,
    printed_feet,
    prototype,
)

SHIPPED = [read_animal(name) for name in ANIMALS]


def over(animal: AnimalConfig, cycles: float = 3.0, each: int = 48) -> np.ndarray:
    """Times of whole cycles."""
    return np.arange(round(cycles * each) + 1) * animal.cycle_s / each


@pytest.mark.parametrize("animal", SHIPPED, ids=ANIMALS)
def test_a_foot_on_the_ground_stays_where_it_is(animal: AnimalConfig) -> None:
    made = prototype(animal, over(animal))
    stays = made.on_ground[1:] & made.on_ground[:-1]
    assert stays.sum() > 100
    way = np.linalg.norm(np.diff(made.foot_m, axis=0), axis=-1)
    assert way[stays].max() < 1e-12
    assert np.abs(made.foot_m[..., 2][made.on_ground]).max() < 1e-12


@pytest.mark.parametrize("animal", SHIPPED, ids=ANIMALS)
def test_a_cycle_later_everything_is_a_stride_further(animal: AnimalConfig) -> None:
    times = over(animal)
    one, next_ = prototype(animal, times), prototype(animal, times + animal.cycle_s)
    stride = np.array([animal.stride * animal.length_m, 0.0, 0.0])
    for name in ("spine_m", "hip_m", "foot_m"):
        np.testing.assert_allclose(
            getattr(next_, name), getattr(one, name) + stride, atol=1e-12, err_msg=name
        )


@pytest.mark.parametrize("animal", SHIPPED, ids=ANIMALS)
def test_segments_keep_their_length_and_the_chart_is_the_duty(animal: AnimalConfig) -> None:
    made = prototype(animal, over(animal, 4.0, 500)[:-1])
    length = np.linalg.norm(np.diff(made.spine_m, axis=1), axis=-1)
    np.testing.assert_allclose(length, animal.length_m / SEGMENTS, rtol=1e-12)
    duty = [pair.duty for pair in animal.leg_pairs for _ in range(2)]
    np.testing.assert_allclose(made.on_ground.mean(axis=0), duty, atol=0.003)
    assert len(LEGS) == made.foot_m.shape[1]


def test_the_girdles_are_nodes_of_a_standing_wave() -> None:
    lizard = read_animal("lizard")
    even = lizard.model_copy(
        update={
            "leg_pairs": tuple(
                pair.model_copy(update={"turn_rad": 0.3}) for pair in lizard.leg_pairs
            )
        }
    )
    made = prototype(even, over(even))
    along = np.linspace(0.0, 1.0, SEGMENTS + 1)
    for pair in even.leg_pairs:
        beside = np.array([np.interp(pair.at, along, body) for body in made.spine_m[..., 1]])
        assert np.abs(beside).max() < 0.004 * even.length_m  # chords of 1/24 of the body
    trunk = made.spine_m[:, np.abs(along - 0.275).argmin(), 1]
    assert np.ptp(trunk) > 0.03 * even.length_m


def test_a_girdle_is_turned_furthest_when_its_foot_comes_down() -> None:
    lizard = read_animal("lizard")
    pair = lizard.leg_pairs[1]
    times = np.linspace(0.0, lizard.cycle_s, 401)
    hips = prototype(lizard, times).hip_m[:, 2:]
    across = hips[:, 0] - hips[:, 1]
    turned = np.arctan2(-across[:, 0], across[:, 1])
    assert np.ptp(turned) == pytest.approx(2.0 * pair.turn_rad, abs=1e-3)  # 36 degrees
    assert times[turned.argmin()] == pytest.approx(pair.left * lizard.cycle_s, abs=1e-3)


def test_the_body_rides_on_its_legs_as_on_pendulums() -> None:
    goat = read_animal("goat")
    full = goat.model_copy(update={"vault": 1.0})
    made = prototype(full, over(full, 1.0, 2000))
    height_m = full.height * full.length_m
    high = made.hip_m[:, 2:, 2].mean(axis=1) + full.leg_pairs[1].hip_drop * full.length_m
    assert high.max() <= height_m + 1e-12  # a pendulum is highest upright
    step_m = 0.5 * full.stride * full.length_m * full.leg_pairs[1].duty
    assert high.min() >= np.sqrt(height_m**2 - step_m**2) - 1e-12
    assert np.abs(np.diff(high)).max() < 0.002 * height_m  # no step where the feet change
    stiff = prototype(full.model_copy(update={"vault": 0.0}), over(full))
    assert np.ptp(stiff.spine_m[..., 2]) < 1e-12


@settings(deadline=None, max_examples=25)
@given(
    duty=st.floats(0.2, 0.9),
    left=st.floats(0.0, 0.99),
    stride=st.floats(0.1, 1.5),
    vault=st.floats(0.0, 1.0),
)
def test_any_figures_leave_feet_in_place(
    duty: float, left: float, stride: float, vault: float
) -> None:
    goat = read_animal("goat")
    pairs = tuple(
        pair.model_copy(update={"duty": duty, "left": left, "right": (left + 0.5) % 1.0})
        for pair in goat.leg_pairs
    )
    animal = goat.model_copy(update={"leg_pairs": pairs, "stride": stride, "vault": vault})
    made = prototype(animal, over(animal, 2.0))
    stays = made.on_ground[1:] & made.on_ground[:-1]
    way = np.linalg.norm(np.diff(made.foot_m, axis=0), axis=-1)
    assert way[stays].max(initial=0.0) < 1e-11
    assert np.isfinite(made.spine_m).all()


def test_the_feet_of_gc_as_printed_share_their_height_and_one_goes_forward() -> None:
    """[GC] Eq. 9-10 with the default fine parameters, against the printed formulas."""
    goat = read_animal("goat")
    pair = goat.leg_pairs[0]
    cycles = np.linspace(0.0, 2.0, 2001)
    ahead, rise, on = printed_feet(goat, pair, cycles)
    step_height = 0.5 * goat.length_m * pair.lift  # H, and H_RF: the lowest point is on the ground
    step_length = goat.stride * goat.length_m / (2.0 * np.pi)  # L
    omega_t = 2.0 * np.pi * (cycles - pair.right - 0.5 * pair.duty) - 0.5 * np.pi
    t_y, t_z = np.sin(omega_t), np.cos(omega_t)
    np.testing.assert_allclose(ahead[:, 1], -t_z * step_length, atol=1e-12)
    np.testing.assert_allclose(ahead[:, 0], t_z * step_length, atol=1e-12)
    np.testing.assert_allclose(rise[:, 1], t_y * step_height + step_height, atol=1e-12)
    np.testing.assert_array_equal(rise[:, 0], rise[:, 1])
    low = int(np.argmin(rise[:1000, 1]))
    speed = np.gradient(ahead, cycles, axis=0)[low] / (goat.stride * goat.length_m)
    np.testing.assert_allclose(speed, [1.0, -1.0], atol=1e-3)  # only the right foot stands still
    np.testing.assert_array_equal(on[:, 0], on[:, 1])  # both feet, or none, are on the ground


def test_printed_feet_slip_and_ours_do_not() -> None:
    goat = read_animal("goat")
    times = over(goat)
    slips = {}
    for feet in ("footfall", "gc-printed"):
        made = prototype(goat.model_copy(update={"feet": feet}), times)
        stays = made.on_ground[1:] & made.on_ground[:-1]
        slips[feet] = np.abs(np.diff(made.foot_m[..., 0], axis=0))[stays].sum()
    assert slips["footfall"] < 1e-9
    assert slips["gc-printed"] > goat.stride * goat.length_m
