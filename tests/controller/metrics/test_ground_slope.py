"""Slope under the body, and the share of the walk on wide waves."""

import dataclasses

import numpy as np
import pytest

from snakewalk.config.heightfield import HeightField
from snakewalk.controller.metrics.ground_slope import carrier_share, ground_slope
from snakewalk.controller.metrics.summary import summary
from snakewalk.controller.runlog.record import RunRecord

PLANE = HeightField(np.tile(0.1 * np.arange(0.0, 4.01, 0.1), (41, 1)), 0.1, 0.0, 0.0)


def body(ahead_rad: float) -> np.ndarray:
    """Links (1, 9, 3) of a straight body, head first."""
    along = np.linspace(0.5, -0.5, 9)[:, None]
    return (np.array([2.0, 2.0, 0.0]) + along * [np.cos(ahead_rad), np.sin(ahead_rad), 0.0])[None]


@pytest.mark.parametrize(
    ("ahead_rad", "factor"), [(0.0, 1.0), (np.pi, -1.0), (0.5 * np.pi, 0.0), (1.0, np.cos(1.0))]
)
def test_slope_of_a_plane_of_a_tenth(ahead_rad: float, factor: float) -> None:
    slope = ground_slope(PLANE, body(ahead_rad))
    assert slope.ahead_rad == pytest.approx([np.arctan(0.1 * factor)], abs=1e-6)
    assert slope.steepest_rad == pytest.approx([np.arctan(0.1)], abs=1e-6)


def test_an_unknown_pose_has_no_slope() -> None:
    links_m = np.concatenate([body(0.0), np.full((1, 9, 3), np.nan)])
    assert np.isnan(ground_slope(PLANE, links_m).ahead_rad).tolist() == [False, True]


def test_the_share_of_decisions_on_wide_waves(record: RunRecord) -> None:
    assert np.isnan(carrier_share(record))  # an older log
    assert summary(record).carrier_share is None
    wide = np.where(np.arange(len(record.walk.time_s)) % 4 == 0, 1.1, 0.0)
    known = dataclasses.replace(record, walk=dataclasses.replace(record.walk, carrier_rad=wide))
    assert carrier_share(known) == pytest.approx((wide > 0.0).mean())
    assert summary(known).carrier_share == pytest.approx((wide > 0.0).mean(), rel=1e-5)
