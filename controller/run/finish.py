"""The end of a command that ran something: report, film, and what is printed."""

import platform
import shlex
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from snakewalk.controller.console.messages import LOGGER
from snakewalk.controller.console.options import show
from snakewalk.controller.console.plugins import require
from snakewalk.controller.console.result_files import LOG
from snakewalk.controller.metrics.summary import RunSummary
from snakewalk.controller.run.execute import Finished
from snakewalk.controller.runlog.record import RunRecord


@dataclass(frozen=True, slots=True)
class Artifacts:
    """Files of a run beside its log; None for what is not there, and why in ``notes``."""

    report: Path | None
    film: Path | None
    notes: tuple[str, ...]
    """One line each."""

    def to_dict(self) -> dict[str, str | None]:
        """Names of the files, for a command's answer."""
        return {
            "report": None if self.report is None else str(self.report),
            "film": None if self.film is None else str(self.film),
        }


def _what_made_it() -> str:
    """The command, the machine and the time, for the foot of a page."""
    words = shlex.join(["snakewalk", *sys.argv[1:]])
    when = datetime.now().astimezone().isoformat(" ", "seconds")
    return f"Made by {words} on {platform.node()} ({platform.machine()}), {when}."


def write_artifacts(
    record: RunRecord,
    folder: Path,
    numbers: RunSummary | None = None,
    *,
    film: bool,
    fine: bool = False,
    look: str = "servos",
) -> Artifacts:
    """Make the report and the film of a run; print on standard error what could not be made."""
    try:
        made: Artifacts = require("results", "report", "--film").load()(
            record, folder, numbers, film=film, fine=fine, look=look, made=_what_made_it()
        )
    except KeyboardInterrupt as stop:
        log = folder / LOG
        if log.exists():
            stop.add_note(f"the run is whole: {log}; its film: snakewalk report {log}")
        raise
    for line in made.notes:
        LOGGER.warning("%s", line)
    return made


def show_run(
    finished: Finished, folder: Path, facts: Mapping[str, object], as_json: bool, *, film: bool
) -> None:
    """Make the report and the film, and show a run's facts and files; exit 1 if safety tripped."""
    artifacts = write_artifacts(finished.record, folder, finished.summary, film=film)
    files = {"log": str(finished.log), "summary": str(folder / "summary.json")}
    show({**facts, **files, **artifacts.to_dict()}, as_json)
    if finished.outcome.tripped is not None:
        raise SystemExit(1)
