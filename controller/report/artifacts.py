"""Files made from a run's record: ``summary.json``, ``film.mp4`` and ``report.html``."""

from pathlib import Path

from snakewalk.config.errors import InputError
from snakewalk.config.extras import require_extra
from snakewalk.controller.console.command import plugin
from snakewalk.controller.console.messages import LOGGER
from snakewalk.controller.console.progress import ProgressBar
from snakewalk.controller.console.result_files import (
    FILM,
    LOG,
    REPORT,
    SUMMARY,
    atomic_write,
    write_result,
)
from snakewalk.controller.metrics.summary import RunSummary, summary
from snakewalk.controller.report.film import film_run, film_times
from snakewalk.controller.report.page import Drawings, film_on_page, page
from snakewalk.controller.run.results import Artifacts, FilmChoice, film_look
from snakewalk.controller.run.run_robot import write_summary
from snakewalk.controller.runlog.record import RunRecord


@plugin("results", "report")
def make_artifacts(
    record: RunRecord,
    folder: Path,
    numbers: RunSummary | None = None,
    *,
    film: FilmChoice | None = FilmChoice(),
    made: str = "",
    folders: bool = False,
) -> Artifacts:
    """Make ``summary.json``, ``report.html`` and ``film.mp4`` in ``folder`` from a record.

    The page is written before the film and again after it; an older film of the run stays until
    then. Parts that this machine cannot make (simulator, matplotlib or OpenGL is missing) are noted
    and left out. Times count from torque on.

    Args:
        record: the run.
        folder: of the files.
        numbers: the summary of ``run_robot``; computed by default.
        film: how the film is drawn; None draws none.
        made: words at the foot of the page.
        folders: show the folders of the user's files in the page.

    """
    record = record.from_torque_on()
    notes: list[str] = []
    numbers = write_summary(summary(record) if numbers is None else numbers, folder)
    path = folder / FILM
    drawn: Drawings | None = None
    try:
        drawn = _draw(record, made)
        _write_page(record, folder, path if path.exists() else None, numbers, drawn, folders)
    except InputError as error:
        notes += [f"no report: {line}" for line in error.faults]
    if film and _film(record, path, film, notes) and drawn is not None:
        _write_page(record, folder, path, numbers, drawn, folders)
    report = None if drawn is None else folder / REPORT
    return Artifacts(report, path if path.exists() else None, tuple(notes))


def _draw(record: RunRecord, creation_text: str = "") -> Drawings:
    require_extra("the report needs", "matplotlib", "plotly")
    require_extra("the report needs", "jinja2")
    from snakewalk.controller.report.figures.sections import drawn  # noqa: PLC0415  an extra

    return Drawings(*drawn(record), creation_text)


def _write_page(
    record: RunRecord,
    out_dir: Path,
    film: Path | None,
    numbers: RunSummary,
    drawn: Drawings,
    folders: bool,
) -> Path:
    shown = None if film is None else film_on_page(film, out_dir, *film_times(record))
    html = page(
        record,
        numbers,
        drawn,
        film=shown,
        links=[name for name in (LOG, SUMMARY, FILM) if (out_dir / name).exists()],
        folders=folders,
    )
    path = out_dir / REPORT
    write_result(path, html)
    LOGGER.debug("page: %s", path)
    return path


def _film(record: RunRecord, path: Path, choice: FilmChoice, notes: list[str]) -> bool:
    with ProgressBar("film") as bar:
        try:
            with atomic_write(path) as part:
                film_run(
                    record,
                    part,
                    look=film_look(choice.look, record.header),
                    fine=choice.fine,
                    marks=choice.marks,
                    on_progress=bar.update,
                )
        except InputError as error:
            bar.hide()
            notes += [f"no film: {line}" for line in error.faults]
            return False
    LOGGER.debug("film: %s", path)
    return True
