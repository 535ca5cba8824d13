"""A curve that jumps all the time is drawn as mean, least and largest; others as they are."""

import dataclasses

import numpy as np

from snakewalk.controller.report.curves import _figure, _panels, _traces
from snakewalk.controller.runlog.evidence import Kind, PoseEvidence
from snakewalk.controller.runlog.record import RunRecord


def test_a_curve_that_jumps_all_the_time_has_mean_least_and_largest() -> None:
    time_s = 0.02 * np.arange(2000)
    jumping = np.where(np.arange(2000) % 5 < 2, 3.6, 5.2)
    low, high, mean = _traces("on the wire", "#0072b2", 1, time_s, jumping)
    assert not any("fill" in line for line in (low, high, mean))
    assert (low["showlegend"], high["showlegend"]) == (False, False)
    names = [line["name"] for line in (low, mean, high)]
    assert names == ["on the wire, least", "on the wire, mean", "on the wire, largest"]


def test_a_slow_curve_with_noise_is_drawn_as_it_is() -> None:
    time_s = 0.02 * np.arange(2000)
    noise = 0.01 * np.random.default_rng(0).normal(size=2000)
    (only,) = _traces("speed", "#0072b2", 1, time_s, np.sin(time_s) + noise)
    assert only["name"] == "speed"


def test_a_short_run_or_a_curve_without_values_is_one_line() -> None:
    assert len(_traces("a", "#0072b2", 1, np.arange(9.0), np.arange(9) % 2 * 1.0)) == 1
    assert len(_traces("a", "#0072b2", 1, np.arange(9.0), np.full(9, np.nan))) == 1


def test_panels_of_a_dead_reckoned_pose_state_it(record: RunRecord) -> None:
    reckoned = PoseEvidence(Kind.DEAD_RECKONED, "joints")
    believed = dataclasses.replace(
        record, header=dataclasses.replace(record.header, pose_evidence=reckoned)
    )
    titles = [_figure(of, _panels(of)[0], 0)["titles"] for of in (record, believed)]
    named = [each for each in titles[1] if "dead-reckoned" in each]
    assert named == [
        "distance from the path, m, dead-reckoned",
        "speed, m/s, dead-reckoned",
    ]
    assert [each.replace(", dead-reckoned", "") for each in titles[1]] == titles[0]
