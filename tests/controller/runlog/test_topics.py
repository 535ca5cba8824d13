"""The table of topics: logs of before load and keep their bytes, rows have their fields."""

import json
from collections import defaultdict
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pytest
from mcap.reader import make_reader

from snakewalk.config.arrays import Floats
from snakewalk.config.units import end_of
from snakewalk.controller.runlog.column import Panel, Table, topic
from snakewalk.controller.runlog.panels import panel_curves
from snakewalk.controller.runlog.reader import read_log
from snakewalk.controller.runlog.row_printer import RowPrinter
from snakewalk.controller.runlog.topics import (
    TABLES,
    BatteryTable,
    ConfigTable,
    CycleTable,
    ImuTable,
    SlowTable,
    WalkTable,
)
from snakewalk.controller.runlog.writer import RunLog
from snakewalk.drivers.types import ImuState, JointState

OLD_LOG = Path(__file__).parent / "logs" / "three-joints-0.1.mcap"
"""Recorded by version 0.1.0 before the table of topics: a row of every topic, unknown numbers."""
Messages = dict[str, list[tuple[int, bytes]]]


def messages_of(path: Path) -> tuple[Messages, dict[str, bytes]]:
    """Times and rows by topic, and the schema of each topic."""
    rows: Messages = defaultdict(list)
    with path.open("rb") as file:
        reader = make_reader(file)
        summary = reader.get_summary()
        assert summary is not None
        schemas = {c.topic: summary.schemas[c.schema_id].data for c in summary.channels.values()}
        for _, channel, message in reader.iter_messages():
            rows[channel.topic].append((message.log_time, message.data))
    return rows, schemas


def floats(row: dict[str, Any], name: str) -> Floats:
    return np.array(row[name], dtype=float)


def state_of(cycle: dict[str, Any], slow: dict[str, Any], imu: dict[str, Any]) -> JointState:
    """State that a row of a log was written from."""
    none = np.zeros(len(cycle["age_s"]))
    return JointState(
        cycle["time_s"],
        *(floats(cycle, name) for name in ("measured_rad", "velocity_rad_s", "current_a")),
        *(floats(slow, name) for name in ("temperature_c", "voltage_v")),
        np.array(slow["hardware_error"], np.uint8),
        np.array(cycle["error"], np.uint8),
        floats(cycle, "age_s"),
        np.array(cycle["valid"], bool),
        none,
        ImuState(
            floats(imu, "rotation").reshape(3, 3), floats(imu, "rate_rad_s"), imu["age_s"], True
        ),
    )


ADDED = {"/walk": b',"carrier_rad":null', "/slow": b',"stalled_s":0.0'}
"""Fields that the old log lacks, by topic."""
REWORDED = (
    b"taken in by all motors so far; what they give back is lost",
    b"consumed by all motors so far; energy that they return is lost",
)
"""The one description of a field that has other words than in the old log."""


def _is_newer(table: type[Table]) -> bool:
    """Return whether the old log lacks the topic."""
    return table is BatteryTable or table.topic.is_optional


def unknown_as_nan(value: Any) -> Any:
    """Numbers of a JSON row, null as NaN; anything else as it is."""
    if isinstance(value, list):
        return np.array(value, dtype=float)
    return float("nan") if value is None else value


def test_a_log_of_before_is_written_again_byte_by_byte(tmp_path: Path) -> None:
    before, old_schemas = messages_of(OLD_LOG)
    parsed = {name: [json.loads(data) for _, data in rows] for name, rows in before.items()}
    with RunLog(tmp_path / "log.mcap") as log:
        for cycle, imu in zip(
            parsed[CycleTable.topic.name], parsed[ImuTable.topic.name], strict=True
        ):
            (slow,) = parsed[SlowTable.topic.name]
            values = {
                name: cycle[name]
                for name in ("deadline_s", "lateness_s", "verdict", "reason", "joints")
            }
            log.cycle(
                float(cycle["time_s"]),
                cycle["asked_rad"],
                cycle["sent_rad"],
                state_of(cycle, slow, imu),
                yield_rad=floats(cycle, "yield_rad"),
                **values,
            )
        for table in TABLES:
            if table in (ConfigTable, CycleTable, SlowTable, ImuTable) or _is_newer(table):
                continue
            for row in parsed[table.topic.name]:
                raw = ("points_m", "waypoints_m")
                values = {k: v if k in raw else unknown_as_nan(v) for k, v in row.items()}
                log.add(table, values.pop("time_s"), **values)
    now, schemas = messages_of(tmp_path / "log.mcap")
    for name in ("/config", *ADDED):  # fields may be added
        schema, old_schema = (json.loads(each.pop(name)) for each in (schemas, old_schemas))
        assert old_schema["properties"].items() <= schema["properties"].items()
    for name, added in ADDED.items():
        now[name] = [(time, data.replace(added, b"")) for time, data in now[name]]
    old_schemas = {name: each.replace(*REWORDED) for name, each in old_schemas.items()}
    assert {name: each for name, each in schemas.items() if name in old_schemas} == old_schemas
    assert set(before) == {table.topic.name for table in TABLES if not _is_newer(table)}
    del before[ConfigTable.topic.name]  # depends on the robot's and the run's fields
    assert now == before


