"""Angles and points over time: what follows the head, what slides, how the printed text fails."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from snakewalk.config.run import WalkConfig
from snakewalk.controller.capture.readers.generated import embedded
from snakewalk.controller.mechanics.ground_step import GroundStep
from snakewalk.controller.mechanics.speed_law import SpeedLaw
from snakewalk.controller.shape.states import to_states
from snakewalk.controller.walk.angle_track import AngleTrack
from snakewalk.controller.walk.synthesis import (
    Behaviour,
    Locomotion,
    synthesise,
    varied_pulse,
    waves_mask,
)
from snakewalk.controller.walk.walker import Walker

N = 100
R = 0.012
DT = 0.04
LAW = SpeedLaw.printed(unit_m=0.1)


def wave(sample: np.ndarray, amplitude: float = 0.6) -> np.ndarray:
    return amplitude * np.sin(2 * np.pi * 1.3 * sample / N)


def fresh() -> AngleTrack:
    return AngleTrack(wave(np.arange(N))[::-1])


def grow(track: AngleTrack) -> None:
    track.append(wave(track.end + np.arange(50)))


def go(frames: int = 250, law: SpeedLaw = LAW, **how: object) -> Locomotion:
    return synthesise(fresh(), law, frames, DT, R, grow, Behaviour(**how))  # type: ignore[arg-type]


def one_segment_a_frame(frames: int, sliding: float = 0.0) -> Locomotion:
    """The body advances r in each frame, whatever its bends."""
    keep = SpeedLaw(1e-12, 0.0, 0.0, 0.0)
    return synthesise(
        fresh(), keep, frames, DT, R, grow, Behaviour(sliding=sliding), speed_m_s=R / DT
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


@settings(max_examples=20, deadline=None)
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
    synthesise(track, LAW, 100, DT, R, grow)
    assert track.end > N + 40
    with pytest.raises(ValueError, match="the track ends at sample 99"):
        synthesise(fresh(), LAW, 100, DT, R)


def test_clamping_instead_of_growing_straightens_the_body() -> None:
    ours, clamped = go(250), fresh()
    bodies = np.interp(ours.place[-1], np.arange(clamped.end), clamped.at_rad(np.arange(N)))
    assert bodies.std() < 0.5 * ours.angles_rad[-1].std()


def test_a_walk_of_states_feeds_it_and_the_ground_carries_it() -> None:
    shapes = embedded("worm-like").angles_rad
    walker = Walker(shapes - shapes.mean(axis=1, keepdims=True), WalkConfig())
    run = synthesise(walker.track, LAW, 80, DT, R, lambda _: walker.decide(0.0, 0.0))
    placed = GroundStep(None).place(run.angles_rad, run.points_m[:, -1], R, 0.03)
    np.testing.assert_allclose(placed.points_m[..., :2], run.points_m, atol=1e-9)


def test_states_are_chosen_by_their_waves() -> None:
    s = (np.arange(N) + 0.5) / N
    states = to_states(np.stack([np.sin(2 * np.pi * k * s) for k in (0.8, 3.9)]))
    np.testing.assert_array_equal(waves_mask(states, slice(0, 2), 0.7), [True, False])
    np.testing.assert_array_equal(waves_mask(states, slice(3, 7), 0.7), [False, True])
    with pytest.raises(ValueError, match=r"sliding 1\.5"):
        Behaviour(sliding=1.5)


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
        DT,
        R,
        lambda t: t.append(wave(2.5 * (t.end + np.arange(50)))),
        speed_m_s=0.5 * R / DT,
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
