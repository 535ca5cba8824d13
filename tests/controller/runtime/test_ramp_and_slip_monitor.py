"""Start ramps stay within their limits; the advance alarm tells a moving body from a stuck one."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from snakewalk.controller.kinematics.ramp import Ramp
from snakewalk.controller.runtime.slip_monitor import SlipMonitor

angles = st.lists(st.floats(-1.5, 1.5), min_size=4, max_size=4).map(np.array)


@given(angles, angles, st.floats(0.1, 4.0), st.floats(0.5, 40.0))
def test_a_ramp_meets_its_ends_and_its_limits(start, goal, speed, acceleration) -> None:
    ramp = Ramp(start, goal, speed, acceleration)
    np.testing.assert_array_equal(ramp.at(-1.0), start if ramp.duration_s else goal)
    np.testing.assert_allclose(ramp.at(ramp.duration_s), goal, atol=1e-12)
    if ramp.duration_s < 1e-3:
        return
    time = np.linspace(0.0, ramp.duration_s, 801)
    q = np.array([ramp.at(t) for t in time])
    dt = time[1] - time[0]
    assert np.abs(np.diff(q, axis=0)).max() / dt <= speed * 1.001
    assert np.abs(np.diff(q, 2, axis=0)).max() / dt**2 <= acceleration * 1.01


@pytest.mark.parametrize(
    ("gain", "alarm"), [(0.7, False), (0.36, False), (0.34, True), (-0.2, True)]
)
def test_the_alarm_sounds_below_half_of_the_prediction(gain: float, alarm: bool) -> None:
    watch = SlipMonitor(length_m=1.2, gain=0.7, fraction=0.5)
    pulse = np.float64(0.006)
    sounded = [watch.update(pulse, gain * pulse) for _ in range(450)]
    assert {type(each) for each in sounded} == {bool}
    assert any(sounded) is alarm
    assert watch.window is not None
    assert watch.window.share == pytest.approx(gain / 0.7, abs=0.01)


@pytest.mark.parametrize(("share", "alarm"), [(0.51, 0), (0.35, 20)])
def test_noise_of_the_pose_raises_no_alarm(share: float, alarm: int) -> None:
    """A body just above the limit, seen at 1 cm, is not reported; one that slips always is."""
    rng = np.random.default_rng(4)
    watch = SlipMonitor(length_m=1.2, gain=0.7, fraction=0.5, pose_sd_m=0.01)
    sounded = 0
    for _ in range(20):
        begin_m, end_m = 0.01 * rng.standard_normal(2)
        sounded += watch.update(1.2, share * 0.7 * 1.2 + end_m - begin_m)
    assert sounded == alarm