def test_a_log_of_before_loads(tmp_path: Path) -> None:
    record = read_log(OLD_LOG)
    assert record.complete
    assert record.header.robot.servo_ids == (7, 3, 5)
    assert record.header.robot.joint_names == ("yaw_01", "pitch_02", "yaw_03")
    assert record.cycle.yield_rad[0].tolist() == [0.0, -0.25, 0.0]
    assert record.cycle.valid[2].tolist() == [True, False, True]
    assert record.cycle.joints[1] == (2,)
    assert np.isnan(record.pose.head_m[0, 1])
    assert record.walk.state.tolist() == [3]
    assert record.qpos.qpos.shape == (1, 10)
    assert len(record.paths) == len(record.waypoints) == 2
    for table in record.tables():
        assert (len(table.time_s) == 0) == _is_newer(type(table)), table.topic.name


def test_the_unit_is_the_end_of_the_name() -> None:
    assert [end_of(name) for name in ("rate_rad_s", "asked_rad", "path_s_m", "eta_q")] == [
        *("_rad_s", "_rad", "_m", "")
    ]


def test_a_row_has_the_fields_of_its_topic() -> None:
    printer = RowPrinter(WalkTable.topic)
    row = {"time_s": 0.0, "state": 1, "visited": 1, "heading_error_rad": 0.1, "ramp_rad": 0.0}
    with pytest.raises(TypeError, match=r"/walk: missing fields: \['candidates'\]"):
        printer.row(row)
    with pytest.raises(TypeError, match=r"fields that it lacks: \['gain'\]"):
        printer.row(row | {"candidates": 1, "gain": 1.0})
    with pytest.raises(TypeError, match=r"fields that it lacks: \['gain'\]"):
        printer.row(row | {"candidates": 1, "eta_q": 1.0, "gain": 1.0})
    with pytest.raises(TypeError, match=r"fields that it lacks: \['gain'\]"):
        printer.row(row | {"eta_q": 1.0, "gain": 1.0})
    assert json.loads(printer.row(row | {"candidates": 1}))["eta_q"] is None


def test_a_field_without_a_column_is_refused() -> None:
    class Bare(Table):
        time_s: Annotated[Floats, "no column"]

    with pytest.raises(TypeError, match="Annotated with one Column"):
        topic("/bare")(Bare)


def test_every_curve_has_a_field_and_a_panel_of_one_table() -> None:
    tables: dict[Panel, set[type[Table]]] = defaultdict(set)
    for table in TABLES:
        for name, column in table.topic.columns.items():
            for curve in column.curves:
                tables[curve.panel].add(table)
                assert not curve.gaps or curve.gaps in table.topic.columns, name
                assert bool(column.shape) == (bool(curve.joints) or curve.panel.is_of_one_joint)
    assert all(len(each) == 1 for each in tables.values())
    assert set(tables) == set(Panel)


def test_curves_are_those_of_the_record() -> None:
    record = read_log(OLD_LOG)
    along, across = panel_curves(record, Panel.FRICTION)
    assert (along.values.tolist(), across.values.tolist()) == ([0.13], [0.56])
    (hottest,) = panel_curves(record, Panel.HEAT)
    assert hottest.is_constant
    assert hottest.constant_text == "hottest servo 30.0 °C"
    highest, mean = panel_curves(record, Panel.CURRENT)
    assert highest.values.tolist() == pytest.approx([0.0, 0.1, 0.2, 0.3])
    assert mean.values.tolist() == pytest.approx([0.0, 0.05, 0.1, 0.15])
    (late,) = panel_curves(record, Panel.CYCLE)
    assert late.constant_text == "no cycle began late"
