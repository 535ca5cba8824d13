"""A replay against its original."""

import dataclasses
import json

import numpy as np
import pytest

from snakewalk.controller.metrics.comparison import compare
from snakewalk.controller.runlog.record import RunRecord


def test_a_run_equals_itself(record: RunRecord) -> None:
    result = compare(record, record)
    assert result.is_equal
    assert result.lines() == (
        "1497 cycles against 1497: the replay is the same to the last digit of the log",
    )


@pytest.mark.parametrize("name", ["asked_rad", "sent_rad", "measured_rad", "current_a"])
def test_the_first_time_and_joint_are_named(record: RunRecord, name: str) -> None:
    values = getattr(record.cycle, name).copy()
    values[700, 11] += 0.002
    values[900, 2] -= 0.5
    changed = dataclasses.replace(record.cycle, **{name: values})
    result = compare(record, dataclasses.replace(record, cycle=changed))
    bad = [d for d in result.differences if not d.is_equal]
    assert not result.is_equal
    assert [d.name for d in bad] == [name]
    assert bad[0].first_s == record.cycle.deadline_s[700]
    assert bad[0].first_column == 11
    assert bad[0].largest == pytest.approx(0.5)
    said = result.lines()[1]
    assert said.startswith(f"{name}: differs first at {record.cycle.deadline_s[700]:.3f} s")
    assert f", {record.header.robot.joint_label(11)};" in said
    assert bad[0].first_name.startswith("joint yaw_12 (ID ")


def test_tolerance(record: RunRecord) -> None:
    nudged = dataclasses.replace(record.cycle, measured_rad=record.cycle.measured_rad + 1e-6)
    replay = dataclasses.replace(record, cycle=nudged)
    assert not compare(record, replay).is_equal
    assert compare(record, replay, tolerance=1e-5).is_equal


def test_unknown_equals_unknown_but_not_a_number(record: RunRecord) -> None:
    values = record.cycle.asked_rad.copy()
    values[3, 4] = np.nan
    hole = dataclasses.replace(record, cycle=dataclasses.replace(record.cycle, asked_rad=values))
    assert compare(hole, hole).is_equal
    result = compare(record, hole)
    assert not result.is_equal
    assert json.loads(json.dumps(result.to_dict(), allow_nan=False))["same"] is False


def test_a_shorter_replay_is_not_the_same(record: RunRecord) -> None:
    short = {f.name: getattr(record.cycle, f.name)[:1000] for f in dataclasses.fields(record.cycle)}
    replay = dataclasses.replace(record, cycle=dataclasses.replace(record.cycle, **short))
    result = compare(record, replay)
    assert not result.is_equal
    assert "1497 cycles against 1000" in result.lines()[0]
    assert all(d.is_equal for d in result.differences)
