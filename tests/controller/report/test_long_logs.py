"""Logs of any length: memory does not grow with the log, and results are the same."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Final

import numpy as np
import pytest

from snakewalk.controller.metrics.summary import summary
from snakewalk.controller.runlog.column import StoredColumn, release
from snakewalk.controller.runlog.reader import read_log
from snakewalk.controller.view.commands.demo import RECORDED
from tests.helpers.long_log import pack_early, repeat_log

SHORT: Final = Path(__file__).parents[1] / "runlog/logs/three-joints-0.1.mcap"
MOST_MB: Final = 600
_MEASURE: Final = """
import resource, sys
from snakewalk.controller.cli import main
sys.argv = ["snakewalk", *sys.argv[1:]]
try:
    main.main()
finally:
    print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, file=sys.stderr)
"""


def test_the_columns_of_a_long_log_give_the_same_summary(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    log = tmp_path / "log.mcap"
    repeat_log(SHORT, log, 20)
    expected = summary(read_log(log).from_torque_on())
    pack_early(monkeypatch, 2)
    assert summary(read_log(log).from_torque_on()).to_dict() == expected.to_dict()


def file_pages_kb() -> int:
    """Size of the pages of mapped files that are in memory."""
    status = Path("/proc/self/status").read_text(encoding="utf-8")
    return int(status.split("RssFile:")[1].split()[0])


def test_rows_of_a_stored_column_leave_the_memory_and_can_be_read_again(tmp_path: Path) -> None:
    rows = np.random.default_rng(0).normal(size=(4000, 256))  # 8 MB
    column = StoredColumn(tmp_path, rows).mapped()
    before_kb = file_pages_kb()
    assert np.array_equal(column, rows)
    assert file_pages_kb() > before_kb + 7000
    release([column.reshape(1000, -1)[:, 1]])
    assert file_pages_kb() < before_kb + 1000
    assert np.array_equal(column, rows)


@pytest.mark.nightly("reads an hour of 16 servos")
@pytest.mark.parametrize("command", ["report", "export", "compare"])
def test_an_hour_of_16_servos_needs_less_than_600_mb(command: str, tmp_path: Path) -> None:
    log = tmp_path / "log.mcap"
    repeat_log(RECORDED, log, 88)
    arguments = {
        "report": [str(log), "--no-film", "--out", str(tmp_path / "out")],
        "export": [str(log), "--csv", str(tmp_path / "csv")],
        "compare": [str(log), str(RECORDED), "--json"],
    }
    done = subprocess.run(
        [sys.executable, "-c", _MEASURE, "log", command, *arguments[command]],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
    )
    assert done.returncode == 0, done.stderr
    assert int(done.stderr.split()[-1]) / 1e3 < MOST_MB
    if command == "report":
        numbers = json.loads((tmp_path / "out/summary.json").read_text())
        assert numbers["cycles"] == 88 * 2028
