"""Equal chords: closed forms, several solutions, curves that no first crossing divides."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from snakewalk.controller.images.chord_beam import follow_places
from snakewalk.controller.images.chord_path import follow_chords, solve
from snakewalk.controller.images.equipartition import (
    NoEquipartitionError,
    equipartition,
    march,
)

Floats = NDArray[np.float64]
STRAIGHT = np.linspace([0.0, 0.0], [3.0, 4.0], 50)
HALF_TURN = np.linspace(0.0, np.pi, 20_001)
HALF_CIRCLE = np.column_stack([np.cos(HALF_TURN), np.sin(HALF_TURN)])
V = np.array([[-1.0, 1.0], [0.0, 0.0], [1.0, 1.0]])


def chords(points: Floats) -> Floats:
    return np.asarray(np.hypot(*np.diff(points, axis=0).T))


def on_curve(curve: Floats, points: Floats) -> float:
    """Greatest distance of a point from the curve."""
    far = np.zeros(len(points))
    for k, point in enumerate(points):
        a, d = curve[:-1], np.diff(curve, axis=0)
        t = np.clip(((point - a) * d).sum(1) / np.maximum((d * d).sum(1), 1e-300), 0.0, 1.0)
        far[k] = np.hypot(*(a + t[:, None] * d - point).T).min()
    return float(far.max())


@pytest.mark.parametrize("n", [1, 2, 3, 7, 10, 99, 100, 1000])
def test_a_straight_curve_is_divided_evenly(n: int) -> None:
    found = equipartition(STRAIGHT, n)
    assert np.allclose(found.points, np.linspace([0.0, 0.0], [3.0, 4.0], n + 1), atol=1e-8)
    assert found.solutions == 1


@pytest.mark.parametrize("n", [1, 2, 3, 10, 100, 1000])
def test_a_half_circle_has_the_chords_of_a_regular_polygon(n: int) -> None:
    found = equipartition(HALF_CIRCLE, n)
    assert found.chord == pytest.approx(2.0 * np.sin(np.pi / (2 * n)), abs=2e-7)


@pytest.mark.parametrize("n", [2, 4, 6, 100])
def test_an_even_number_puts_a_point_into_the_corner_of_a_v(n: int) -> None:
    found = equipartition(V, n)
    assert np.allclose(found.points[n // 2], [0.0, 0.0], atol=1e-8)
    assert found.chord == pytest.approx(2.0 * np.sqrt(2.0) / n)


@pytest.mark.parametrize("n", [3, 5, 7, 21])
def test_an_odd_number_cuts_the_corner_of_a_v(n: int) -> None:
    # (n - 1) / 2 chords on each arm, and one across the corner: s = sqrt(2) a, a left on each arm
    chord = np.sqrt(2.0) / ((n - 1) / 2 + np.sqrt(0.5))
    assert equipartition(V, n).chord == pytest.approx(chord)


@settings(max_examples=60)
@given(
    st.integers(0, 2**32 - 1),
    st.sampled_from([2, 3, 5, 8, 20, 100, 257]),
    st.floats(0.02, 0.25),
    st.floats(-1000.0, 1000.0),
)
def test_chords_are_equal_and_on_the_curve_in_order(
    seed: int, n: int, bend: float, shift: float
) -> None:
    turns = np.cumsum(np.random.default_rng(seed).normal(size=80) * bend)
    curve = np.cumsum(np.column_stack([np.cos(turns), np.sin(turns)]), axis=0) + shift
    try:
        found = equipartition(curve, n)
    except NoEquipartitionError:
        assert n <= 20, "only few chords on strong bends may have none"
        assert bend > 0.1
        return
    size = chords(found.points)
    assert np.ptp(size) < 1e-6 * max(found.chord, 0.1)
    assert np.all(np.diff(found.at) > 0.0)
    assert np.array_equal(found.points[[0, -1]], curve[[0, -1]])
    assert on_curve(curve, found.points) < 1e-6


@settings(max_examples=40)
@given(st.integers(1, 1000))
def test_every_number_of_chords_divides_a_bent_body(n: int) -> None:
    s = np.linspace(0.0, 1.0, 400)
    angle = 1.1 * np.sin(2.0 * np.pi * 1.4 * s)
    curve = np.cumsum(np.column_stack([np.cos(angle), np.sin(angle)]), axis=0)
    found = equipartition(curve, n)
    assert len(found.points) == n + 1
    assert np.ptp(chords(found.points)) < 1e-6


def test_several_solutions_are_told_and_the_closest_to_the_curve_is_taken() -> None:
    s = np.linspace(0.0, 1.0, 2001)
    deep = np.column_stack([s - 0.3 * np.sin(4.0 * np.pi * s), 0.4 * np.sin(2.0 * np.pi * s)])
    many = equipartition(deep, 2)
    assert many.solutions == 3
    middles = np.flatnonzero(np.diff(np.sign(deep[:, 0] - 0.5)))
    assert len(middles) == 3
    other = [mean_distance(deep, np.vstack([deep[0], deep[k], deep[-1]]), k) for k in middles]
    assert many.distance <= min(other) + 1e-3


def mean_distance(curve: Floats, points: Floats, corner: int) -> float:
    parts = []
    for (a, b), piece in zip(pairwise(points), (curve[: corner + 1], curve[corner:]), strict=True):
        d = b - a
        t = np.clip((piece - a) @ d / (d @ d), 0.0, 1.0)
        parts.append(np.hypot(*(piece - a - t[:, None] * d).T))
    arc = np.concatenate([[0.0], np.cumsum(chords(curve))])
    apart = np.concatenate([parts[0], parts[1][1:]])
    return float(np.trapezoid(apart, arc)) / float(arc[-1])


def first_crossings_only(curve: Floats, n: int) -> Floats:
    """Residual of the last point over all chords, by first crossings."""
    arc = np.concatenate([[0.0], np.cumsum(chords(curve))])
    far = curve[-1] + (curve[-1] - curve[-2]) / chords(curve[-2:])[0] * 3.0 * arc[-1]
    line, line_arc = np.vstack([curve, far]), np.append(arc, 4.0 * arc[-1])
    points, at = np.empty((n + 1, 2)), np.empty(n + 1)
    found = []
    for chord in np.linspace(1e-3 * arc[-1] / n, arc[-1] / n, 20_000):
        march(line, line_arc, float(chord), np.zeros(n, dtype=np.int64), points, at)
        found.append(at[-1] - arc[-1])
    return np.asarray(found)


def bent(seed: int, turn_rad: float = 0.6) -> Floats:
    turns = np.cumsum(np.random.default_rng(seed).normal(size=60) * turn_rad)
    return np.cumsum(np.column_stack([np.cos(turns), np.sin(turns)]), axis=0)


def test_the_distance_is_to_the_chord_and_not_to_its_line() -> None:
    """A hair that goes out along the chord's line and back is far from the chord."""
    out = [[0.0, 0.0], [-1.0, 0.0], [0.0, 0.0], [1.0, 0.0]]
    hair = np.concatenate([np.linspace(a, b, 200, endpoint=False) for a, b in pairwise(out)])
    found = equipartition(np.vstack([hair, [[1.0, 0.0]]]), 1)
    assert found.distance == pytest.approx(1.0 / 3.0, abs=0.01)  # to the line it would be 0


