"""Angles and points over time: what follows the head, what slides, how the printed text fails."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from snakewalk.config.run import WalkConfig
from snakewalk.controller.animals.synthesis.synthesis import (
    NECK,
    Behaviour,
    Locomotion,
    Sampling,
    Start,
    Targets,
    synthesise,
    varied_pulse,
)
from snakewalk.controller.mechanics.ground_step import GroundStep
from snakewalk.controller.mechanics.speed_law import SpeedLaw
from snakewalk.controller.shape.states import (
    limit_to_waves,
    random_states,
    to_angles,
    to_states,
)
from snakewalk.controller.terrain.path import SplinePath
from snakewalk.controller.track.readers.generated import embedded
from snakewalk.controller.walk.angle_track import AngleTrack
from snakewalk.controller.walk.walker import Walker

N = 100
R = 0.012
DT = 0.04
LAW = SpeedLaw.printed(unit_m=0.1)


def wave(sample: np.ndarray, amplitude: float = 0.6) -> np.ndarray:
    return amplitude * np.sin(2 * np.pi * 1.3 * sample / N)


def fresh() -> AngleTrack:
    return AngleTrack(wave(np.arange(N))[::-1])


def grow(track: AngleTrack, _: object = None) -> None:
    track.append(wave(track.end + np.arange(50)))


def go(frames: int = 250, law: SpeedLaw = LAW, **how: object) -> Locomotion:
    return synthesise(fresh(), law, frames, Sampling(DT, R), grow, Behaviour(**how))  # type: ignore[arg-type]


def one_segment_a_frame(frames: int, sliding: float = 0.0) -> Locomotion:
    """The body advances r in each frame, whatever its bends."""
    keep = SpeedLaw(1e-12, 0.0, 0.0, 0.0)
    return synthesise(
        fresh(),
        keep,
        frames,
        Sampling(DT, R),
        grow,
        Behaviour(sliding=sliding),
        Start(speed_m_s=R / DT),
    )


def test_every_point_passes_where_the_head_passed() -> None:
    run = one_segment_a_frame(200)
    for back in (1, 37, 100):
        np.testing.assert_allclose(run.points_m[back:, back], run.points_m[:-back, 0], atol=1e-9)
    np.testing.assert_allclose(run.angles_rad[60:, 60], run.angles_rad[:-60, 0], atol=1e-9)


def test_at_any_speed_every_point_stays_on_the_head_s_way() -> None:
    run = go()
    # the head's way, and what the body lay on at the start
    way = np.concatenate([run.points_m[0, :0:-1], run.points_m[:, 0]])
    fine = np.concatenate([np.linspace(a, b, 8) for a, b in pairwise(way)])
    for frame in (60, 150, 249):
        off = np.linalg.norm(run.points_m[frame][:, None] - fine, axis=2).min(axis=1)
        assert off.max() < 0.25 * R


@settings(max_examples=20)
@given(st.floats(0, 1), st.floats(0, 0.3), st.integers(0, 99))
def test_segments_keep_their_length_and_steps_are_the_speed(
    sliding: float, pulse: float, seed: int
) -> None:
    g = varied_pulse(N, 40, 4, 0.05, 0.01, np.random.default_rng(seed)) + pulse
    run = go(40, sliding=sliding, pulse_m_s=lambda frame: g[frame])
    step = np.linalg.norm(np.diff(run.points_m, axis=1), axis=2)
    np.testing.assert_allclose(step, R, rtol=1e-9)
    head = np.diff(run.points_m[:, 0], axis=0)
    along = np.stack([np.cos(run.angles_rad[1:, 0]), np.sin(run.angles_rad[1:, 0])], axis=1)
    np.testing.assert_allclose(head, along * run.speed_m_s[1:, None] * DT, atol=1e-12)


def test_the_pulse_is_the_shift_less_the_share_that_slides() -> None:
    for share in (0.0, 0.3, 1.0):
        run = go(60, sliding=share)
        travelled = run.speed_m_s[1:].sum() * DT / R
        moved = run.place[-1] - run.place[0]
        np.testing.assert_allclose(moved, (1 - share) * travelled, atol=1e-9)
    frozen = np.broadcast_to(run.angles_rad[0], run.angles_rad.shape)
    np.testing.assert_allclose(run.angles_rad, frozen, atol=1e-9)  # 1: frozen, and it glides
    assert run.points_m[-1, 0, 0] > 0.1


def test_pulse_speed_may_differ_along_the_body_without_tearing_it() -> None:
    g = varied_pulse(N, 200, 5, 0.05, 0.004, np.random.default_rng(0))
    run = go(200, pulse_m_s=lambda frame: g[frame])
    plain = go(200)
    assert np.abs(run.angles_rad - plain.angles_rad).max() > 0.3
    # neighbours show neighbouring places, in order: no part of the pattern is passed by another
    assert (np.diff(run.place, axis=1) < 0).all()


def test_varied_pulse_keeps_its_limits() -> None:
    g = varied_pulse(N, 300, 5, 0.1, 0.01, np.random.default_rng(1))
    assert g.shape == (300, N)
    assert np.abs(np.diff(g, axis=0)).max() < 0.01
    assert np.abs(np.diff(g, axis=1)).max() < 0.01
    assert (np.count_nonzero(np.diff(g, axis=1), axis=1) <= 4).all()
    assert 0.02 < np.abs(g).max() <= 0.1


def test_the_steady_speed_is_that_of_the_shape() -> None:
    run = go(250, sliding=1.0)  # the shape stays, so K does
    assert run.speed_m_s[-1] == pytest.approx(
        float(LAW.steady_m_s(run.angles_rad[0].std())), rel=1e-3
    )


def test_a_track_that_runs_out_grows_or_is_an_error() -> None:
    track = fresh()
    synthesise(track, LAW, 100, Sampling(DT, R), grow)
    assert track.end > N + 40
    with pytest.raises(ValueError, match="the track ends at sample 99"):
        synthesise(fresh(), LAW, 100, Sampling(DT, R))


def test_clamping_instead_of_growing_straightens_the_body() -> None:
    ours, clamped = go(250), fresh()
    bodies = np.interp(ours.place[-1], np.arange(clamped.end), clamped.at_rad(np.arange(N)))
    assert bodies.std() < 0.5 * ours.angles_rad[-1].std()


def test_a_walk_of_states_feeds_it_and_the_ground_carries_it() -> None:
    shapes = embedded("worm-like").angles_rad
    walker = Walker(shapes - shapes.mean(axis=1, keepdims=True), WalkConfig())
    run = synthesise(walker.track, LAW, 80, Sampling(DT, R), lambda *_: walker.decide(0.0, 0.0))
    placed = GroundStep(None).place(run.angles_rad, run.points_m[:, -1], R, 0.03)
    np.testing.assert_allclose(placed.points_m[..., :2], run.points_m, atol=1e-9)


@pytest.mark.parametrize(("first", "last", "waves"), [(1, 2, 1.2), (3, 4, 2.7), (5, 7, 4.5)])
def test_states_of_one_kind_of_waves_keep_their_bends(first: int, last: int, waves: float) -> None:
    """[PT] Fig. 13: the states of a recording with long waves, made medium and short."""
    drawn = random_states(
        to_states(embedded("worm-like").angles_rad), 200, np.random.default_rng(0)
    )
    made = limit_to_waves(drawn, first, last, 0.9)
    energy = np.abs(made) ** 2
    np.testing.assert_array_less(
        0.9 - 1e-9, energy[:, first - 1 : last].sum(axis=1) / energy.sum(axis=1)
    )
    np.testing.assert_allclose(energy.sum(axis=1), (np.abs(drawn) ** 2).sum(axis=1))
    angles = to_angles(made)
    signs = np.sign(angles[:, 1:]) != np.sign(angles[:, :-1])
    assert np.median(signs.sum(axis=1)) / 2 == pytest.approx(waves, abs=0.6)
    same = limit_to_waves(made, first, last, 0.8)
    np.testing.assert_allclose(same, made)  # where the threshold is kept nothing changes


def test_sliding_out_of_range_is_an_error() -> None:
    with pytest.raises(ValueError, match=r"sliding 1\.5"):
        Behaviour(sliding=1.5)
    with pytest.raises(ValueError, match="coefficients 5-7 of 4"):
        limit_to_waves(np.ones((1, 4), dtype=complex), 5, 7, 0.9)


def test_a_held_head_swings_less_and_the_neck_leads() -> None:
    free, held = go(200), go(200, head_held=1.0)
    swing = [np.std(run.angles_rad[:, 0] - run.angles_rad.mean(axis=1)) for run in (free, held)]
    assert swing[1] < 0.05 < 0.3 < swing[0]
    # the first point that nothing holds moves along its tangent, so all behind it follow its way
    leader = int(np.ceil(NECK * (N - 1)))
    step = np.diff(held.points_m[:, leader], axis=0)
    along = held.angles_rad[1:, leader]
    np.testing.assert_allclose(
        step, (held.speed_m_s[1:] * DT)[:, None] * np.column_stack([np.cos(along), np.sin(along)]),
        atol=1e-12,
    )  # fmt: skip
    way = np.concatenate([held.points_m[0, : leader - 1 : -1], held.points_m[:, leader]])
    fine = np.concatenate([np.linspace(a, b, 8) for a, b in pairwise(way)])
    off = np.linalg.norm(held.points_m[150, leader:][:, None] - fine, axis=2).min(axis=1)
    assert off.max() < 0.25 * R


def test_a_calm_tail_is_straighter_and_the_front_is_as_it_was() -> None:
    calm = go(120, calm_tail=lambda frame: min(frame / 50, 1.0)).angles_rad
    off = np.abs(calm - calm.mean(axis=1, keepdims=True))
    assert off[60:, -1].max() < 0.15
    assert off[60:, :60].max() > 0.5


# -- targets ---------------------------------------------------------------------------------------


def body_at(x: float, y: float, heading: float = 0.0) -> np.ndarray:
    """A straight body of 1.2 m whose mass centre is at x, y."""
    back = np.linspace(0.6, -0.6, N + 1)[:, None]
    return np.array([x, y]) + back * [np.cos(heading), np.sin(heading)]


def test_targets_are_reached_in_order_and_the_last_ends_it() -> None:
    path = SplinePath([(0, 0), (2, 0), (4, 0)])
    targets = Targets(path, np.array([[2.0, 0.0], [4.0, 0.0]]), 0.3, 0.5)
    np.testing.assert_allclose(targets.points_m[:, 0], np.arange(0.5, 4.1, 0.5), atol=0.02)
    assert targets.required.tolist() == [False, False, False, True] * 2
    assert not targets.observe(body_at(0.0, 0.0))
    assert targets.distance_m == [pytest.approx(0.5, abs=0.02)]
    assert not targets.observe(
        body_at(0.95, 0.35)
    )  # the first lies behind, within twice the radius
    assert targets.index == 1
    assert not targets.observe(body_at(1.45, 0.1))
    assert not targets.observe(body_at(2.6, 0.45))  # a waypoint must be reached
    assert targets.index == 3
    for x in (2.0, 2.5, 3.0, 3.5):
        assert not targets.observe(body_at(x, 0.0))
    assert targets.index == 7
    # printed is `until n < N`: with the last target still to reach, it would already have stopped
    assert targets.observe(body_at(3.9, 0.0))


def test_a_waypoint_passed_by_is_planned_to_again() -> None:
    path = SplinePath([(0, 0), (2, 0)])
    again: list[np.ndarray] = []

    def replan(points: np.ndarray, heading: float) -> SplinePath:
        again.append(points)
        assert heading == 0.5
        return SplinePath(points)

    targets = Targets(path, np.array([[2.0, 0.0]]), 0.3, 0.5, 0.6, replan)
    assert targets.aim_rad(body_at(-0.6, 0.0), 0.5) == pytest.approx(0.0, abs=1e-6)
    for x in (0.0, 1.0, 2.0):  # its head goes on straight, up to a body length beyond the end
        assert abs(targets.aim_rad(body_at(x, 0.6), 0.5)) < np.pi / 2
    assert not again
    targets.aim_rad(body_at(2.7, 0.6), 0.5)
    assert targets.missed == 1
    np.testing.assert_allclose(again[0], [[3.3, 0.6], [2.0, 0.0]])
    assert targets.required[-1]
    assert abs(targets.aim_rad(body_at(2.7, 0.6), 0.5)) > np.pi / 2  # back


def test_where_all_is_reached_no_path_is_planned_again() -> None:
    def replan(points: np.ndarray, heading: float) -> SplinePath:
        return SplinePath(points)  # of the head alone there is none

    targets = Targets(SplinePath([(0, 0), (2, 0)]), np.array([[2.0, 0.0]]), 0.3, 0.5, 0.6, replan)
    for x in (0.5, 1.0, 1.5, 2.0):
        targets.observe(body_at(x, 0.0))
    assert targets.index == targets.count
    for x in (1.0, 2.0, 3.0):
        assert targets.aim_rad(body_at(x, 0.0), 0.0) == pytest.approx(0.0, abs=1e-6)  # straight on
    assert targets.missed == 0


# -- the printed text ------------------------------------------------------------------------------


def printed_step(angles: np.ndarray, shift: float, weight: float, central: bool) -> np.ndarray:
    """Eq. 10-12 once, on angles that go on straight at both ends."""
    n = np.arange(len(angles))
    moved = np.interp(n - shift, n, angles)
    padded = np.concatenate([moved[:1], moved, moved[-1:]])
    slope = 0.5 * (padded[2:] - padded[:-2]) if central else padded[2:] - padded[1:-1]
    return np.asarray(moved + weight * slope)


def test_printed_lookup_of_fractions_blurs_the_body_and_ours_does_not() -> None:
    long = wave(np.arange(600)[::-1] * 2.5)  # 3.3 waves on the body
    blurred = long
    for _ in range(400):
        blurred = printed_step(blurred, 0.5, 0.0, central=False)
    exact = np.interp(np.arange(600) - 200.0, np.arange(600), long)
    assert np.abs(blurred - exact)[250:550].max() > 0.3

    track = AngleTrack(wave(2.5 * np.arange(N))[::-1])
    steady = SpeedLaw(1e-12, 0.0, 0.0, 0.0)
    run = synthesise(
        track,
        steady,
        401,
        Sampling(DT, R),
        lambda t, _: t.append(wave(2.5 * (t.end + np.arange(50)))),
        start=Start(speed_m_s=0.5 * R / DT),
    )
    np.testing.assert_allclose(run.angles_rad[-1], wave(2.5 * (299 - np.arange(N))), atol=1e-9)


def test_a_central_difference_amplifies_noise_without_bound_and_a_forward_one_damps_it() -> None:
    noise = 1e-3 * np.random.default_rng(2).normal(size=400)
    central, forward = noise, noise
    for _ in range(200):
        central = printed_step(central, 0.0, 0.5, central=True)
        forward = printed_step(forward, 0.0, 0.5, central=False)
    assert np.abs(central).max() > 1e3 * np.abs(noise).max()
    assert np.abs(forward).max() <= np.abs(noise).max()


def test_the_printed_slide_is_a_shift_less_the_weight() -> None:
    n = np.arange(300)
    ramp = 0.01 * n
    once = printed_step(ramp, 1.0, 0.3, central=False)
    np.testing.assert_allclose(once[5:-5], np.interp(n - 0.7, n, ramp)[5:-5], atol=1e-12)
    # so is ours, at one segment a frame
    run = one_segment_a_frame(50, sliding=0.3)
    np.testing.assert_allclose(np.diff(run.place, axis=0), 0.7, atol=1e-9)


def test_the_printed_recursion_adds_the_base_at_every_point() -> None:
    run = one_segment_a_frame(30)
    base, angles = run.points_m[-1, 0], run.angles_rad[-1]
    way = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    printed = np.cumsum(base - R * way, axis=0)  # P(n) = base + P(n - 1) + r y
    assert np.linalg.norm(np.diff(printed, axis=0), axis=1).max() > 10 * R
    ours = np.linalg.norm(np.diff(run.points_m[-1], axis=0), axis=1)
    np.testing.assert_allclose(ours, R, rtol=1e-9)


def test_with_the_printed_sign_the_body_lies_ahead_of_its_head() -> None:
    run = one_segment_a_frame(60)
    angles = run.angles_rad[-1]
    way = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    printed = run.points_m[-1, 0] + R * np.cumsum(way, axis=0)
    passed = run.points_m[:, 0]

    def to_the_way(points: np.ndarray) -> float:
        return float(np.linalg.norm(points[:, None] - passed, axis=2).min(axis=1).max())

    assert to_the_way(printed[:50]) > 20 * R
    assert to_the_way(run.points_m[-1, :50]) < 1e-9
