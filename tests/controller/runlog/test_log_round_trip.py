"""What goes into the log comes out of it."""

import errno
import json
import os
import resource
import tracemalloc
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader

from snakewalk.config import archive
from snakewalk.config.errors import InputError
from snakewalk.config.loader import digest, load_robot, load_run, load_world
from snakewalk.controller.runlog import column, reader
from snakewalk.controller.runlog.column import StoredColumn, Table
from snakewalk.controller.runlog.evidence import SIMULATED
from snakewalk.controller.runlog.reader import LogError, read_log
from snakewalk.controller.runlog.record import Header, PlanSummary, Winding
from snakewalk.controller.runlog.tables import record_of
from snakewalk.controller.runlog.topics import TABLES, WaypointTable
from snakewalk.controller.runlog.writer import RunLog, part_path
from snakewalk.drivers.types import JointState
from tests.helpers.long_log import pack_early, repeat_log

Write = Callable[[Path, int], Path]


def test_every_table_comes_back(
    write: Write, state_of: Callable[[int], JointState], tmp_path: Path
) -> None:
    record = read_log(write(tmp_path / "run.mcap", 120))
    assert record.complete
    assert record.note == ""
    cycle = record.cycle
    k = np.arange(120)
    asked = np.sin(np.arange(16)[None] + 0.02 * k[:, None]) / 3.0
    assert np.array_equal(cycle.asked_rad, asked), "exact, to the last digit"
    assert np.array_equal(cycle.sent_rad, np.clip(asked, -0.3, 0.3))
    for i in (0, 9, 77):
        state = state_of(i)
        np.testing.assert_allclose(cycle.measured_rad[i], state.position_rad, atol=6e-7)
        np.testing.assert_allclose(cycle.velocity_rad_s[i], state.velocity_rad_s, atol=6e-7)
        np.testing.assert_allclose(cycle.current_a[i], state.current_a, atol=6e-7)
        np.testing.assert_array_equal(cycle.valid[i], state.valid)
        np.testing.assert_allclose(cycle.age_s[i], state.age_s)
    np.testing.assert_allclose(cycle.electrical_j[1::2], 0.1 * k[1::2], atol=6e-7)
    np.testing.assert_allclose(cycle.mechanical_j[1::2], 0.02 * k[1::2], atol=6e-7)
    assert np.isnan(cycle.electrical_j[::2]).all()
    assert cycle.verdict[7] == "clamp"
    assert cycle.joints[7] == (1, 5)
    assert cycle.reason[8] == ""
    assert record.pose.links_m.shape == (120, 17, 3)
    assert np.isnan(record.pose.links_m[1::2]).all()
    assert record.pose.links_m[4, 16, 2] == pytest.approx(0.4)
    assert record.pose.rotation.shape == (120, 3, 3)
    assert np.isnan(record.pose.speed_m_s).all()
    assert record.walk.state.tolist() == [0, 40, 80]
    assert (record.friction.along.tolist(), record.friction.across.tolist()) == ([0.13], [0.56])
    assert record.friction.along_95.tolist() == [[0.11, 0.15]]
    assert record.friction.across_95.tolist() == [[0.5, 0.6]]
    assert record.qpos.qpos.shape == (3, 23)
    assert [e.kind for e in record.events] == ["start"]
    assert [t for t, _ in record.paths] == [0.0, 1.0]
    assert record.end_s == pytest.approx(119 * 0.02 + 0.004)