def smooth(seed: int) -> Floats:
    """A bent body of four waves of tangent angle."""
    rng, s = np.random.default_rng(seed), np.linspace(0.0, 1.0, 200)
    waves = [
        rng.normal(0.0, 2.2 / k**0.7) * np.sin(2.0 * np.pi * k * s + rng.uniform(0.0, 2.0 * np.pi))
        for k in range(1, 5)
    ]
    angle = np.sum(waves, axis=0)
    step = np.column_stack([np.cos(angle), np.sin(angle)]) / 200.0
    return np.vstack([[0.0, 0.0], np.cumsum(step, axis=0)])


@pytest.mark.fast_cases(5)
@pytest.mark.parametrize("seed", [4, 10, 35, 37, 39, 47, 49, 50, 60, 79])
def test_three_chords_are_found_on_every_smooth_body(seed: int) -> None:
    """By counted crossings none of these was divided: 18 of the first 150 seeds were refused."""
    found = equipartition(smooth(seed), 3)
    assert np.ptp(chords(found.points)) < 1e-9
    assert (np.diff(found.at) > 0.0).all()
    assert on_curve(smooth(seed), found.points) < 1e-9


@pytest.mark.parametrize(("seed", "n"), [(1, 4), (31, 4), (63, 5)])
def test_the_path_of_the_proof_ends_at_an_equipartition(seed: int, n: int) -> None:
    """Counted crossings lead to none of these: 15 of 61 smooth bodies were rejected at 4 chords."""
    curve = smooth(seed)
    arc = np.concatenate([[0.0], np.cumsum(chords(curve))])
    places = follow_chords(curve, arc, n, 40_000)
    assert places is not None
    points = np.column_stack([np.interp(places, arc, column) for column in curve.T])
    assert np.ptp(chords(points)) < 1e-9
    assert (np.diff(places) > 0.0).all()


