"""Tables read back: every number and every unknown, by readers that are not ours."""

import csv
from pathlib import Path

import numpy as np
import pytest

from snakewalk.controller.exchange.flat_table import flat_tables, write_csv, write_parquet
from snakewalk.controller.runlog.record import RunRecord
from snakewalk.controller.runlog.topics import TABLES

UNITS = ("_rad", "_rad_s", "_a", "_ah", "_s", "_m", "_m_s", "_c", "_v", "_j")
UNITLESS = {
    "fault",
    "sequence",
    "is_confirmed",
    *("pose_evidence", "pose_source"),
    *("verdict", "reason", "joints", "target", "level", "kind", "text", "number", "key", "value"),
    *("state", "visited", "candidates", "eta_q", "along", "across"),
    *(f"{of}_95_{bound}" for of in ("along", "across") for bound in ("low", "high")),
    *(f"qpos{k}" for k in range(23)),
    *(f"rotation_{i}{j}" for i in range(3) for j in range(3)),
}


def test_csv_gives_every_number_back(record: RunRecord, tmp_path: Path) -> None:
    for table in flat_tables(record):
        assert write_csv(table, tmp_path / "t.csv") == table.row_count
        with (tmp_path / "t.csv").open(encoding="utf-8", newline="") as file:
            names, *rows = csv.reader(file)
        assert names == list(table.columns)
        assert names[0] == "time_s"
        assert len(rows) == table.row_count
        for name, texts in zip(names, zip(*rows, strict=True), strict=True):
            cells = np.asarray(table.columns[name])
            if cells.dtype.kind == "f":
                np.testing.assert_array_equal([float(t or "nan") for t in texts], cells)
            else:
                assert [t.lower() for t in texts] == [str(c).lower() for c in cells]


def test_parquet_gives_every_number_back(record: RunRecord, tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    for table in flat_tables(record):
        write_parquet(table, tmp_path / "t.parquet")
        back = parquet.read_table(tmp_path / "t.parquet")
        assert back.column_names == list(table.columns)
        for name, cells in table.columns.items():
            values = np.asarray(cells)
            if values.dtype.kind == "f":
                column = back[name]
                assert column.null_count == np.isnan(values).sum()  # unknown is null
                np.testing.assert_array_equal(column.to_numpy(), values)
            else:
                assert back[name].to_pylist() == values.tolist()


def test_units_stand_in_the_names(record: RunRecord) -> None:
    tables = {table.name: table for table in flat_tables(record)}
    assert set(tables) == {table.topic.table_name for table in TABLES}
    columns = [name for table in tables.values() for name in table.columns]
    names = record.header.robot.joint_names
    flags = [f"{of}_{name}" for of in ("valid", "error", "hardware_error") for name in names]
    assert {c for c in columns if not c.endswith(UNITS)} == UNITLESS | set(flags)
    np.testing.assert_array_equal(
        tables["cycle"].columns["measured_yaw_03_rad"], record.cycle.measured_rad[:, 2]
    )
    np.testing.assert_array_equal(
        tables["imu"].columns["rate_z_rad_s"], record.imu.rate_rad_s[:, 2]
    )
    path = tables["path"].columns
    np.testing.assert_array_equal(path["time_s"], [0.0, 0.0, 0.2, 0.2])
    np.testing.assert_array_equal(path["point_z_m"], [np.nan, np.nan, 0.5, 0.4])
    waypoints = tables["waypoints"].columns
    np.testing.assert_array_equal(waypoints["time_s"], [0.0, 0.2, 0.2])
    np.testing.assert_array_equal(waypoints["number"], [1, 1, 2])
    np.testing.assert_array_equal(waypoints["point_y_m"], [1.0, 1.0, 3.0])
    np.testing.assert_array_equal(
        tables["shadow"].columns["current_yaw_05_a"], record.shadow.current_a[:, 4]
    )
