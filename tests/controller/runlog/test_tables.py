"""Rows become tables: types, shapes and unknown numbers, also of a log in many parts."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader

from snakewalk.controller.runlog.column import ROWS, StoredColumn
from snakewalk.controller.runlog.evidence import Kind
from snakewalk.controller.runlog.record import RunRecord
from snakewalk.controller.runlog.tables import RowPacker, record_of, table_of
from snakewalk.controller.runlog.topics import (
    ConfigTable,
    CycleTable,
    EventTable,
    PathTable,
    PoseSourceTable,
    PoseTable,
    QposTable,
    WalkTable,
    WaypointTable,
)

Row = dict[str, Any]
Rows = dict[str, list[Row]]
JOINTS = 16
SIZES = {"joint": JOINTS, "link": JOINTS + 1}
PARTS = 16
"""Parts of a table after which they are joined in files."""


@pytest.fixture(scope="module")
def written(write: Callable[[Path, int], Path], tmp_path_factory: pytest.TempPathFactory) -> Rows:
    """Rows of a short log, by topic."""
    path = write(tmp_path_factory.mktemp("log") / "run.mcap", 3)
    rows: Rows = {}
    with path.open("rb") as stream:
        for _, channel, message in make_reader(stream).iter_messages():
            rows.setdefault(channel.topic, []).append(json.loads(message.data))
    return rows


def walked(time_s: float, **values: float) -> Row:
    row = {"state": 3, "visited": 1, "heading_error_rad": None, "ramp_rad": 0.5, "candidates": 2}
    return {"time_s": time_s, **row, **values}


def test_cells_have_the_types_and_shapes_of_their_columns(written: Rows) -> None:
    cycles = written[CycleTable.topic.name]
    table = table_of(CycleTable, cycles, SIZES)
    assert table.time_s.tolist() == [row["time_s"] for row in cycles]
    assert (table.error.dtype, table.valid.dtype) == (np.int64, np.bool_)
    np.testing.assert_array_equal(table.asked_rad, [row["asked_rad"] for row in cycles])
    assert table.joints == ((1, 5), (), ())
    assert table.verdict == ("clamp", "pass", "pass")
    poses = table_of(PoseTable, written[PoseTable.topic.name], SIZES)
    assert poses.rotation.shape == (3, 3, 3)
    walks = table_of(WalkTable, [walked(0.0), walked(1.0, heading_error_rad=0.25)], SIZES)
    np.testing.assert_array_equal(walks.heading_error_rad, [np.nan, 0.25])
    assert walks.state.dtype == np.int64
    for kind in (CycleTable, PoseTable, WalkTable, QposTable, EventTable, PathTable):
        assert len(table_of(kind, [], SIZES).time_s) == 0
    assert table_of(CycleTable, [], SIZES).sent_rad.shape == (0, JOINTS)
    assert table_of(PoseTable, [], SIZES).links_m.shape == (0, JOINTS + 1, 3)


def test_a_field_without_a_value_has_its_default_and_must_have_one(written: Rows) -> None:
    first, *others = written[CycleTable.topic.name]
    partly = {name: value for name, value in first.items() if name != "yield_rad"}
    table = table_of(CycleTable, [partly, {**first, "yield_rad": [0.5] * JOINTS}], SIZES)
    np.testing.assert_array_equal(table.yield_rad, [[np.nan] * JOINTS, [0.5] * JOINTS])
    del partly["sent_rad"]
    with pytest.raises(KeyError, match="sent_rad"):
        table_of(CycleTable, [*others, partly], SIZES)
    sources = table_of(PoseSourceTable, [{"time_s": 0.5, "latency_s": 0.1}], SIZES)
    assert (sources.fault, sources.sequence.tolist()) == (("",), [-1])
    assert np.isnan(sources.age_s).all()


def test_points_have_as_many_coordinates_as_their_column_says() -> None:
    rows = [{"time_s": 0.0, "waypoints_m": []}, {"time_s": 1.0, "waypoints_m": [[1.0, 2.0]]}]
    none, one = table_of(WaypointTable, rows, SIZES).waypoints_m
    assert none.shape == (0, 2)
    assert one.tolist() == [[1.0, 2.0]]
    (path,) = table_of(PathTable, [{"time_s": 0.0, "points_m": [[1, 2, 3]]}], SIZES).points_m
    assert path.tolist() == [[1.0, 2.0, 3.0]]
    qpos = table_of(QposTable, [{"time_s": 0.0, "qpos": [1, None, 3]}] * 2, SIZES).qpos
    np.testing.assert_array_equal(qpos, [[1.0, np.nan, 3.0]] * 2)


def test_rows_are_packed_when_there_are_many_after_that_of_the_configuration(
    written: Rows, tmp_path: Path
) -> None:
    name = WalkTable.topic.name
    packer = RowPacker(tmp_path)
    rows: Rows = {ConfigTable.topic.name: [], name: [walked(k) for k in range(ROWS)], "/x": []}
    packer.pack(name, rows)
    assert (len(rows[name]), packer.parts) == (ROWS, {}), "nothing says how many joints there are"
    rows[ConfigTable.topic.name] = written[ConfigTable.topic.name]
    last = rows[name].pop()
    packer.pack(name, rows)
    assert (len(rows[name]), packer.parts) == (ROWS - 1, {})
    rows[name].append(last)
    packer.pack(name, rows)
    (part,) = packer.parts[WalkTable]
    assert rows[name] == []
    assert part.time_s.tolist() == [*range(ROWS)]
    rows["/x"] = [{}] * ROWS
    packer.pack("/x", rows)
    rows[name] = [walked(k) for k in range(ROWS - 1)] + [{"time_s": 0.0}]
    packer.pack(name, rows)
    assert (len(rows["/x"]), len(rows[name])) == (ROWS, ROWS), "rows of another version stay"
    assert [*packer.parts] == [WalkTable]
    assert len(packer.parts[WalkTable]) == 1


def test_a_record_of_many_parts_is_that_of_all_rows(written: Rows, tmp_path: Path) -> None:
    """The parts are joined in files when there are sixteen; texts and points stay in memory."""
    packer = RowPacker(tmp_path)
    name = WalkTable.topic.name
    rows: Rows = {**written, name: []}
    count = (PARTS + 1) * ROWS + 5
    for k in range(count):
        rows[name].append(walked(0.5 * k, state=k % 7))
        packer.pack(name, rows)
    stored, packed = (part.stored_columns()["time_s"] for part in packer.parts[WalkTable])
    assert isinstance(stored, StoredColumn)
    assert isinstance(packed, np.ndarray)
    assert len(stored.mapped()) == PARTS * ROWS
    events = [{"time_s": float(k), "level": "info", "kind": "x", "text": f"{k}"} for k in range(5)]
    paths = [{"time_s": float(k), "points_m": [[k, 0.0]] * (1 + k)} for k in range(5)]
    rows |= {EventTable.topic.name: events[4:], PathTable.topic.name: []}
    parts = {
        **packer.parts,
        EventTable: [table_of(EventTable, events[k : k + 2], SIZES) for k in (0, 2)],
        PathTable: [table_of(PathTable, paths[k : k + 3], SIZES) for k in (0, 3)],
    }
    record = record_of(rows, complete=True, note="", parts=parts)
    np.testing.assert_array_equal(record.walk.time_s, 0.5 * np.arange(count))
    np.testing.assert_array_equal(record.walk.state, np.arange(count) % 7)
    assert np.isnan(record.walk.heading_error_rad).all()
    assert [(event.time_s, event.text) for event in record.events] == [
        (float(k), f"{k}") for k in range(5)
    ]
    assert [(time_s, points.tolist()) for time_s, points in record.paths[1:]] == [
        (float(k), [[k, 0.0]] * (1 + k)) for k in range(5)
    ]
    assert record.cycle.verdict == tuple(row["verdict"] for row in rows[CycleTable.topic.name])


def test_a_topic_without_new_rows_is_its_parts(written: Rows) -> None:
    parts = [table_of(WalkTable, [walked(k), walked(k + 1)], SIZES) for k in (0, 2)]
    rows = {name: some for name, some in written.items() if name != WalkTable.topic.name}
    for given in (parts, parts[:1]):
        record = record_of(rows, complete=False, note="cut", parts={WalkTable: given})
        assert record.walk.time_s.tolist() == [*range(2 * len(given))]
    assert (record.complete, record.note) == (False, "cut")


def sourced(written: Rows, *confirmed: int) -> RunRecord:
    source = {"latency_s": 0.0}
    rows = [{"time_s": k, "is_confirmed": flag, **source} for k, flag in enumerate(confirmed)]
    return record_of({**written, PoseSourceTable.topic.name: rows}, complete=True, note="")


def test_a_pose_is_confirmed_as_its_source_was_in_the_end(written: Rows) -> None:
    kind = sourced(written).header.pose_evidence.kind
    assert kind is not Kind.UNCONFIRMED
    assert sourced(written, 0, 1).header.pose_evidence.kind is kind
    assert sourced(written, 1, 0).header.pose_evidence.kind is Kind.UNCONFIRMED


def test_waypoints_count_from_the_time_at_which_they_were_set(written: Rows) -> None:
    planned = record_of(written, complete=True, note="")
    first = planned.header.plan.waypoints_m.tolist()
    assert len(first) > 2
    assert [time_s for time_s, _ in planned.waypoints] == [0.0]
    far, farther = [9.0, 9.0], [9.0, 8.0]
    changes = [(3.0, [*first[:2], far]), (5.0, [*first[:2], far, farther]), (7.0, first[:1])]
    rows = [{"time_s": time_s, "waypoints_m": points} for time_s, points in changes]
    for count, set_s in ((1, [0.0, 0.0, 3.0]), (2, [0.0, 0.0, 3.0, 5.0]), (3, [0.0])):
        some = {**written, WaypointTable.topic.name: rows[:count]}
        record = record_of(some, complete=True, note="")
        plan = record.header.plan
        assert plan.waypoints_m.tolist() == changes[count - 1][1]
        assert plan.set_s.tolist() == set_s
        assert [time_s for time_s, _ in record.waypoints] == [0.0, 3.0, 5.0, 7.0][: count + 1]


def test_a_header_may_replace_the_row_of_the_configuration(written: Rows) -> None:
    header = record_of(written, complete=True, note="").header
    rows = {name: some for name, some in written.items() if name != ConfigTable.topic.name}
    assert record_of(rows, complete=True, note="", header=header).header == header
    with pytest.raises(KeyError):
        record_of(rows, complete=True, note="")
