"""What a run leaves behind beside its log: film, summary and page, made from the log alone."""

from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn

from snakewalk.config.errors import InputError
from snakewalk.controller.app.report.build import build_report
from snakewalk.controller.app.report.film import film_run
from snakewalk.controller.app.result_files import atomic_write
from snakewalk.controller.runlog.reader import read_log

FILM, REPORT = "film.mp4", "report.html"


@dataclass(frozen=True, slots=True)
class Left:
    """Files made; None for what could not be, and why in ``notes``."""

    report: Path | None
    film: Path | None
    notes: tuple[str, ...]
    """One line each."""

    def facts(self) -> dict[str, object]:
        """Names of the files, for a command's answer."""
        return {
            "report": None if self.report is None else str(self.report),
            "film": None if self.film is None else str(self.film),
        }


def leave_report(log: Path, folder: Path, *, film: bool = True, fine: bool = False) -> Left:
    """Make ``folder/film.mp4``, ``folder/summary.json`` and ``folder/report.html`` from a log.

    What this machine cannot make (no simulator, no matplotlib, no OpenGL) is noted and left out: a
    run that was made is not lost for want of its pictures. Shows progress on standard error.

    Raises:
        controller.runlog.reader.LogError: the log cannot be read.

    """
    notes: list[str] = []
    shown = _film(log, folder / FILM, fine, notes) if film else None
    report = None
    try:
        report = build_report(log, folder, shown)
    except InputError as error:
        notes += [f"no report: {line}" for line in error.faults]
    return Left(report, shown, tuple(notes))


def _film(log: Path, path: Path, fine: bool, notes: list[str]) -> Path | None:
    record = read_log(log)
    path.unlink(missing_ok=True)  # one of an earlier run would be taken for this one's
    with Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TimeElapsedColumn(),
        console=Console(stderr=True),
    ) as progress:
        task = progress.add_task("film", total=None)
        try:
            with atomic_write(path) as part:
                film_run(
                    record,
                    part,
                    fine=fine,
                    on_frame=lambda done, of: progress.update(task, completed=done, total=of),
                )
        except InputError as error:
            progress.remove_task(task)
            notes += [f"no film: {line}" for line in error.faults]
            return None
    return path
