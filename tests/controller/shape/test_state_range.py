"""The recording's own statistics decide which random states enter the graph ([PT] Eq. 1-2)."""

import numpy as np
import pytest

from snakewalk.controller.shape.library import build_library
from snakewalk.controller.shape.states import random_states, state_range, to_states
from snakewalk.controller.track.readers.generated import embedded


@pytest.mark.parametrize("name", ["worm-like", "lamprey-like"])
def test_random_states_fill_the_recorded_range_and_stay_in_it(name: str) -> None:
    states = to_states(embedded(name).angles_rad)
    seen = state_range(states)
    drawn = np.abs(random_states(states, 4000, np.random.default_rng(0)))
    assert (drawn >= seen.low - 1e-9).all()
    assert (drawn <= seen.high + 1e-9).all()
    reach = (drawn.max(axis=0) - drawn.min(axis=0)) / (seen.high - seen.low)
    assert reach.min() > 0.99


def test_phases_are_free() -> None:
    states = to_states(embedded("worm-like").angles_rad)
    phase = np.angle(random_states(states, 4000, np.random.default_rng(0)))
    counts = np.histogram(phase, bins=8, range=(-np.pi, np.pi))[0]
    assert counts.min() > 0.9 * counts.mean()


def test_the_library_s_random_shapes_have_the_track_s_statistics() -> None:
    """Coefficients of what is in the graph, measured again from its shapes."""
    angles = 0.5 * embedded("worm-like").angles_rad
    library = build_library(
        angles, {}, coefficients=7, random_count=300, curvature=1.0, rng=np.random.default_rng(1)
    )
    low, high = state_range(to_states(angles)).amplitude_rad().T
    recorded = np.median(np.std(library.shapes_rad[: library.recorded], axis=1))
    random = np.std(library.shapes_rad[library.recorded :], axis=1)
    bound = np.sqrt(np.sum(high**2))  # all coefficients at their largest
    assert random.max() < bound
    assert random.min() > 0.2 * np.sqrt(np.sum(low**2))
    assert 0.5 * recorded < np.median(random) < 2.0 * recorded


def test_amplitudes_are_those_of_a_wave() -> None:
    """A wave of 0.4 rad that fills the padded signal has that amplitude in its coefficient."""
    s = np.arange(100)
    bodies = np.stack([0.4 * np.cos(2 * np.pi * 2 * s / 128 + p) for p in np.linspace(0, 6, 9)])
    low, high = state_range(to_states(bodies)).amplitude_rad()[1]
    assert low == pytest.approx(0.4, rel=0.35)
    assert high == pytest.approx(0.4, rel=0.35)
