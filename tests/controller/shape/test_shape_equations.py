"""What a state leaves out and what it keeps ([PT] 2.5), as properties."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from snakewalk.controller.shape.states import energy_kept, to_angles, to_states
from snakewalk.controller.track.readers.generated import EMBEDDED, embedded

S = (np.arange(100) + 0.5) / 100
PHASES = np.linspace(0, 2 * np.pi, 8, endpoint=False)


def waves(k: float) -> np.ndarray:
    return 0.6 * np.sin(2 * np.pi * k * S + PHASES[:, None])


@given(
    st.lists(st.floats(-0.5, 0.5), min_size=3, max_size=7),
    st.floats(-30, 30),
)
def test_any_smooth_body_has_one_state_whatever_its_heading(
    bends: list[float], turn: float
) -> None:
    body = sum(a * np.sin(2 * np.pi * (i + 1) * 0.4 * S + i) for i, a in enumerate(bends))
    wrapped = np.angle(np.exp(1j * (body + turn)))
    np.testing.assert_allclose(to_states(wrapped), to_states(body), atol=1e-8)


@pytest.mark.parametrize("name", EMBEDDED)
def test_bodies_rebuilt_from_states_have_the_same_state_again(name: str) -> None:
    states = to_states(embedded(name).angles_rad, 7)
    once = to_angles(states)
    # padding is not known to the state, so a second look differs, by as much as the first lost
    assert np.abs(to_angles(to_states(once)) - once).max() < 0.2
    mean = embedded(name).angles_rad.mean(axis=1, keepdims=True)
    assert np.sqrt(np.mean((once + mean - embedded(name).angles_rad) ** 2)) < 0.1


@pytest.mark.parametrize("name", EMBEDDED)
def test_seven_coefficients_hold_99_percent_of_the_shipped_recordings(name: str) -> None:
    assert energy_kept(embedded(name).angles_rad).mean() > 0.99


def test_the_99_percent_end_where_the_coefficients_do() -> None:
    kept = {k: energy_kept(waves(k)).mean() for k in (1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0)}
    assert min(kept[k] for k in (1.0, 2.0, 3.0, 4.0)) > 0.99
    assert kept[5.0] > 0.98
    assert kept[6.0] < 0.6
    assert kept[7.0] < 0.5
    # the remedy: more coefficients
    assert energy_kept(waves(7.0), 12).mean() > 0.97
