"""A page of a run that tripped begins with the trip, and its curves with the tripped joint."""

import base64
import gzip
import json
import re
from dataclasses import replace

import numpy as np
import pytest

from snakewalk.controller.metrics.summary import summary
from snakewalk.controller.report.curves import curves_html
from snakewalk.controller.report.page import Drawings, page
from snakewalk.controller.report.trip import trip_of
from snakewalk.controller.runlog.record import Event, RunRecord
from snakewalk.drivers.safety.limits import SafetyLimits

JOINT, OTHER = 9, 3


@pytest.fixture(scope="module")
def tripped(record: RunRecord) -> RunRecord:
    """A run whose servo 10 draws 3 A at its end."""
    robot = record.header.robot
    label, other = robot.joint_label(JOINT), robot.joint_label(OTHER)
    current_a, valid = record.cycle.current_a.copy(), record.cycle.valid.copy()
    current_a[-5:, JOINT], valid[-5:, JOINT] = -3.0, True
    trip = Event(29.5, "error", "trip", f"{label}: -3.00 A for too long (then {other}: no reply)")
    return replace(
        record,
        cycle=replace(record.cycle, current_a=current_a, valid=valid),
        events=(*record.events, trip),
    )


def test_the_joint_and_the_exceeded_limit_are_those_of_the_trip(tripped: RunRecord) -> None:
    trip = trip_of(tripped)
    assert trip is not None
    assert (trip.time_s, trip.joint) == (29.5, JOINT)
    (over,) = [value for value in trip.values if value.is_exceeded]
    limit_a = SafetyLimits.from_config(
        tripped.header.robot, tripped.header.run.safety
    ).current_limit_a
    assert (over.name, over.value) == ("current", "3 A")
    assert over.limit == f"at most {limit_a:.3g} A for 0.5 s"


def test_a_value_that_was_not_read_is_left_out(tripped: RunRecord) -> None:
    cycle, slow = tripped.cycle, tripped.slow
    unread = replace(
        tripped,
        cycle=replace(cycle, valid=np.zeros_like(cycle.valid)),
        slow=replace(slow, voltage_v=np.full_like(slow.voltage_v, np.nan)),
    )
    trip = trip_of(unread)
    assert trip is not None
    assert [value.name for value in trip.values] == ["temperature"]


def test_a_trip_of_no_joint_has_time_and_reason_alone(record: RunRecord) -> None:
    stop = Event(3.0, "error", "trip", "stop requested")
    trip = trip_of(replace(record, events=(stop,)))
    assert trip is not None
    assert (trip.joint, trip.values, trip.reason) == (None, (), "stop requested")
    assert trip_of(record) is None


def test_the_page_states_the_trip_above_its_numbers(tripped: RunRecord) -> None:
    label = tripped.header.robot.joint_label(JOINT)
    numbers = summary(tripped)
    html = page(tripped, numbers, Drawings([]))
    head = html[html.index("<body>") : html.index("<section class='tiles'>")]
    assert f"Trip at <button data-time='29.500'>29.50 s</button>: {label}</h2>" in head
    assert "<tr class='error'><td>current</td><td>3 A, exceeded</td>" in head
    assert "Trip at" not in page(replace(tripped, events=()), numbers, Drawings([]))


@pytest.mark.parametrize("is_tripped", [True, False])
def test_the_curves_open_on_the_tripped_joint(
    record: RunRecord, tripped: RunRecord, is_tripped: bool
) -> None:
    run, joint = (tripped, JOINT) if is_tripped else (record, 0)
    html = curves_html(run)
    assert re.findall(r"<option value='(\d+)' selected>", html) == [str(joint)]
    packed = re.search("<script id='curves-data' type='text/plain'>([^<]*)</script>", html)
    assert packed is not None
    spec = json.loads(gzip.decompress(base64.b64decode(packed[1])))
    assert [trace["y"] for trace in spec["traces"][-4:]] == spec["joints"][joint]
    assert spec["mark_s"] == (29.5 if is_tripped else 0.0)
