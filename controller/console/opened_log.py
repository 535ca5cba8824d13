"""Opens logs for commands: with progress, and a warning about missing parts."""

from pathlib import Path

from snakewalk.controller.console.messages import LOGGER
from snakewalk.controller.console.progress import ProgressBar
from snakewalk.controller.runlog.reader import read_log
from snakewalk.controller.runlog.record import RunRecord

_LONG_BYTES = 10_000_000
"""Size of a log from which a bar is shown (ours): 6 minutes of 16 servos."""


def open_log(path: Path) -> RunRecord:
    """Read a log under a bar, if it is long.

    Raises:
        InputError: it cannot be read.

    """
    if path.is_file() and path.stat().st_size > _LONG_BYTES:
        with ProgressBar(f"reading {path.name}", transient=True) as bar:
            record = read_log(path, on_progress=bar.update)
    else:
        record = read_log(path)
    if record.note:
        LOGGER.warning("%s: %s", path, record.note)
    return record
