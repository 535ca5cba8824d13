"""A run of a command: result folder, bar, pace, observers, and the question whether to go on."""

import sys
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, ExitStack
from math import inf

import typer

from snakewalk.controller.console.progress import PathBar, TimeBar, in_real_time
from snakewalk.controller.console.result_files import run_folder
from snakewalk.controller.console.run_options import RunOptions
from snakewalk.controller.run.observers import Observers, open_observers
from snakewalk.controller.run.prepared_run import HasWaypoints, PreparedRun
from snakewalk.controller.run.request import RunRequest, RunResult
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.runlog.writer import PartLimits


def observers_of(
    options: RunOptions, observe: Sequence[str] | None = None, *, live: bool = False
) -> AbstractContextManager[Observers]:
    """Open the observers that the options name, and ``observe``: ``NAME[:ARGUMENT]``."""
    return open_observers(options.view, options.view_at, options.ros, observe, live=live)


def run_for_user(
    prepared: PreparedRun,
    name: str,
    options: RunOptions,
    *,
    bar: PathBar | TimeBar | None = None,
    observers: AbstractContextManager[Observers] | None = None,
    live: bool = False,
    shadow: bool = False,
    stop_requested: Callable[[], str | None] | None = None,
) -> RunResult:
    """Run with a progress bar; an observed or operated simulation runs in real time.

    Args:
        prepared: the motion.
        name: of the folder below ``runs``, without ``--out``.
        options: of the command.
        bar: shows the progress; default: along the path, or up to the time limit.
        observers: opens the observers of the run; default: those that the options name.
        live: whether page and ROS node command the waypoints.
        shadow: whether a simulated chain follows the same goals.
        stop_requested: asks an operator, whom the terminal is left to.

    Raises:
        InputError: as ``run_robot``; or the folder cannot be made.

    """
    if bar is None:
        bar = (
            PathBar(prepared.path_length_m())
            if isinstance(prepared, HasWaypoints)
            else TimeBar(prepared.run.name, prepared.run.time_limit_s)
        )
    with ExitStack() as opened_parts:
        watching = opened_parts.enter_context(observers or observers_of(options))
        folder = opened_parts.enter_context(run_folder(name, options.out))
        opened_parts.enter_context(bar)
        if live and watching.page is not None:
            watching.page.on_course()
        is_paced = (watching or stop_requested is not None) and not options.port
        can_ask = stop_requested is None and sys.stdin.isatty()
        result = run_robot(
            RunRequest(
                prepared,
                folder,
                options.port,
                overwrite=options.force,
                log_limits=PartLimits(options.part_mb or inf, options.part_minutes or inf),
                shadow=shadow,
                observers=watching,
                confirm=_confirm if can_ask else None,
                stop_requested=stop_requested or (lambda: None),
                waypoint_commands=watching.waypoint_commands if live else None,
                on_progress=in_real_time(bar.on_progress) if is_paced else bar.on_progress,
                on_event=bar.on_event,
            )
        )
        with result.ending.noted():  # the observers need up to seconds to close
            opened_parts.close()
        return result


def _confirm(question: str) -> bool:
    """Ask whether an interrupted chain may continue; the servos hold meanwhile."""
    return typer.confirm(f"{question}; go on?", err=True)
