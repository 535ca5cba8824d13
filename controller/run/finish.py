"""End of a command with a run: report, film and printed result."""

import platform
import shlex
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Final

from snakewalk.controller.console.messages import LOGGER
from snakewalk.controller.console.options import show
from snakewalk.controller.console.plugins import require
from snakewalk.controller.console.result_files import locked_folder
from snakewalk.controller.console.shared_text import without_folders
from snakewalk.controller.metrics.summary import RunSummary
from snakewalk.controller.run.execute import Finished
from snakewalk.controller.runlog.record import RunRecord


@dataclass(frozen=True, slots=True)
class Artifacts:
    """Files of a run next to its log; ``notes`` has the reasons for missing ones."""

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


def _what_made_it(folders: bool) -> str:
    given = sys.argv[1:] if folders else [without_folders(word) for word in sys.argv[1:]]
    words = shlex.join(["snakewalk", *given])
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
    folders: bool = False,
) -> Artifacts:
    """Make report and film of a run; print on standard error why a file is missing.

    ``folders`` shows the folders of the user's files in the report.

    Raises:
        InputError: another run uses the folder.

    """
    what = _what_made_it(folders)
    folder.mkdir(parents=True, exist_ok=True)
    with locked_folder(folder):
        made: Artifacts = require("results", "report", "--film").load()(
            record, folder, numbers, film=film, fine=fine, look=look, made=what, folders=folders
        )
    for line in made.notes:
        LOGGER.warning("%s", line)
    return made


def show_run(
    finished: Finished, folder: Path, facts: Mapping[str, object], as_json: bool, *, film: bool
) -> None:
    """Make report and film, and print facts and files; exit 1 if safety tripped."""
    files = {"log": str(finished.log), "summary": str(folder / "summary.json")}
    evidence = finished.summary.evidence
    with finished.ending.noted():
        artifacts = write_artifacts(finished.record, folder, finished.summary, film=film)
        show({**facts, **evidence, **files, **artifacts.to_dict()}, as_json)
    if finished.outcome.tripped is not None:
        raise SystemExit(1)


NOT_MEASURED: Final = 3
"""Exit code: finished as planned, arrival not measured."""


def by_evidence(finished: Finished, values: Mapping[str, object]) -> dict[str, object]:
    """Return values that need a measured pose, and its evidence.

    Otherwise they are None, each with a counterpart ``dead_reckoned_*``.
    """
    numbers = finished.summary
    if numbers.is_measured:
        return {**values, **numbers.evidence}
    believed = {f"dead_reckoned_{key}": value for key, value in values.items()}
    return {**dict.fromkeys(values), **believed, **numbers.evidence}


def summarized(numbers: RunSummary, *keys: str) -> dict[str, object]:
    """Return numbers that need a measured pose, or their ``dead_reckoned_*``."""
    believed = () if numbers.is_measured else tuple(f"dead_reckoned_{key}" for key in keys)
    return {key: getattr(numbers, key) for key in (*keys, *believed)}


def exit_code(finished: Finished, accept_dead_reckoning: bool) -> int:
    """Return the exit code of a run along waypoints.

    Returns:
        0: every waypoint was reached; 1: one was missed, or safety tripped; 3: the run ended as
            planned, but dead reckoning gave its pose.

    """
    outcome = finished.outcome
    if not outcome.complete:
        return 1
    if outcome.waypoints and not finished.summary.is_measured and not accept_dead_reckoning:
        return NOT_MEASURED
    return 0
