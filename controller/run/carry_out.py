"""Execution of a prepared run with the options of a command."""

from collections.abc import Callable, Iterable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import NamedTuple

from snakewalk.controller.console.progress import PathBar, TimeBar, in_real_time
from snakewalk.controller.console.result_files import run_folder
from snakewalk.controller.console.run_options import RunOptions
from snakewalk.controller.motion.command import Refused
from snakewalk.controller.run.execute import Finished, execute
from snakewalk.controller.run.prepared_run import PreparedRun
from snakewalk.controller.run.watchers import Watchers, watched


class Carried(NamedTuple):
    """A finished run, and the folder of its results."""

    finished: Finished
    folder: Path


def watched_by(
    options: RunOptions, *others: str, live: bool = False
) -> AbstractContextManager[Watchers | None]:
    """Open the observers that the options name, and ``others``: ``NAME[:ARGUMENT]``."""
    return watched(options.view, options.view_at, options.ros, others, live=live)


def carry_out(
    prepared: PreparedRun,
    name: str,
    bar: PathBar | TimeBar,
    options: RunOptions,
    watchers: Watchers | None,
    *,
    shadow: bool = False,
    is_operated: bool = False,
    confirm: Callable[[str], bool] | None = None,
    stop_requested: Callable[[], str | None] = lambda: None,
    waypoint_commands: Callable[[], Iterable[str | Refused]] | None = None,
) -> Carried:
    """Execute a run with a progress bar; a watched or operated simulation runs in real time.

    Raises:
        InputError: as ``execute``, or the folder cannot be made.

    """
    paced = (watchers is not None or is_operated) and not options.port
    with run_folder(name, options.out) as folder, bar:
        finished = execute(
            prepared,
            folder,
            options.port,
            force=options.force,
            view=watchers,
            shadow=shadow,
            confirm=confirm,
            stop_requested=stop_requested,
            waypoint_commands=waypoint_commands,
            on_progress=in_real_time(bar.on_progress) if paced else bar.on_progress,
            on_event=bar.on_event,
        )
    return Carried(finished, folder)