@pytest.mark.slow_cases(1, "4 cases of 0.5 s of CPU")
@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("n", [4, 5, 6, 7, 8])
def test_few_chords_divide_every_smooth_body(n: int) -> None:
    for seed in range(2000, 2012):
        curve = smooth(seed)
        found = equipartition(curve, n)
        assert np.ptp(chords(found.points)) < 1e-8
        assert (np.diff(found.at) > 0.0).all()
        assert on_curve(curve, found.points) < 1e-9


@pytest.mark.parametrize("seed", [1, 18, 31, 1001, 1006, 1011])
def test_a_hundred_chords_divide_a_zigzag(seed: int) -> None:
    """Turns of 1 rad (standard deviation): no count of one later crossing divides 14 of 20."""
    curve = bent(seed, 1.0)
    found = equipartition(curve, 100)
    assert np.ptp(chords(found.points)) < 1e-7
    assert (np.diff(found.at) > 0.0).all()
    assert np.array_equal(found.points[[0, -1]], curve[[0, -1]])
    assert on_curve(curve, found.points) < 1e-9


@pytest.mark.slow
def test_a_hundred_chords_divide_a_zigzag_with_too_many_branches_to_visit() -> None:
    """Turns of 1.5 rad: no branch was found for 13 of 60 before."""
    for seed in (3002, 3019):
        random = np.random.default_rng(seed)
        angle = np.cumsum(random.normal(size=60) * 1.5)
        curve = np.cumsum(np.column_stack([np.cos(angle), np.sin(angle)]), axis=0)
        found = equipartition(curve, 100)
        assert np.ptp(chords(found.points)) < 1e-7
        assert (np.diff(found.at) > 0.0).all()
        assert on_curve(curve, found.points) < 1e-9


def test_places_that_are_followed_are_those_of_the_march() -> None:
    curve = bent(5, 1.5)
    far = 3.0 * (curve[-1] - curve[-2])
    step = np.hypot(*np.diff(curve, axis=0).T)
    line = np.ascontiguousarray(np.vstack([curve, curve[-1] + 50.0 * far]))
    length = float(step.sum())
    arc = np.concatenate([[0.0], np.cumsum(step), [length + 50.0 * np.hypot(*far)]])
    steps, excess = np.zeros((20, 40), dtype=np.int8), np.empty(20)
    points, at = np.empty((41, 2)), np.empty(41)
    total = 0
    for chord in np.linspace(0.31, 1.13, 10):
        found = follow_places(line, arc, chord, np.array([12.0 * chord, length]), steps, excess)
        for k in range(found):
            done = march(line, arc, chord, steps[k].astype(np.int64), points, at)
            assert done == 40
            assert at[-1] - length == pytest.approx(excess[k], abs=1e-9)
        total += found
    assert total > 100
    assert (np.abs(excess[:found]) == np.sort(np.abs(excess[:found]))).all()