@pytest.mark.parametrize(("rows", "is_stored"), [(31, False), (30, True)])
def test_rows_that_are_packed_in_parts_are_the_same_rows(
    rows: int, is_stored: bool, write: Write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write(tmp_path / "run.mcap", 120)
    whole = read_log(path)
    pack_early(monkeypatch, rows)
    packed = read_log(path)
    compared = 0
    for kind in fields(whole):
        table = getattr(whole, kind.name)
        if isinstance(table, Table):
            for column in fields(table):
                mine = getattr(getattr(packed, kind.name), column.name)
                expected = getattr(table, column.name)
                if isinstance(expected, np.ndarray):
                    np.testing.assert_array_equal(mine, expected, strict=True)
                else:
                    assert mine == expected
                compared += 1
    assert compared > 60
    assert packed.events == whole.events
    columns = packed.cycle.stored_columns().values()
    assert any(isinstance(values, StoredColumn) for values in columns) == is_stored
    assert packed.from_torque_on().cycle.time_s[-1] == whole.from_torque_on().cycle.time_s[-1]


def test_a_full_disk_costs_the_rows_after_it_and_says_so(
    write: Write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A run that has ended well is read and reported even if its columns find no space."""
    path = write(tmp_path / "run.mcap", 120)
    pack_early(monkeypatch, 20)
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (8000, limits[1]))
    try:
        record = read_log(path, is_snakewalk_log=True)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert 80 <= len(record.cycle.time_s) < 120
    assert not record.complete
    assert record.note == (
        f"only its first 2 s were read: {os.strerror(errno.EFBIG)}; free space in {tmp_path}"
    )


def columns_bytes(log: Path) -> int:
    record = read_log(log)
    columns = [getattr(t, name) for t in (record.cycle, record.pose) for name in t.topic.columns]
    return sum(column.nbytes for column in columns if isinstance(column, np.ndarray))


def peak_bytes(log: Path) -> int:
    tracemalloc.start()
    try:
        read_log(log)
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def test_reading_a_longer_log_needs_hardly_more_memory(
    write: Write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pack_early(monkeypatch, 2)
    source = write(tmp_path / "run.mcap", 100)
    few = repeat_log(source, tmp_path / "few.mcap", 2, chunk_bytes=1 << 14)
    many = repeat_log(source, tmp_path / "many.mcap", 5, chunk_bytes=1 << 14)
    added_bytes = columns_bytes(many) - columns_bytes(few)
    assert peak_bytes(many) - peak_bytes(few) < 0.5 * added_bytes


def test_functions_by_rows_give_what_they_give_at_once() -> None:
    values = np.arange(3.0 * column.ROWS).reshape(-1, 3)
    stored = StoredColumn(None, values[:4])
    for part in (values[4:], values):
        stored.append(part)
    rows = np.concatenate([values, values])
    total = column.by_rows(lambda a, b: (a * b).sum(axis=1), stored.mapped()[1:], rows[:-1])
    np.testing.assert_array_equal(total, (rows[1:] * rows[:-1]).sum(axis=1))
    with pytest.raises(ValueError, match="different shapes"):
        stored.append(np.zeros((2, 4)))


def test_a_log_longer_than_other_files_may_be_is_read(
    write: Write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Only logs of other processes have a limit: a run's end must not fail because of its log."""
    path = write(tmp_path / "run.mcap", 120)
    for limit in ("FREE_BYTES", "MOST_BYTES", "MOST_TEXT_BYTES"):
        monkeypatch.setattr(archive, limit, 1000)
    assert len(read_log(path).cycle.time_s) == 120
    monkeypatch.setattr(reader, "MOST_LOG_BYTES", 1000)
    with pytest.raises(InputError, match=r"run\.mcap: its .* MB would expand to"):
        read_log(path)
    assert len(read_log(path, is_snakewalk_log=True).cycle.time_s) == 120


def test_slow_rows_only_on_change(write: Write, tmp_path: Path) -> None:
    slow = read_log(write(tmp_path / "run.mcap", 120)).slow
    assert slow.time_s.tolist() == pytest.approx([0.004, 0.504, 1.004, 2.004])
    assert np.isnan(slow.temperature_c[0]).all()
    assert slow.temperature_c[1:, 0].tolist() == [30.0, 31.0, 32.0]


def test_the_header_says_what_ran(write: Write, tmp_path: Path) -> None:
    header = read_log(write(tmp_path / "run.mcap", 1)).header
    run, robot, world = load_run("flat-square"), load_robot("yaw16"), load_world("flat")
    assert (header.run, header.robot, header.world) == (run, robot, world)
    assert header.config_hash == digest(run, robot, world)
    assert header.backend == "sim"
    assert header.winding == Winding(5.2, 2.5)
    assert header.plan.states == {"recorded": 40, "random": 160}
    assert np.isnan(header.plan.predicted_speed_m_s)
    assert header.plan.waypoints_m.shape == (4, 2)


def test_waypoints_that_were_set_on_the_way_are_the_plans(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    first = np.array([[1.0, 0.0], [2.0, 0.0]])
    with RunLog(path) as log:
        log.config(
            Header(
                load_run("flat-square"),
                load_robot("yaw16"),
                load_world("flat"),
                backend="sim",
                plan=PlanSummary(np.zeros((2, 2)), first, 0.3),
                pose_evidence=SIMULATED,
            )
        )
        log.add(WaypointTable, 1.0, waypoints_m=[*first, (3.0, 1.0)])
        log.add(WaypointTable, 2.0, waypoints_m=[first[0], (0.0, 4.0)])
        log.add(WaypointTable, 3.0, waypoints_m=np.zeros((0, 2)))
        log.add(WaypointTable, 4.0, waypoints_m=[first[0], (0.0, 4.0)])
        log.add(WaypointTable, 5.0, waypoints_m=[first[0], (0.0, 4.0), (1.0, 4.0)])
    record = read_log(path)
    np.testing.assert_array_equal(record.header.plan.waypoints_m, [[1, 0], [0, 4], [1, 4]])
    assert record.header.plan.set_s is not None
    assert record.header.plan.set_s.tolist() == [4.0, 4.0, 5.0]
    assert [since_s for since_s, _ in record.waypoints] == [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]
    np.testing.assert_array_equal(record.waypoints_at(0.9), first)
    np.testing.assert_array_equal(record.waypoints_at(1.0), [[1, 0], [2, 0], [3, 1]])
    assert record.waypoints_at(3.5).shape == (0, 2)


def test_the_ground_is_thinned_in_place(write: Write, tmp_path: Path) -> None:
    ground = read_log(write(tmp_path / "run.mcap", 1)).header.ground
    assert ground is not None
    assert ground.z_m.shape == (150, 100)
    assert ground.spacing_m == pytest.approx(0.04)
    assert ground.elevation_m(-1.0, 1.0) == pytest.approx((1.0 + 3.0) / 0.02 * 1e-3)


def test_no_rows_give_empty_tables(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    with RunLog(path) as log:
        log.config(
            Header(
                load_run("flat-square"),
                load_robot("yaw16"),
                load_world("flat"),
                backend="sim",
                plan=PlanSummary(np.zeros((2, 2)), np.zeros((1, 2)), 0.3),
                pose_evidence=SIMULATED,
            )
        )
    record = read_log(path)
    assert record.cycle.asked_rad.shape == (0, 16)
    assert record.pose.links_m.shape == (0, 17, 3)
    assert record.end_s == 0.0
    assert record.header.ground is None


def test_same_run_same_bytes(write: Write, tmp_path: Path) -> None:
    first = write(tmp_path / "a" / "run.mcap", 130).read_bytes()
    assert first == write(tmp_path / "b" / "run.mcap", 130).read_bytes()


def test_other_readers_see_schemas_and_the_injected_time(write: Write, tmp_path: Path) -> None:
    with write(tmp_path / "run.mcap", 60).open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None
        usual = {t.topic.name for t in TABLES if not t.topic.is_optional}
        assert {c.topic for c in summary.channels.values()} == usual
        for schema, channel, message in reader.iter_messages():
            assert schema is not None
            assert schema.encoding == "jsonschema"
            assert channel.message_encoding == "json"
            said = json.loads(schema.data)["properties"]
            row = json.loads(message.data, parse_constant=pytest.fail)
            assert set(row) == set(said)
            if "time_s" in row:
                assert message.log_time == round(row["time_s"] * 1e9)


def test_nan_in_a_command_is_kept_as_unknown(
    state_of: Callable[[int], JointState], tmp_path: Path
) -> None:
    asked = np.zeros(16)
    asked[2], asked[5] = np.nan, np.inf
    with RunLog(tmp_path / "run.mcap") as log:
        log.config(
            Header(
                load_run("flat-square"),
                load_robot("yaw16"),
                load_world("flat"),
                backend="sim",
                plan=PlanSummary(np.zeros((2, 2)), np.zeros((1, 2)), 0.3),
                pose_evidence=SIMULATED,
            )
        )
        log.cycle(0.0, asked, np.zeros(16), state_of(0), deadline_s=0.0, lateness_s=0.0)
    row = read_log(tmp_path / "run.mcap").cycle.asked_rad[0]
    assert np.flatnonzero(np.isnan(row)).tolist() == [2, 5]


def test_a_run_that_fails_still_closes_its_log(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"

    def fail() -> None:
        with RunLog(path) as log:
            log.event(0.0, "start", "torque on")
            assert part_path(path).is_file()
            assert not path.exists()
            raise RuntimeError("servo 4")

    with pytest.raises(RuntimeError, match="servo 4"):
        fail()
    assert not part_path(path).exists()
    assert path.is_file()


def test_reading_says_what_is_wrong(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="No such file"):
        read_log(tmp_path / "no.mcap")
    (tmp_path / "no.mcap.part").write_bytes(b"x")
    with pytest.raises(LogError, match=r"killed left .*no\.mcap\.part"):
        read_log(tmp_path / "no.mcap")
    (tmp_path / "text.mcap").write_text("a diary")
    with pytest.raises(LogError, match="not an MCAP"):
        read_log(tmp_path / "text.mcap")


def test_a_log_of_before_opens_without_energies(write: Write, tmp_path: Path) -> None:
    rows: dict[str, list[dict[str, object]]] = {t.topic.name: [] for t in TABLES}
    with write(tmp_path / "run.mcap", 5).open("rb") as stream:
        for _, channel, message in make_reader(stream).iter_messages():
            row = json.loads(message.data)
            for key in ("winding", "electrical_j", "mechanical_j"):
                row.pop(key, None)
            rows[channel.topic].append(row)
    record = record_of(rows, complete=True, note="")
    assert record.header.winding is None
    assert np.isnan(record.cycle.electrical_j).all()
    assert record.cycle.mechanical_j.shape == (5,)
