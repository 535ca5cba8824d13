"""The predicted speed is the quasi-static one, without a factor that nothing measured."""

from pathlib import Path

import numpy as np
import pytest

from snakewalk.controller.mechanics.traction import quasi_static_gain
from snakewalk.controller.run.factory import prepare_walk
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot


def test_the_gain_is_the_quasi_static_gain_of_the_shape() -> None:
    prepared = prepare_walk("flat-slalom", motion="serpenoid")
    points = np.arange(100)
    sine = 0.7 * np.sin(2.0 * np.pi * 1.2 * points / 100)
    expected = quasi_static_gain(sine[::-1], prepared.world.friction)[0]
    assert prepared.gain == pytest.approx(expected, rel=1e-9)


def test_the_gain_of_a_walk_lies_within_those_of_its_shapes() -> None:
    prepared = prepare_walk("flat-slalom")
    gains = quasi_static_gain(prepared.library.shapes_rad, prepared.world.friction)
    assert np.quantile(gains, 0.25) < prepared.gain < np.quantile(gains, 0.75)
    assert prepared.gain == pytest.approx(gains.mean(), rel=0.01)


@pytest.mark.slow
def test_a_simulated_body_on_level_ground_comes_near_its_prediction_without_an_alarm(
    tmp_path: Path,
) -> None:
    prepared = prepare_walk(
        "flat-slalom", motion="serpenoid", waypoints_m=((2.0, 0.0),), time_limit_s=30.0
    )
    finished = run_robot(RunRequest(prepared, tmp_path))
    eta, predicted = finished.summary.eta, finished.summary.eta_predicted
    assert eta is not None
    assert predicted is not None
    assert 0.9 < eta / predicted < 1.03
    assert finished.outcome.alarms == 0
