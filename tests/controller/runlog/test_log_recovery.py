"""A killed run, a cut file, a flipped bit: what comes before the break comes back."""

import json
import os
import subprocess
import sys
import textwrap
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import Writer

from snakewalk.config.errors import InputError
from snakewalk.controller.runlog.reader import LogError, read_log
from snakewalk.controller.runlog.record import RunRecord
from snakewalk.controller.runlog.writer import RunLog, part_path
from snakewalk.drivers.errors import ChainError
from tests.controller.runlog.conftest import JOINTS, joint_state

Write = Callable[[Path, int], Path]


@pytest.fixture(scope="module")
def whole(write: Write, tmp_path_factory: pytest.TempPathFactory) -> tuple[bytes, RunRecord]:
    path = write(tmp_path_factory.mktemp("log") / "run.mcap", 220)
    return path.read_bytes(), read_log(path)


@pytest.mark.parametrize("refusal", [InputError("no"), ChainError("no answer from servo 3")])
@pytest.mark.parametrize("cycles", [0, 1])
def test_what_is_refused_before_its_first_cycle_leaves_no_log(
    refusal: InputError, cycles: int, tmp_path: Path
) -> None:
    path, angles_rad = tmp_path / "log.mcap", np.zeros(JOINTS)
    log = RunLog(path)
    log.event(0.0, "check", "who is on the bus", "warning")
    for k in range(cycles):
        log.cycle(0.1, angles_rad, angles_rad, joint_state(k), deadline_s=0.02, lateness_s=0.0)
    log.__exit__(type(refusal), refusal, None)
    assert len(list(tmp_path.iterdir())) == cycles
    assert path.exists() == bool(cycles)


@pytest.mark.costs("cuts a log at many places")
def test_cut_anywhere_gives_a_prefix_and_says_so(
    whole: tuple[bytes, RunRecord], tmp_path: Path
) -> None:
    data, full = whole
    path = tmp_path / "cut.mcap"
    sizes: list[int] = []
    for cut in (*range(0, 64), *np.linspace(64, len(data) - 1, 70).astype(int)):
        path.write_bytes(data[:cut])
        try:
            part = read_log(path)
        except LogError:
            assert not sizes, "once the start can be read, more bytes never give less"
            continue
        rows = len(part.cycle.time_s)
        assert not part.complete
        assert "cut or damaged" in part.note
        assert np.array_equal(part.cycle.asked_rad, full.cycle.asked_rad[:rows])
        assert np.array_equal(part.pose.head_m, full.pose.head_m[: len(part.pose.time_s)])
        sizes.append(rows)
    assert sizes == sorted(sizes)
    assert sizes[0] == 0
    assert sizes[-1] == 220, "only the index was cut off"
    assert len(set(sizes)) >= 5, "a chunk a second"


def holds_only(part: RunRecord, full: RunRecord) -> int:
    """Compare the rows that are left with those of the whole log; return how many are lost."""
    kept = np.isin(full.cycle.time_s, part.cycle.time_s)
    assert np.array_equal(part.cycle.time_s, full.cycle.time_s[kept])
    assert np.array_equal(part.cycle.measured_rad, full.cycle.measured_rad[kept])
    gaps = np.flatnonzero(np.diff(np.flatnonzero(~kept)) > 1)
    assert len(gaps) == 0, "the rows of one chunk"
    return int((~kept).sum())


