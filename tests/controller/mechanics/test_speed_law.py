"""The speed law: steady speeds, rest, the Euler limit, units, identification."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from snakewalk.controller.mechanics.speed_law import SpeedLaw, identify

LAW = SpeedLaw.printed(unit_m=0.2)


def run(
    law: SpeedLaw, k: float, turn: float, dt_s: float, steps: int, v: float = 0.0
) -> list[float]:
    speeds = [v]
    for _ in range(steps):
        speeds.append(law.step_m_s(speeds[-1], k, turn, dt_s))
    return speeds


@given(st.floats(0, 1.5), st.floats(-3, 3), st.floats(0, 2), st.floats(0.01, 1.9))
def test_every_start_ends_at_the_closed_form(k: float, turn: float, v: float, dt: float) -> None:
    steady = max(0.0, max(0.0, 6 * k - abs(turn)) - 0.5) * 0.2
    assert LAW.steady_m_s(k, turn) == pytest.approx(steady, abs=1e-12)
    assert run(LAW, k, turn, dt, 2000, v)[-1] == pytest.approx(steady, abs=1e-6)


def test_between_the_ends_it_is_an_exponential() -> None:
    speeds = run(LAW, 0.5, 0.0, 0.001, 1000)
    assert speeds[-1] == pytest.approx(0.5 * (1 - np.exp(-1)), rel=1e-3)


@given(st.floats(0, 0.5 / 6), st.floats(0.01, 1.9))
def test_friction_never_pushes_backwards_at_rest(k: float, dt: float) -> None:
    assert run(LAW, k, 0.0, dt, 5) == [0.0] * 6


def test_turning_slows_and_never_pulls_backwards() -> None:
    assert LAW.steady_m_s(0.5, 1.0) < LAW.steady_m_s(0.5)
    assert LAW.steady_m_s(0.5, -1.0) == LAW.steady_m_s(0.5, 1.0)
    assert LAW.steady_m_s(0.1, 50.0) == 0.0


def test_the_length_unit_scales_speeds_and_nothing_else() -> None:
    half = SpeedLaw.printed(unit_m=0.1)
    np.testing.assert_allclose(
        2 * np.array(run(half, 0.4, 0.3, 0.04, 100)), run(LAW, 0.4, 0.3, 0.04, 100)
    )


def test_a_derivative_of_the_turning_rate_would_not_slow_an_even_turn() -> None:
    # Eq. 8 takes the derivative of O, and the text says that O itself is the rate of turning.
    time_s = np.arange(100) * 0.04
    turn_rad_s = np.gradient(0.7 * time_s, time_s)
    printed = LAW.steady_m_s(0.5, np.gradient(turn_rad_s, time_s))
    np.testing.assert_allclose(printed, LAW.steady_m_s(0.5), atol=1e-9)
    np.testing.assert_allclose(LAW.steady_m_s(0.5) - LAW.steady_m_s(0.5, turn_rad_s), 0.2 * 0.7)


def test_printed_norms_would_never_slow_a_body_down() -> None:
    # Eq. 9: |dv/dt| = |F| - |T|. A norm is not negative, so a coasting body must not lose speed.
    speed, dt = 1.0, 0.04
    printed = speed + dt * abs(0.0 - (speed + 0.5))
    assert printed > speed
    assert LAW.step_m_s(speed, 0.0, 0.0, dt) < speed
    assert run(LAW, 0.0, 0.0, dt, 200, speed)[-1] == 0.0


def test_unclamped_friction_drives_a_body_backwards() -> None:
    speed = 0.0
    for _ in range(100):  # as printed, with a sign but without v >= 0
        speed += 0.04 * (0.0 - speed - 0.1)
    assert speed < -0.09
    assert LAW.step_m_s(0.0, 0.0, 0.0, 0.04) == 0.0


def test_beyond_two_over_c1_euler_diverges_and_is_refused() -> None:
    def error(dt: float) -> float:
        v = 0.51
        for _ in range(60):
            v += dt * (0.5 - v)
        return abs(v - 0.5)

    assert error(1.95) < 0.01 < 1.0 < error(2.1)
    assert LAW.step_m_s(0.5, 0.5, 0.0, 1.99) >= 0.0
    with pytest.raises(ValueError, match="below 2 s is stable"):
        LAW.step_m_s(0.5, 0.5, 0.0, 2.0)


def test_identification_finds_the_law_that_made_the_samples() -> None:
    truth, rng = SpeedLaw(1.7, 0.03, 0.9, 0.05), np.random.default_rng(3)
    k, turn = rng.uniform(0, 0.8, 400), rng.normal(0, 1, 400)
    v = rng.uniform(0, 0.6, 400)
    push = np.maximum(0.9 * k - 0.05 * np.abs(turn), 0.0)
    found = identify(k, turn, v, push - 1.7 * v - 0.03)
    for name in ("viscous_1_s", "coulomb_m_s2", "bend_m_s2_rad", "turn_m_s"):
        assert getattr(found.law, name) == pytest.approx(getattr(truth, name), rel=1e-4)
    assert found.rms_m_s2 < 1e-6
    assert found.explained == pytest.approx(1.0)

    steady = identify(k, turn, truth.steady_m_s(k, turn), viscous_1_s=1.7)
    np.testing.assert_allclose(steady.law.steady_m_s(k, turn), truth.steady_m_s(k, turn), atol=1e-6)
    assert steady.samples < 400  # those at rest say too little


def test_identification_from_noisy_samples_and_from_too_few() -> None:
    rng = np.random.default_rng(5)
    k, turn = rng.uniform(0.5, 1.0, 300), rng.uniform(-2, 2, 300)
    v = LAW.steady_m_s(k, turn) + rng.normal(0, 0.02, 300)
    found = identify(k, turn, v)
    assert found.law.bend_m_s2_rad == pytest.approx(1.2, rel=0.05)
    assert found.rms_m_s2 == pytest.approx(0.02, rel=0.15)
    unrelated = identify(k, turn, rng.uniform(0.3, 0.4, 300))
    assert unrelated.explained < 0.1
    with pytest.raises(ValueError, match="2 moving samples"):
        identify(k[:2], turn[:2], np.array([0.1, 0.2]))
