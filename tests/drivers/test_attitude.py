"""The attitude filter against closed forms."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from snakewalk.drivers.attitude import CORRECTION_1_S, AttitudeFilter

G = 9.81
UP = np.array([0.0, 0.0, G])
STEP_S = 0.01


def heading_rad(rotation: np.ndarray) -> float:
    return float(np.arctan2(rotation[1, 0], rotation[0, 0]))


@pytest.mark.parametrize("seed", range(4))
def test_it_begins_with_up_as_it_is_felt_and_heading_0(seed: int) -> None:
    turn = Rotation.random(random_state=seed).as_matrix()
    found = AttitudeFilter().update(np.zeros(3), turn.T @ UP, 0.0)
    np.testing.assert_allclose(found @ found.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(found), 1.0)
    np.testing.assert_allclose(found[2], turn[2], atol=1e-12)
    assert abs(heading_rad(found)) < 1e-9


def test_a_device_whose_x_points_up_has_an_attitude_too() -> None:
    found = AttitudeFilter().update(np.zeros(3), np.array([G, 0.0, 0.0]), 0.0)
    np.testing.assert_allclose(found[2], [1.0, 0.0, 0.0])


def test_a_level_turn_and_the_drift_of_a_bias_are_the_integral_of_the_rate() -> None:
    level = AttitudeFilter()
    for _ in range(301):
        found = level.update(np.array([0.0, 0.0, 0.4 + 0.02]), UP, STEP_S)
    assert heading_rad(found) == pytest.approx(3.0 * 0.42)


def test_a_bias_about_a_level_axis_tilts_by_bias_over_gain() -> None:
    """Correction and bias balance: the error settles at sin(tilt) = bias / gain."""
    level, bias = AttitudeFilter(), 0.01
    for _ in range(1500):
        found = level.update(np.array([bias, 0.0, 0.0]), UP, STEP_S)
    tilt = np.arccos(found[2, 2])
    assert np.sin(tilt) == pytest.approx(bias / CORRECTION_1_S, rel=0.01)


def test_a_tilt_error_decays_at_the_gains_rate() -> None:
    level = AttitudeFilter()
    level.update(np.zeros(3), Rotation.from_rotvec([0.1, 0.0, 0.0]).as_matrix().T @ UP, 0.0)
    for _ in range(200):
        found = level.update(np.zeros(3), UP, STEP_S)
    assert np.arccos(found[2, 2]) == pytest.approx(0.1 * np.exp(-CORRECTION_1_S * 2.0), rel=0.02)


def test_a_shove_says_nothing_of_up() -> None:
    level = AttitudeFilter()
    level.update(np.zeros(3), UP, 0.0)
    for _ in range(100):
        found = level.update(np.zeros(3), UP + np.array([6.0, 0.0, 0.0]), STEP_S)
    np.testing.assert_allclose(found, np.eye(3), atol=1e-12)
