"""A log that continues in parts is read as one; each part can be read alone."""

from collections.abc import Callable
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from snakewalk.controller.console.result_files import clear_run, refuse_another_run
from snakewalk.controller.metrics.summary import summary
from snakewalk.controller.runlog.column import Table
from snakewalk.controller.runlog.reader import LogError, read_log
from snakewalk.controller.runlog.topics import SlowTable
from snakewalk.controller.runlog.writer import PartLimits, part_path

Write = Callable[..., Path]
HALF_SECOND = PartLimits(minutes=0.5 / 60.0)
"""Twenty-five cycles of the log."""


def files(folder: Path) -> list[str]:
    return sorted(file.name for file in folder.iterdir())


@pytest.fixture
def parted(write: Write, tmp_path: Path) -> Path:
    return write(tmp_path / "parts" / "log.mcap", 120, HALF_SECOND)


def test_parts_are_read_as_one_log(write: Write, parted: Path, tmp_path: Path) -> None:
    names = ["log.mcap", *(f"log.part{k}.mcap" for k in range(2, 6))]
    assert files(parted.parent) == names
    expected = read_log(write(tmp_path / "log.mcap", 120))
    joined = read_log(parted)
    assert joined.complete
    assert not joined.note
    assert joined.events == expected.events
    for (a_s, a_m), (b_s, b_m) in zip(joined.paths, expected.paths, strict=True):
        assert a_s == b_s
        assert np.array_equal(a_m, b_m)
    for entry in fields(expected):
        table = getattr(expected, entry.name)
        if not isinstance(table, Table) or isinstance(table, SlowTable):
            continue  # a part repeats the slow values, which a log states when they change
        for name in table.topic.columns:
            values = getattr(getattr(joined, entry.name), name)
            if isinstance(values, np.ndarray):
                np.testing.assert_array_equal(values, getattr(table, name))
            else:
                assert values == getattr(table, name)
    assert summary(joined).to_dict() == summary(expected).to_dict()


def test_one_bar_shows_how_much_of_all_parts_is_read(parted: Path) -> None:
    shown: list[tuple[float, float]] = []
    read_log(parted, on_progress=lambda done, total: shown.append((done, total)))
    sizes = [parted.with_name(name).stat().st_size for name in sorted(files(parted.parent))]
    done = [bytes_read for bytes_read, _ in shown]
    assert {total for _, total in shown} == {sum(sizes)}
    assert done == sorted(done)
    assert sum(sizes[:-1]) < done[-1] <= sum(sizes)


def test_a_part_is_a_log_with_configuration_start_path_and_slow_values(parted: Path) -> None:
    last = read_log(parted.with_name("log.part5.mcap"))
    assert last.complete
    assert len(last.cycle.time_s) == 20
    assert [(event.time_s, event.kind) for event in last.events] == [(0.0, "start")]
    assert np.isfinite(last.slow.temperature_c[0]).all()
    third = read_log(parted.with_name("log.part3.mcap"))
    assert 24 <= len(third.cycle.time_s) <= 26
    assert third.header.config_hash == last.header.config_hash


def test_a_size_begins_a_part_too(write: Write, tmp_path: Path) -> None:
    path = write(tmp_path / "log.mcap", 120, PartLimits(size_mb=0.02))
    assert len(files(tmp_path)) > 2
    assert len(read_log(path).cycle.time_s) == 120


def test_the_part_of_a_killed_run_is_read_and_a_lost_part_is_named(parted: Path) -> None:
    last = parted.with_name("log.part5.mcap")
    last.rename(part_path(last))
    assert len(read_log(parted).cycle.time_s) == 120
    parted.with_name("log.part3.mcap").unlink()
    record = read_log(parted)
    assert "its parts 3 are missing" in record.note
    assert len(record.cycle.time_s) == 120 - len(range(25, 50))


def test_a_part_of_another_run_is_rejected(parted: Path) -> None:
    stranger = parted.with_name("log.part6.mcap")
    stranger.write_bytes((Path(__file__).parent / "logs/three-joints-0.1.mcap").read_bytes())
    with pytest.raises(LogError, match=r"log\.part6\.mcap: is of another run; move it"):
        read_log(parted)


def test_a_new_run_deletes_the_parts_of_the_old_one(parted: Path) -> None:
    refuse_another_run(parted.parent, force=True)
    clear_run(parted.parent)
    assert files(parted.parent) == []