@pytest.mark.parametrize("count", [2, 5, 100])
def test_a_step_of_the_path_solves_its_equations(count: int) -> None:
    random = np.random.default_rng(count)
    gap, slopes = random.normal(size=count), random.normal(size=(count, 2))
    slopes[count // 2, 1] = 0.0  # a circle that touches the curve
    step, along = np.empty(count + 1), np.empty(count + 1)
    for function in (solve, getattr(solve, "py_func", solve)):
        function(gap, slopes, step, along)
        rows = np.zeros((count, count + 1))
        rows[np.arange(count), np.arange(count)] = slopes[:, 1]
        rows[np.arange(1, count), np.arange(count - 1)] = slopes[1:, 0]
        rows[:, count] = -1.0
        np.testing.assert_allclose(rows @ step, -gap, atol=1e-9)
        np.testing.assert_allclose(rows @ along, 0.0, atol=1e-12)
        assert np.linalg.norm(along) == pytest.approx(1.0)


def test_too_few_steps_of_the_path_are_reported() -> None:
    curve = smooth(1)
    arc = np.concatenate([[0.0], np.cumsum(chords(curve))])
    assert follow_chords(curve, arc, 4, 10) is None


@pytest.mark.parametrize("seed", range(12))
def test_three_chords_are_found_on_acute_corners(seed: int) -> None:
    corners = np.cumsum(np.random.default_rng(seed).normal(0.0, 1.0, (6, 2)), axis=0)
    found = equipartition(corners, 3)
    assert np.ptp(chords(found.points)) < 1e-8 * found.at[-1]
    assert on_curve(corners, found.points) < 1e-8


def test_where_no_first_crossing_ends_at_b_a_later_one_does() -> None:
    shown = 0
    for seed in range(40):
        curve = bent(seed)
        try:
            found = equipartition(curve, 4)
        except NoEquipartitionError:
            continue
        residual = first_crossings_only(curve, 4) if found.method == "later crossing" else None
        if residual is None or np.abs(residual).min() < 0.05:
            continue
        shown += 1
        # the printed algorithm's residual jumps over zero: it can only cycle
        assert residual.min() < 0.0 < residual.max()
        assert np.ptp(chords(found.points)) < 1e-6
        assert on_curve(curve, found.points) < 1e-6
        if shown == 2:
            break
    assert shown == 2


def test_a_closed_curve_is_divided_but_not_by_one_chord() -> None:
    t = np.linspace(0.0, 2.0 * np.pi, 5001)
    ring = np.column_stack([np.cos(t), np.sin(t)])
    ring[-1] = ring[0]
    found = equipartition(ring, 6)
    assert found.chord == pytest.approx(1.0, abs=1e-5)
    with pytest.raises(NoEquipartitionError):
        equipartition(ring, 1)


@pytest.mark.parametrize(
    ("curve", "n"),
    [
        (np.zeros((5, 2)), 3),
        (np.zeros((1, 2)), 3),
        (np.zeros((5, 3)), 3),
        (np.array([[0.0, 0.0], [np.nan, 1.0]]), 3),
        (STRAIGHT, 0),
    ],
)
def test_what_is_no_curve_is_refused(curve: Floats, n: int) -> None:
    with pytest.raises(ValueError, match=r"curve|segment"):
        equipartition(curve, n)


def test_repeated_points_change_nothing() -> None:
    twice = np.repeat(HALF_CIRCLE[::50], 2, axis=0)
    assert np.allclose(
        equipartition(twice, 30).points, equipartition(HALF_CIRCLE[::50], 30).points, atol=1e-9
    )