@pytest.mark.slow
def test_a_flipped_bit_is_noticed_and_costs_the_rows_of_its_chunk(
    whole: tuple[bytes, RunRecord], tmp_path: Path
) -> None:
    data, full = whole
    path = tmp_path / "bad.mcap"
    lost = []
    for at in np.linspace(len(data) // 3, len(data) * 2 // 3, 20).astype(int):
        bad = bytearray(data)
        bad[at] ^= 0x10
        path.write_bytes(bad)
        part = read_log(path)
        lost.append(holds_only(part, full))
        assert not part.complete
        assert "damaged" in part.note
    assert max(lost) <= 60, "a chunk a second, of 220 rows at 50 Hz"
    assert sum(lost) > 0


def test_a_flipped_bit_in_the_name_of_a_later_chunks_packing_costs_that_chunk(
    whole: tuple[bytes, RunRecord], tmp_path: Path
) -> None:
    data, full = whole
    at = data.index(b"zstd", len(data) // 2)
    path = tmp_path / "bad.mcap"
    path.write_bytes(data[:at] + b"zctd" + data[at + 4 :])
    part = read_log(path)
    assert not part.complete
    assert 0 < holds_only(part, full) <= 60
    assert "1 damaged parts are left out" in part.note


@pytest.mark.parametrize(
    ("topics", "said"),
    [
        (("/joint_states", "/tf"), "of profile 'ros2' with topics /joint_states, /tf, but no log"),
        ((), "of profile 'ros2' without topics, but no log of snakewalk"),
    ],
)
def test_a_complete_mcap_of_another_program_is_named(
    topics: tuple[str, ...], said: str, tmp_path: Path
) -> None:
    path = tmp_path / "other.mcap"
    writer = Writer(str(path))
    writer.start(profile="ros2")
    for topic in topics:
        schema = writer.register_schema("sensor_msgs/msg/JointState", "ros2msg", b"float64 x")
        channel = writer.register_channel(topic, "cdr", schema)
        writer.add_message(channel, 0, b"\x00\x01\x00\x00", 0)
    writer.finish()
    with pytest.raises(LogError, match=f"is a complete MCAP {said}"):
        read_log(path)
    path.write_bytes(path.read_bytes()[:-60])
    with pytest.raises(LogError, match="ends before its header"):
        read_log(path)


@pytest.mark.slow
def test_a_killed_process_loses_less_than_a_second(tmp_path: Path) -> None:
    conftest = Path(__file__).with_name("conftest.py")
    path = tmp_path / "run.mcap"
    script = textwrap.dedent(
        f"""
        import os, runpy, signal
        from pathlib import Path
        from snakewalk.controller.runlog.writer import RunLog
        cycle = RunLog.cycle
        def until_killed(self, time_s, *args, **more):
            cycle(self, time_s, *args, **more)
            if time_s > 3.5:
                os.kill(os.getpid(), signal.SIGKILL)
        RunLog.cycle = until_killed
        runpy.run_path({str(conftest)!r})["write_log"](Path({str(path)!r}), 1000)
        """
    )
    done = subprocess.run([sys.executable, "-c", script], check=False, env=dict(os.environ))
    assert done.returncode == -9
    assert not path.exists()
    record = read_log(part_path(path))
    assert not record.complete
    assert record.cycle.time_s[-1] > 2.5
    assert record.cycle.time_s[-1] <= 3.51


def test_a_warning_is_on_the_disk_at_once(tmp_path: Path) -> None:
    log = RunLog(tmp_path / "run.mcap")
    before = part_path(log.path).stat().st_size
    log.event(0.1, "start", "torque on")
    assert part_path(log.path).stat().st_size == before
    log.event(0.2, "trip", "servo 4: overload", level="error")
    assert part_path(log.path).stat().st_size > before
    log.__exit__(None, None, None)


def test_an_event_steers_no_terminal_that_shows_the_log(tmp_path: Path) -> None:
    rows: list[bytes] = []
    with RunLog(tmp_path / "run.mcap", lambda topic, row: rows.append(row)) as log:
        log.event(0.1, "map", "robot \x1b[2J\u202etxt.exe")
    assert [json.loads(row)["text"] for row in rows] == ["robot ?[2J?txt.exe"]


def test_a_log_whose_folder_is_deleted_is_reported_at_once_and_written_again(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path, angles_rad = tmp_path / "run" / "log.mcap", np.zeros(JOINTS)
    with RunLog(path) as log:
        for k in range(100):
            if k == 30:
                part_path(path).unlink()
                path.parent.rmdir()
            time_s = 0.02 * k
            log.cycle(time_s, angles_rad, angles_rad, joint_state(k), deadline_s=0.02, lateness_s=0)
            if k < 30:
                assert not caplog.records
        (warning,) = caplog.records
        assert "was deleted during the run; it is kept open" in warning.getMessage()
    with path.open("rb") as file:
        rows = [channel.topic for _, channel, _ in make_reader(file).iter_messages()]
    assert rows.count("/cycle") == 100


def test_a_log_whose_folder_is_moved_is_reported_and_takes_no_file_of_another_run(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path, angles_rad = tmp_path / "run" / "log.mcap", np.zeros(JOINTS)
    with RunLog(path) as log:
        for k in range(100):
            if k == 30:
                path.parent.rename(tmp_path / "moved")
                path.parent.mkdir()
                part_path(path).write_bytes(b"of another run")
            time_s = 0.02 * k
            log.cycle(time_s, angles_rad, angles_rad, joint_state(k), deadline_s=0.02, lateness_s=0)
        (warning,) = caplog.records
        assert "was moved during the run; it is kept open" in warning.getMessage()
    with path.open("rb") as file:
        rows = [channel.topic for _, channel, _ in make_reader(file).iter_messages()]
    assert rows.count("/cycle") == 100
