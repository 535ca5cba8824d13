"""Curves over time and along the body, and what is refused of them."""

import numpy as np
import pytest
from pydantic import ValidationError

from snakewalk.config.synthesis import SynthesisConfig, WavesConfig, along_body, curve_at


def test_a_curve_is_a_number_or_knots() -> None:
    np.testing.assert_array_equal(curve_at(0.3, np.arange(3.0)), [0.3] * 3)
    knots = SynthesisConfig(sliding=((1.0, 0.0), (3.0, 0.5))).sliding
    np.testing.assert_allclose(curve_at(knots, [0.0, 1.0, 2.0, 3.0, 9.0]), [0, 0, 0.25, 0.5, 0.5])
    np.testing.assert_allclose(along_body((1.0,), 4), 1.0)
    np.testing.assert_allclose(along_body((0.0, 1.0, 0.0), 5), [0.0, 0.5, 1.0, 0.5, 0.0])


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"sliding": 1.2}, "values from 0 to 1"),
        ({"sliding": ((0.0, 0.1), (0.0, 0.2))}, "times that increase"),
        ({"head_held": ()}, "one or more"),
        ({"tongue_speed": ((0.0, 1.0), (2.0, 3.0))}, r"values from 0\.4 to 2\.5"),
        ({"pulse_along": ()}, "one factor or more"),
        ({"sliding_along": (0.5, 1.5)}, "sliding_along: factors from 0 to 1"),
        ({"coefficients": 4, "waves": {"short": 1.0}}, "need 7 coefficients, not 4"),
        ({"viscous": 60.0}, "viscous: below 50"),
        ({"slidin": 0.1}, "Extra inputs"),
    ],
)
def test_faults_say_what_would_be_right(keys: dict[str, object], said: str) -> None:
    with pytest.raises(ValidationError, match=said):
        SynthesisConfig.model_validate(keys)


def test_parts_of_the_library_by_waves() -> None:
    assert WavesConfig().parts == {}
    assert WavesConfig(long=3.0, short=1.0).parts == {(1, 2): 0.75, (5, 7): 0.25}
