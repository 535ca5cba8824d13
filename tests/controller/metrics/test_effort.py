"""Energy and cost of transport of runs whose energy is known."""

from dataclasses import replace

import numpy as np
import pytest

from snakewalk.config.constants import GRAVITY_M_S2
from snakewalk.controller.metrics.effort import energy_track
from snakewalk.controller.metrics.path_error import travelled_m
from snakewalk.controller.metrics.summary import summary
from snakewalk.controller.runlog.record import RunRecord, Winding

WATTS, SHAFT_W = 6.0, 1.5


def integrated(record: RunRecord) -> RunRecord:
    """The same run with steady powers, added up since long before its start."""
    time_s = record.cycle.time_s
    cycle = replace(
        record.cycle, electrical_j=40.0 + WATTS * time_s, mechanical_j=3.0 + SHAFT_W * time_s
    )
    return replace(record, cycle=cycle)


def test_a_cost_is_energy_over_weight_and_way_while_the_pulse_moves(record: RunRecord) -> None:
    n, pose, robot = summary(integrated(record)), record.pose, record.header.robot
    rows = np.flatnonzero(pose.pulse_m_s > 0.0)
    span_s = pose.time_s[rows[-1]] - pose.time_s[rows[0]]
    weight_n = robot.mean_link_mass_kg * (robot.joint_count + 1) * GRAVITY_M_S2
    carried_j = weight_n * travelled_m(pose, rows[0], rows[-1])
    whole_s = record.cycle.time_s[-1] - record.cycle.time_s[0]
    assert n.energy_source == "integrated"
    assert n.electrical_energy_j == pytest.approx(WATTS * whole_s, rel=1e-5)
    assert n.mechanical_energy_j == pytest.approx(SHAFT_W * whole_s, rel=1e-5)
    assert n.electrical_cost_of_transport == pytest.approx(WATTS * span_s / carried_j, rel=1e-5)
    assert n.mechanical_cost_of_transport == pytest.approx(SHAFT_W * span_s / carried_j, rel=1e-5)


def test_without_waypoints_the_way_is_straight(record: RunRecord) -> None:
    header, pose = record.header, record.pose
    plan = replace(header.plan, waypoints_m=np.zeros((0, 2)))
    still = replace(pose, pulse_m_s=np.zeros_like(pose.pulse_m_s))
    n = summary(replace(integrated(record), header=replace(header, plan=plan), pose=still))
    robot = header.robot
    weight_n = robot.mean_link_mass_kg * (robot.joint_count + 1) * GRAVITY_M_S2
    carried_j = weight_n * float(np.linalg.norm(pose.centre_m[-1] - pose.centre_m[0]))
    span_s = pose.time_s[-1] - pose.time_s[0]
    assert n.electrical_cost_of_transport == pytest.approx(WATTS * span_s / carried_j, rel=1e-5)


def test_a_log_without_energies_is_sampled_and_says_so(record: RunRecord) -> None:
    """Metal, and logs of before: constant current and speed have a closed form."""
    shape = record.cycle.current_a.shape
    cycle = replace(
        record.cycle,
        current_a=np.full(shape, 0.5),
        velocity_rad_s=np.full(shape, -1.0),
        measured_rad=np.zeros(shape),
        sent_rad=np.zeros(shape),
    )
    header = replace(record.header, winding=Winding(5.0, 2.0), torque_constant_n_m_a=1.5)
    track = energy_track(replace(record, cycle=cycle, header=header))
    seconds = cycle.time_s[-1] - cycle.time_s[0]
    assert track.source == "sampled"
    assert track.between(-np.inf, np.inf) == pytest.approx(
        (shape[1] * (5.0 * 0.25 - 2.0 * 0.5) * seconds, shape[1] * -1.5 * 0.5 * seconds)
    )
    giving = replace(cycle, velocity_rad_s=np.full(shape, -2.0))  # gives back: lost, not deducted
    given = energy_track(replace(record, cycle=giving, header=header))
    assert given.electrical_j[-1] == 0.0
    assert given.mechanical_j[-1] < track.mechanical_j[-1]


def test_the_current_between_two_readings_follows_from_goals_and_angles(
    record: RunRecord,
) -> None:
    """A joint starts each cycle 2 d off its goal and is read d off it, with half of the current."""
    count, joints = record.cycle.current_a.shape
    robot = record.header.robot
    facts = robot.servo_records[0]
    assert facts.stall_current_a is not None
    d = 0.01
    per_rad_a = robot.position_p_gains[0] / facts.full_output_rad * facts.stall_current_a
    yaw = np.array(robot.current_limits_a) == np.inf
    turned = np.arange(count)[:, None] * d * yaw
    cycle = replace(
        record.cycle,
        current_a=np.tile(per_rad_a * d * yaw, (count, 1)),
        velocity_rad_s=np.zeros((count, joints)),
        measured_rad=turned,
        sent_rad=turned + 2.0 * d * yaw,
        wire_busy_s=np.zeros(count),
    )
    header = replace(record.header, winding=Winding(5.0, 0.0))
    track = energy_track(replace(record, cycle=cycle, header=header))
    seconds = cycle.time_s[-1] - cycle.time_s[0]
    read_j = 5.0 * (per_rad_a * d) ** 2 * yaw.sum() * seconds
    # the mean of (1 + x)^2 for x from 0 to 1 is 7/3
    assert track.between(-np.inf, np.inf)[0] == pytest.approx(7.0 / 3.0 * read_j, rel=0.02)


def test_without_a_motor_model_nothing_is_known(record: RunRecord) -> None:
    n = summary(record)
    assert n.energy_source == "unknown"
    assert n.electrical_energy_j is None
    assert n.mechanical_cost_of_transport is None
