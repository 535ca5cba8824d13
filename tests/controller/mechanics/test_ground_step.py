"""The ground step: exact lengths on any ground, closed forms on planes, one body or many."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import gaussian_filter

from snakewalk.config.heightfield import HeightField
from snakewalk.controller.mechanics import ground_step
from snakewalk.controller.mechanics.ground_step import GroundStep, Known, bridged

R = 0.012
S = (np.arange(100) + 0.5) / 100
WAVE = 0.7 * np.sin(2 * np.pi * 1.2 * S)
TAPERED = 0.03 - 0.02 * np.abs(np.linspace(-1, 1, 101)) ** 3


def rough(seed: int, height_m: float) -> HeightField:
    noise = gaussian_filter(np.random.default_rng(seed).normal(size=(60, 60)), 2.0)
    return HeightField(noise / noise.std() * height_m, 0.05, -1.5, -1.5)


def slope(angle_rad: float) -> HeightField:
    """Rises along x."""
    x = np.linspace(-5.0, 5.0, 11)
    return HeightField(np.tile(np.tan(angle_rad) * x, (11, 1)), 1.0, -5.0, -5.0)


@settings(max_examples=30)
@given(
    st.integers(0, 10_000),
    st.floats(0.0, 0.15),
    st.floats(-7, 7),
    st.sampled_from(["tail", "head"]),
)
def test_segment_lengths_are_exact_and_every_point_touches(
    seed: int, height_m: float, turn: float, known: str
) -> None:
    ground = rough(seed, height_m)  # up to 80 degrees
    placed = GroundStep(ground).place(WAVE + turn, (0.1, -0.2), R, TAPERED, known)
    lengths = np.linalg.norm(np.diff(placed.points_m, axis=0), axis=1)
    np.testing.assert_allclose(lengths, R, rtol=1e-12)
    lifted = ground.elevation_m(placed.points_m[:, 0], placed.points_m[:, 1]) + TAPERED
    np.testing.assert_allclose(placed.points_m[:, 2], lifted, atol=1e-9 * R)
    np.testing.assert_allclose(placed.gap_m, 0.0, atol=1e-9 * R)


def test_segments_keep_their_heading_and_say_their_pitch() -> None:
    placed = GroundStep(rough(3, 0.04)).place(WAVE, (0.0, 0.0), R, TAPERED)
    step = placed.points_m[:-1] - placed.points_m[1:]
    np.testing.assert_allclose(np.arctan2(step[:, 1], step[:, 0]), WAVE, atol=1e-9)
    np.testing.assert_allclose(np.arcsin(step[:, 2] / R), placed.pitch_rad, atol=1e-9)
    assert placed.steepest_rad == np.abs(placed.pitch_rad).max() > 0.1


@given(st.floats(-1.2, 1.2), st.floats(-4, 4))
def test_on_an_incline_the_pitch_is_the_slope_in_the_direction_of_travel(
    incline: float, heading: float
) -> None:
    placed = GroundStep(slope(incline)).place(np.full(20, heading), (0.0, 0.0), 0.05, 0.03)
    expected = np.arctan(np.tan(incline) * np.cos(heading))
    np.testing.assert_allclose(placed.pitch_rad, expected, atol=1e-8)


def test_on_a_level_floor_a_tapered_body_tilts_by_its_taper_alone() -> None:
    half = np.linspace(0.03, 0.01, 101)  # thick at the head
    placed = GroundStep(None).place(WAVE, (0.0, 0.0), R, half)
    np.testing.assert_allclose(placed.points_m[:, 2], half, atol=1e-12)
    np.testing.assert_allclose(placed.pitch_rad, np.arcsin(0.0002 / R), rtol=1e-9)


def test_tail_first_and_head_first_give_the_same_body() -> None:
    ground = GroundStep(rough(5, 0.02))
    tail_first = ground.place(WAVE, (-0.3, 0.1), R, TAPERED)
    head_first = ground.place(WAVE, tail_first.points_m[0, :2], R, TAPERED, "head")
    np.testing.assert_allclose(head_first.points_m, tail_first.points_m, atol=1e-9)


def test_heights_alone_keep_the_plane_and_stretch_the_segments() -> None:
    arc = GroundStep(None).place(WAVE, (0.0, 0.0), R, 0.0)
    placed = GroundStep(slope(0.4)).lift(arc.points_m[:, :2], TAPERED)
    np.testing.assert_array_equal(placed.points_m[:, :2], arc.points_m[:, :2])
    over = placed.points_m[:, 2] - slope(0.4).elevation_m(*arc.points_m[:, :2].T)
    np.testing.assert_allclose(over, TAPERED, atol=1e-12)
    straight = np.stack([np.linspace(0.5, -0.5, 21), np.zeros(21)], axis=-1)
    up = GroundStep(slope(0.4)).lift(straight, 0.03)
    np.testing.assert_allclose(up.pitch_rad, 0.4, atol=1e-9)
    stretched = np.linalg.norm(np.diff(up.points_m, axis=0), axis=1)
    np.testing.assert_allclose(stretched, 0.05 / np.cos(0.4), rtol=1e-9)


def test_all_frames_at_once_are_the_frames_one_by_one() -> None:
    ground = GroundStep(rough(7, 0.05))
    angles = WAVE + np.linspace(0, 6, 12)[:, None]
    known = np.random.default_rng(1).uniform(-0.4, 0.4, (12, 2))
    batch = ground.place(angles, known, R, TAPERED)
    for k in range(12):
        one = ground.place(angles[k], known[k], R, TAPERED)
        np.testing.assert_allclose(batch.points_m[k], one.points_m, atol=1e-12)
        np.testing.assert_allclose(batch.pitch_rad[k], one.pitch_rad, atol=1e-9)


def test_a_cliff_is_climbed_and_a_body_hangs_over_the_next() -> None:
    z = np.zeros((4, 41))
    z[:, 20:28] = 0.5  # a block with faces of 0.1 m, steeper than 78 degrees
    ground = HeightField(z, 0.1, -2.0, -0.2)
    placed = GroundStep(ground).place(np.zeros(30), (-0.6, 0.0), 0.08, 0.0)
    np.testing.assert_allclose(np.linalg.norm(np.diff(placed.points_m, axis=0), axis=1), 0.08)
    np.testing.assert_allclose(placed.gap_m, 0.0, atol=1e-9)
    assert placed.points_m[:, 2].max() == pytest.approx(0.5)
    assert placed.points_m[0, 2] == pytest.approx(0.0, abs=1e-9)


def test_a_taper_steeper_than_the_half_circle_stands_upright_and_says_so() -> None:
    half = np.zeros(4)
    half[1] = 0.5
    for placed in (
        GroundStep(None).place(np.zeros(3), (0.0, 0.0), 0.1, half),
        GroundStep(None).place(np.zeros((2, 3)), (0.0, 0.0), 0.1, half),
    ):
        # the third point reaches 0.1 of 0.5; the head then comes down to the floor, in reach
        gap = np.atleast_2d(placed.gap_m)[0]
        np.testing.assert_allclose(gap, [0.0, -0.4, 0.0, 0.0], atol=1e-12)
        assert np.atleast_2d(placed.pitch_rad)[0, 1] == pytest.approx(np.pi / 2)


def test_beyond_the_border_the_edge_goes_on_level() -> None:
    placed = GroundStep(slope(0.3)).place(np.zeros(50), (4.0, 0.0), 0.1, 0.0)
    assert placed.points_m[0, 0] > 5.5
    np.testing.assert_allclose(placed.pitch_rad[:20], 0.0, atol=1e-8)


@pytest.mark.parametrize("plane", [ground_step.plane, ground_step.plane.py_func])
def test_the_look_up_of_one_point_is_that_of_the_field(plane: Callable[..., Any]) -> None:
    field = rough(9, 0.1)
    x, y = np.random.default_rng(2).uniform(-1.6, 1.6, (2, 200))
    expected = np.stack(field.plane(x, y), axis=1)
    where = field.z_m, field.x0_m, field.y0_m, field.spacing_m
    got = [plane(*where, a, b) for a, b in zip(x.tolist(), y.tolist(), strict=True)]
    np.testing.assert_allclose(got, expected, atol=1e-12)


@pytest.mark.parametrize("known", ["tail", "head"])
def test_the_loop_gives_the_same_compiled_and_interpreted(
    known: Known, monkeypatch: pytest.MonkeyPatch
) -> None:
    ground = GroundStep(rough(7, 0.05))
    fast = ground.place(WAVE, (0.1, 0.2), R, TAPERED, known)
    monkeypatch.setattr(ground_step, "_place", ground_step._place.py_func)
    slow = ground.place(WAVE, (0.1, 0.2), R, TAPERED, known)
    np.testing.assert_allclose(fast.points_m, slow.points_m, atol=1e-14)
    np.testing.assert_allclose(fast.pitch_rad, slow.pitch_rad, atol=1e-12)
    np.testing.assert_allclose(fast.gap_m, slow.gap_m, atol=1e-12)


def test_printed_lifting_after_the_crossing_changes_segment_lengths() -> None:
    half = np.linspace(0.03, 0.0, 11)  # a strong taper: 3 mm a segment of 12
    bare = GroundStep(slope(0.35)).place(np.zeros(10), (0.0, 0.0), R, 0.0).points_m
    printed = bare + np.column_stack([np.zeros((11, 2)), half])
    ours = GroundStep(slope(0.35)).place(np.zeros(10), (0.0, 0.0), R, half).points_m
    drift = np.linalg.norm(np.diff(printed, axis=0), axis=1) / R - 1.0
    assert np.abs(drift).min() > 0.09
    np.testing.assert_allclose(np.linalg.norm(np.diff(ours, axis=0), axis=1), R, rtol=1e-12)


def trench(width_m: float) -> HeightField:
    """Half a metre deep, across x = 0."""
    x = np.arange(-100, 101) * 0.005
    return HeightField(
        np.tile(np.where(np.abs(x) < width_m / 2, -0.5, 0.0), (201, 1)), 0.005, -0.5, -0.5
    )


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("radius_m", [0.07, 0.2])
def test_a_bridged_trench_is_as_deep_as_the_ball_sinks_in(radius_m: float) -> None:
    found = bridged(trench(0.08), radius_m)
    edge_m = 0.04  # the last samples on the level, to which the ball comes down
    sinks_m = radius_m - np.sqrt(radius_m**2 - edge_m**2)
    assert -found.elevation_m(0.0, 0.0) == pytest.approx(sinks_m, abs=0.001)
    np.testing.assert_allclose(found.elevation_m(np.array([-0.3, 0.3]), np.zeros(2)), 0.0)


@settings(max_examples=20)
@given(st.integers(0, 10_000), st.floats(0.05, 0.3))
def test_bridging_never_digs_and_bridges_nothing_twice(seed: int, radius_m: float) -> None:
    ground = rough(seed, 0.05)
    once = bridged(ground, radius_m)
    assert (once.z_m >= ground.z_m - 1e-12).all()
    np.testing.assert_allclose(bridged(once, radius_m).z_m, once.z_m, atol=1e-12)


@pytest.mark.slow
def test_bridging_leaves_slopes_and_crests_as_they_are() -> None:
    plane = slope(0.3)
    inner = slice(1, -1)  # beyond its border a field goes on level
    np.testing.assert_allclose(bridged(plane, 2.0).z_m[inner, inner], plane.z_m[inner, inner])
    roof = HeightField(
        -np.abs(trench(0.0).z_m * 0.0 + np.linspace(-0.3, 0.3, 201)), 0.005, 0.0, 0.0
    )
    inner = slice(41, -41)
    np.testing.assert_allclose(
        bridged(roof, 0.2).z_m[inner, inner], roof.z_m[inner, inner], atol=1e-9
    )
