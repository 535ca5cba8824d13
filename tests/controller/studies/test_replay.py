"""A log run again: the same to the last digit, and honest about what is not."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from snakewalk.config.errors import InputError
from snakewalk.controller.cli.command_line import app
from snakewalk.controller.run.factory import prepare_walk
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.runlog.reader import read_log
from snakewalk.controller.runlog.record import RunRecord
from snakewalk.controller.studies.replay import differences, replay

TABLES = ("asked_rad", "sent_rad", "measured_rad", "velocity_rad_s", "current_a", "wire_busy_s")


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    prepared = prepare_walk(
        "flat-square", motion="serpenoid", waypoints_m=((3.0, 0.0),), time_limit_s=4
    )
    return run_robot(RunRequest(prepared, tmp_path_factory.mktemp("run"))).log


@pytest.fixture(scope="module")
def record(log: Path) -> RunRecord:
    return read_log(log)


def changed(record: RunRecord, log: Path, **fields: object) -> RunRecord:
    """Replay a record whose header differs, and read what came of it."""
    world = record.header.world.model_copy(update=fields)
    other = replace(record, header=replace(record.header, world=world))
    return read_log(replay(other, log))


def test_a_simulated_run_replays_to_the_last_digit(record: RunRecord, tmp_path: Path) -> None:
    told: list[tuple[int, int]] = []
    again = read_log(replay(record, tmp_path / "again.mcap", lambda k, n: told.append((k, n))))
    for name in TABLES:
        np.testing.assert_array_equal(getattr(again.cycle, name), getattr(record.cycle, name))
    np.testing.assert_array_equal(again.pose.head_m, record.pose.head_m)
    np.testing.assert_array_equal(again.pose.rotation, record.pose.rotation)
    np.testing.assert_array_equal(again.slow.temperature_c, record.slow.temperature_c)
    assert differences(record, again, 0.0, 0.0).identical
    rows = len(record.cycle.time_s)
    assert rows > 100
    assert told == [(k, rows) for k in range(1, rows + 1)]


def test_other_ground_is_found_out(record: RunRecord, tmp_path: Path) -> None:
    friction = record.header.world.friction.model_copy(update={"along": 0.3})
    again = changed(record, tmp_path / "log.mcap", friction=friction)
    found = differences(record, again, 0.01, 0.01)
    assert not found.is_equal
    by_name = {d.name: d for d in found.differences}
    assert by_name["sent_rad"].largest == 0.0, "what was sent is the log's"
    head = by_name["head_m"]
    assert head.first_s is not None
    assert 0.01 < head.largest < 1.0
    assert 0.0 < head.rms < head.largest
    assert by_name["current_a"].is_equal, "currents are told, not held against it"
    assert by_name["current_a"].largest > 0.0


def test_a_cut_log_replays_as_far_as_it_goes(log: Path, tmp_path: Path) -> None:
    cut = tmp_path / "cut.mcap.part"
    cut.write_bytes(log.read_bytes()[: int(0.6 * log.stat().st_size)])
    short = read_log(cut)
    assert short.note
    assert len(short.cycle.time_s) > 20
    again = read_log(replay(short, tmp_path / "again.mcap"))
    assert differences(short, again, 0.0, 0.0).identical


def test_metal_begins_where_its_joints_were(record: RunRecord, tmp_path: Path) -> None:
    bent = np.where(np.arange(record.header.robot.joint_count) % 2, 0.2, -0.2)
    still = np.tile(bent, (50, 1))
    rows = {name: getattr(record.cycle, name)[:50] for name in record.cycle.__dataclass_fields__}
    cycle = replace(record.cycle, **rows | {"sent_rad": still, "measured_rad": still})
    metal = replace(
        record,
        cycle=cycle,
        header=replace(record.header, backend="/dev/ttyUSB0", initial_pose=None),
    )
    again = read_log(replay(metal, tmp_path / "log.mcap"))
    np.testing.assert_allclose(again.cycle.measured_rad, still, atol=0.01)
    found = differences(metal, again, 0.01, 0.0)
    assert found.is_equal, (
        "where the head of metal was is reckoned, and not held against the replay"
    )


def test_a_log_without_a_cycle_is_refused(record: RunRecord, tmp_path: Path) -> None:
    rows = {name: getattr(record.cycle, name)[:0] for name in record.cycle.__dataclass_fields__}
    with pytest.raises(InputError, match="no cycle"):
        replay(replace(record, cycle=replace(record.cycle, **rows)), tmp_path / "log.mcap")


def test_the_command_says_the_same_and_exits_by_it(log: Path, tmp_path: Path) -> None:
    kept = tmp_path / "kept.mcap"
    done = CliRunner().invoke(app, ["log", "replay", str(log), "--json", "--out", str(kept)])
    assert done.exit_code == 0
    found = json.loads(done.stdout)
    assert found["identical"] is True
    assert found["differences"]["measured_rad"]["rms"] == 0.0
    assert kept.is_file()
