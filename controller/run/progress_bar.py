"""The progress bar of a run: along its path, or over its time."""

from snakewalk.controller.console.progress import PathBar, TimeBar
from snakewalk.controller.run.prepared_run import PathRun, PreparedRun


def progress_bar(prepared: PreparedRun) -> PathBar | TimeBar:
    """Return the bar that fits a run."""
    if isinstance(prepared, PathRun):
        return PathBar(prepared.path.length_m)
    return TimeBar(prepared.run.name, prepared.run.time_limit_s)
