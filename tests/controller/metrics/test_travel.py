"""Displacement that speed and cost of transport are computed from, against closed forms."""

from dataclasses import replace

import numpy as np
import pytest

from snakewalk.config.gait import GaitChange, GaitConfig
from snakewalk.config.loader import load_robot
from snakewalk.controller.metrics.displacement import gait_displacement
from snakewalk.controller.metrics.summary import summary
from snakewalk.controller.metrics.travel import travel
from snakewalk.controller.runlog.record import RunRecord

RISE_M_S, DRIFT_M_S = 0.01, 0.2


def climbing(record: RunRecord, gait: GaitConfig) -> RunRecord:
    """Return the log of a body that rises and drifts at constant speeds in one shape."""
    pose, plan = record.pose, replace(record.header.plan, waypoints_m=np.zeros((0, 2)))
    since_s = pose.time_s - pose.time_s[0]
    moved_m = np.stack([DRIFT_M_S * since_s, 0.0 * since_s, RISE_M_S * since_s], axis=1)
    links_m = pose.links_m[0] + moved_m[:, None]
    pose = replace(
        pose,
        links_m=links_m,
        centre_m=links_m.mean(axis=1),
        rotation=np.tile(np.eye(3), (len(since_s), 1, 1)),
    )
    run = record.header.run.model_copy(update={"gait": gait, "waypoints_m": ()})
    header = replace(record.header, run=run, plan=plan, robot=load_robot("alternating16"))
    return replace(record, header=header, pose=pose, events=())


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize(
    ("name", "speed_m_s"), [("helix-pole", RISE_M_S), ("lateral-undulation", DRIFT_M_S)]
)
def test_a_climber_travels_upwards_and_another_gait_over_the_ground(
    record: RunRecord, name: str, speed_m_s: float
) -> None:
    log = climbing(record, GaitConfig(name=name))
    assert gait_displacement(log).cycles > 0
    assert travel(log).speed_m_s == pytest.approx(speed_m_s, rel=1e-6)
    assert summary(log).speed_m_s == pytest.approx(speed_m_s, rel=1e-5)


def test_a_gait_that_changes_travels_along_the_line_between_its_ends(record: RunRecord) -> None:
    other = GaitChange(at_s=5.0, name="lateral-undulation")
    log = climbing(record, GaitConfig(name="sidewinding", then=(other,)))
    assert travel(log).speed_m_s == pytest.approx(np.hypot(RISE_M_S, DRIFT_M_S), rel=1e-6)


def test_a_body_that_falls_has_no_cost_of_transport(record: RunRecord) -> None:
    log = climbing(record, GaitConfig(name="helix-pole"))
    time_s = log.cycle.time_s
    cycle = replace(log.cycle, electrical_j=6.0 * time_s, mechanical_j=1.5 * time_s)
    assert summary(replace(log, cycle=cycle)).electrical_cost_of_transport > 0.0
    falls = log.pose.centre_m * [1.0, 1.0, -1.0], log.pose.links_m * [1.0, 1.0, -1.0]
    fallen = replace(log.pose, centre_m=falls[0], links_m=falls[1])
    n = summary(replace(log, cycle=cycle, pose=fallen))
    assert n.speed_m_s == pytest.approx(-RISE_M_S, rel=1e-5)
    assert n.electrical_cost_of_transport is None
