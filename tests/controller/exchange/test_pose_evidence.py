"""Every export states how the poses of the run are known."""

import csv
import dataclasses
from pathlib import Path

import pytest
from mcap.reader import make_reader

from snakewalk.controller.exchange.flat_table import flat_tables, write_csv, write_parquet
from snakewalk.controller.exchange.foxglove_scene import write_foxglove_scene
from snakewalk.controller.exchange.ros_bag import write_ros_bag
from snakewalk.controller.exchange.ros_messages import (
    OK,
    UNKNOWN_VARIANCE,
    WARNING,
    RosMessages,
    _variance,
)
from snakewalk.controller.runlog.evidence import SIMULATED, Kind, PoseEvidence
from snakewalk.controller.runlog.record import RunRecord

EVIDENCE = (
    SIMULATED,
    PoseEvidence(Kind.MEASURED, "udp", 0.01, 0.05),
    PoseEvidence(Kind.ESTIMATED, "tags"),
    PoseEvidence(Kind.DEAD_RECKONED, "joints"),
    PoseEvidence(Kind.DEAD_RECKONED, "imu"),
)
OF_THE_POSE = {"pose", "walk", "friction"}


@pytest.fixture(params=EVIDENCE, ids=lambda evidence: evidence.source)
def known(record: RunRecord, request: pytest.FixtureRequest) -> RunRecord:
    header = dataclasses.replace(record.header, pose_evidence=request.param)
    return dataclasses.replace(record, header=header)


def test_each_row_of_a_table_states_it(known: RunRecord, tmp_path: Path) -> None:
    evidence = known.header.pose_evidence
    for table in flat_tables(known):
        write_csv(table, tmp_path / "t.csv")
        with (tmp_path / "t.csv").open(encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
        assert ("pose_evidence" in rows[0]) == (table.name in OF_THE_POSE)
        if table.name in OF_THE_POSE:
            assert {(row["pose_evidence"], row["pose_source"]) for row in rows} == {
                (str(evidence.kind), evidence.source)
            }
            off = "" if evidence.position_m is None else str(evidence.position_m)
            assert {row["pose_position_sd_m"] for row in rows} == {off}


def test_parquet_states_it(known: RunRecord, tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    table = next(table for table in flat_tables(known) if table.name == "pose")
    write_parquet(table, tmp_path / "t.parquet")
    row = parquet.read_table(tmp_path / "t.parquet").to_pylist()[0]
    evidence = known.header.pose_evidence
    assert (row["pose_evidence"], row["pose_source"]) == (str(evidence.kind), evidence.source)
    assert row["pose_position_sd_m"] == evidence.position_m
    assert row["pose_heading_sd_rad"] == evidence.heading_rad


@pytest.mark.fast_cases(5)
@pytest.mark.parametrize("write", [write_foxglove_scene, write_ros_bag])
def test_files_for_other_programs_state_it(known: RunRecord, write: object, tmp_path: Path) -> None:
    pytest.importorskip("rosbags")
    assert callable(write)
    write(known, tmp_path / "out.mcap")
    with (tmp_path / "out.mcap").open("rb") as file:
        metadata = {one.name: one.metadata for one in make_reader(file).iter_metadata()}
    evidence = known.header.pose_evidence
    assert metadata["pose"] == evidence.texts
    assert metadata["pose"]["pose_evidence"] == str(evidence.kind)
    assert ("pose_position_sd_m" in metadata["pose"]) == (evidence.position_m is not None)


def test_a_ros_graph_is_warned_of_dead_reckoning(known: RunRecord) -> None:
    messages = RosMessages(lambda kind, fields: dict(fields), list)
    status = messages.pose_status(known.header)
    evidence = known.header.pose_evidence
    assert status["level"] == (OK if evidence.is_measured else WARNING)
    assert {one["key"]: one["value"] for one in status["values"]} == evidence.texts
    diagnostics = [row for row in messages.rows(known) if row.topic == "/diagnostics"]
    assert diagnostics
    assert all(row.message["status"][0] == status for row in diagnostics)


@pytest.mark.parametrize("unknown", [None, float("nan")])
def test_an_unknown_deviation_is_a_large_variance(unknown: float | None) -> None:
    """A camera has no uncertainty before its first frame; NaN would void the message."""
    assert _variance(unknown) == UNKNOWN_VARIANCE
    assert _variance(0.1) == pytest.approx(0.01)
