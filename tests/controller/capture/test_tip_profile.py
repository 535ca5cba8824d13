"""The end of a body by its profile: a bar whose ends are known, under lines of several lengths."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from snakewalk.config.arrays import Floats
from snakewalk.controller.capture.small_body.tip_profile import profile_ends, tips_error_px

BLUR_PX = 1.0
BAR = np.zeros((60, 220), np.float32)
BAR[27:34, 20:150] = 1.0
LEVEL = gaussian_filter(BAR, BLUR_PX)


def ends(first_px: float, last_px: float) -> Floats:
    """Ends of the bar, from a line along its middle."""
    line = np.column_stack([np.linspace(first_px, last_px, 60), np.full(60, 30.0)])
    return profile_ends(line, np.full(60, 3.5), LEVEL, BLUR_PX)


@pytest.mark.parametrize("last_px", [140.0, 148.0, 156.0])
def test_an_end_does_not_depend_on_where_the_line_ends(last_px: float) -> None:
    tail, head = ends(30.0, last_px)
    reference = ends(30.0, 144.0)[1]
    assert head == pytest.approx(reference, abs=0.03)
    assert 147.5 < head[0] < 149.5, "the last column is 149"
    assert tail[0] + head[0] == pytest.approx(20.0 + 149.0, abs=0.8)
    assert (tail[1], head[1]) == pytest.approx((30.0, 30.0), abs=1e-3)


def test_a_body_that_goes_on_ends_at_the_reach_of_the_profile() -> None:
    """A quarter of the line and 10 px, less a round tip of 1.5 px and twice the blur."""
    end_px = ends(50.0, 70.0)[1][0]
    reach_px, step_px = 0.25 * 20.0 + 10.0, 0.5
    assert -step_px - 1e-6 <= end_px - (70.0 + reach_px - 3.5) <= 1e-6


def test_the_error_of_the_tips_grows_with_their_distance() -> None:
    beyond_px = np.array([[3.0, 0.0], [0.0, 4.0]])
    assert tips_error_px(beyond_px) == pytest.approx(0.35 * 5.0)
