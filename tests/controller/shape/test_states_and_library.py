"""Shape states: invariance, energy, errata; the library keeps what the robot can use."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from snakewalk.config.errors import InputError
from snakewalk.config.world import FrictionConfig
from snakewalk.controller.mechanics.traction import quasi_static_gain
from snakewalk.controller.shape import crossing
from snakewalk.controller.shape.crossing import self_touches
from snakewalk.controller.shape.library import build_library
from snakewalk.controller.shape.states import energy_kept, pad, random_states, to_angles, to_states
from snakewalk.controller.track.readers.generated import EMBEDDED, embedded

S = (np.arange(100) + 0.5) / 100


def waves(k: float, phase: float = 0.3) -> np.ndarray:
    return 0.6 * np.sin(2 * np.pi * k * S + phase)


@given(st.floats(-20, 20), st.floats(0.5, 4))
def test_a_state_does_not_change_with_heading_even_across_pi(turn: float, k: float) -> None:
    state = to_states(waves(k))
    wrapped = (waves(k) + turn + np.pi) % (2 * np.pi) - np.pi
    np.testing.assert_allclose(to_states(wrapped), state, atol=1e-9)


def test_without_unwrapping_invariance_fails() -> None:
    wrapped = (waves(1.2) + 3.0 + np.pi) % (2 * np.pi) - np.pi
    naive = np.fft.fft(pad(wrapped))[1:8]
    assert np.abs(naive - to_states(waves(1.2))).max() > 1.0


def test_rebuilding_from_all_coefficients_is_exact() -> None:
    angles = waves(1.4) + 0.2 * S
    rebuilt = to_angles(to_states(angles, 64))
    np.testing.assert_allclose(rebuilt, angles - angles.mean(), atol=1e-3)


def test_a_plain_transpose_without_the_mirror_does_not_rebuild() -> None:
    state = to_states(waves(1.4))
    spectrum = np.zeros(200, complex)
    spectrum[1:8], spectrum[-7:] = state, state  # neither conjugated nor reversed
    printed = np.fft.ifft(spectrum)[:100]
    assert np.abs(printed - waves(1.4)).max() > 0.3
    assert np.abs(to_angles(state) - (waves(1.4) - waves(1.4).mean())).max() < 0.15


def test_seven_coefficients_keep_99_percent_up_to_five_waves_of_the_padded_signal() -> None:
    few = [energy_kept(waves(k, p)) for k in (0.5, 1.0, 2.0, 3.0) for p in (0.0, 1.0, 2.0)]
    assert min(few) > 0.97
    assert energy_kept(waves(4.0)) > 0.97
    assert energy_kept(waves(8.0)) < 0.4


def test_coefficient_zero_is_the_mean_of_the_padded_signal_not_of_the_body() -> None:
    angles = waves(0.7) + 1.0
    assert abs(pad(angles).mean() - angles.mean()) > 0.05
    assert to_angles(to_states(angles)).mean() == pytest.approx(0.0, abs=1e-12)


def test_random_states_stay_in_the_recorded_range_of_moduli() -> None:
    states = to_states(embedded("worm-like").angles_rad)
    drawn = np.abs(random_states(states, 500, np.random.default_rng(0)))
    assert (drawn >= np.abs(states).min(axis=0) - 1e-9).all()
    assert (drawn <= np.abs(states).max(axis=0) + 1e-9).all()


def test_a_closed_circle_touches_itself_and_a_half_circle_does_not() -> None:
    circle, half = 2 * np.pi * S, np.pi * S
    np.testing.assert_array_equal(
        self_touches(np.stack([circle, half, 0 * S]), 1.2, 0.03), [True, False, False]
    )


def test_a_hairpin_touches_exactly_when_it_is_narrower_than_the_body() -> None:
    # two straight legs joined by a half circle of diameter d: legs are d apart
    def hairpin(diameter_m: float) -> np.ndarray:
        turn = np.clip((S - 0.5) * 1.2 / (0.5 * np.pi * diameter_m) + 0.5, 0, 1)
        return np.pi * turn

    assert not self_touches(hairpin(0.075), 1.2, 0.03)[0]
    assert self_touches(hairpin(0.05), 1.2, 0.03)[0]


def test_bent_bodies_push_and_straight_ones_do_not() -> None:
    friction = FrictionConfig()
    gains = [
        quasi_static_gain(a * np.sin(2 * np.pi * 1.25 * S), friction)[0] for a in (0.1, 0.4, 0.8)
    ]
    assert 0.0 < gains[0] < gains[1] < gains[2] < 1.0
    assert quasi_static_gain(0 * S, friction)[0] == pytest.approx(0.0, abs=1e-6)
    grip = quasi_static_gain(waves(1.25), FrictionConfig(along=0.001, across=1.0))[0]
    assert grip == pytest.approx(1.0, abs=0.02)


def test_the_library_is_filtered_counted_and_repeatable() -> None:
    track = embedded("worm-like").angles_rad

    def build(seed: int):
        return build_library(
            track,
            {"too bent": lambda x: np.abs(np.diff(x, axis=1)).max(axis=1) > 0.11},
            coefficients=7,
            random_count=40,
            curvature=1.0,
            rng=np.random.default_rng(seed),
        )

    first, again, other = build(1), build(1), build(2)
    np.testing.assert_array_equal(first.shapes_rad, again.shapes_rad)
    assert len(first.shapes_rad) == first.recorded + 40
    assert np.abs(np.diff(first.shapes_rad, axis=1)).max() <= 0.11
    assert first.counts["random"] == 40
    assert (first.shapes_rad[-1] != other.shapes_rad[-1]).any()


def test_a_robot_that_cannot_make_the_states_is_told_so_with_reasons() -> None:
    with pytest.raises(InputError, match=r"0 of 10 random states.*joint limits: \d+"):
        build_library(
            embedded("worm-like").angles_rad,
            {"joint limits": lambda x: np.ones(len(x), bool)},
            coefficients=7,
            random_count=10,
            curvature=1.0,
            rng=np.random.default_rng(0),
        )


@pytest.mark.parametrize(
    ("across", "least", "most"), [(0.7, 1.0, 1.0), (0.15, 1.2, 1.8), (0.12, 1.4, 2.0)]
)
def test_bends_are_as_wide_as_the_friction_asks(across: float, least: float, most: float) -> None:
    friction = FrictionConfig(along=0.1, across=across)
    filters = {"traction": lambda x: quasi_static_gain(x, friction) < 0.6}
    made = build_library(
        embedded("worm-like").angles_rad,
        filters,
        coefficients=7,
        random_count=40,
        curvature=None,
        rng=np.random.default_rng(1),
    )
    assert least <= made.curvature <= most
    assert (quasi_static_gain(made.shapes_rad, friction) >= 0.6).all()


@pytest.mark.parametrize("name", EMBEDDED)
def test_embedded_waves_travel_from_head_to_tail(name: str) -> None:
    angles = embedded(name).angles_rad
    late = np.mean((angles[1:, 1:] - angles[:-1, :-1]) ** 2)
    early = np.mean((angles[1:, :-1] - angles[:-1, 1:]) ** 2)
    assert late < early
    assert energy_kept(angles).mean() > 0.99


def test_an_unknown_recording_is_refused_by_name() -> None:
    with pytest.raises(InputError, match="nosuch"):
        embedded("nosuch")


def test_self_contact_is_the_same_as_the_loops_are_written(monkeypatch: pytest.MonkeyPatch) -> None:
    rng, at = np.random.default_rng(3), np.arange(100)
    phase = 2.0 * np.pi * (rng.uniform(0.5, 3.0, (30, 1)) * at / 100 + rng.uniform(0, 1, (30, 1)))
    shapes = rng.uniform(0.5, 2.5, (30, 1)) * np.sin(phase)
    compiled = self_touches(shapes, 1.2, 0.03)
    assert 0 < compiled.sum() < 30
    for name, each in vars(crossing).items():
        if hasattr(each, "py_func"):
            monkeypatch.setattr(crossing, name, each.py_func)
    np.testing.assert_array_equal(self_touches(shapes, 1.2, 0.03), compiled)
