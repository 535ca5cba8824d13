"""Results of a run: report, film, and the answer of its command."""

import platform
import shlex
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from snakewalk.config.constants import LOOK
from snakewalk.controller.console.messages import LOGGER
from snakewalk.controller.console.options import show
from snakewalk.controller.console.plugins import find, require
from snakewalk.controller.console.result_files import SUMMARY, locked_folder
from snakewalk.controller.console.run_options import RunOptions
from snakewalk.controller.console.shared_text import without_folders
from snakewalk.controller.metrics.summary import RunSummary
from snakewalk.controller.metrics.verdict import RunVerdict
from snakewalk.controller.run.request import RunResult
from snakewalk.controller.runlog.record import Header, RunRecord

if TYPE_CHECKING:
    from snakewalk.sim.rendering.looks import SkinLook

ANIMAL = "animal"
"""Name of the look of the animal in the run's recording."""
_BODY = "body"
"""Plug-in of all other looks: names and files of bodies."""


class LookPlugin(Protocol):
    """A look, as a plug-in provides it."""

    def check(self, look: str) -> None:
        """Reject an impossible look before a run."""
        ...

    def make(self, look: str, header: Header) -> "SkinLook":
        """Return the skin of a run's film."""
        ...


def check_look(look: str) -> None:
    """Reject an impossible look before a run.

    Raises:
        InputError: the look does not exist, or an extra is missing.

    """
    if look != LOOK:
        _look_plugin(look).check(look)


@dataclass(frozen=True, slots=True)
class FilmChoice:
    """How the film of a run is drawn."""

    look: str = LOOK
    """Body in the film, as for ``film_look``."""
    fine: bool = False
    """Larger, smoother and slower."""
    marks: bool = True
    """Waypoints, path, contour lines, scale and caption."""


def film_look(look: str, header: Header) -> "SkinLook | None":
    """Return the skin of a run's film; None is a capsule per link.

    Raises:
        InputError: the look does not exist, or an extra is missing.

    """
    return None if look == LOOK else _look_plugin(look).make(look, header)


def _look_plugin(look: str) -> LookPlugin:
    plugin = find("look", look) or find("look", _BODY) or require("look", look, "--look", [LOOK])
    look_plugin: LookPlugin = plugin.load()()
    return look_plugin


@dataclass(frozen=True, slots=True)
class Artifacts:
    """Files of a run next to its log; ``notes`` has the reasons for missing ones."""

    report: Path | None
    film: Path | None
    notes: tuple[str, ...]
    """Reasons for missing files, one line each."""

    def to_dict(self) -> dict[str, str | None]:
        """Names of the files, for a command's answer."""
        return {
            "report": None if self.report is None else str(self.report),
            "film": None if self.film is None else str(self.film),
        }


def _origin_text(folders: bool) -> str:
    given = sys.argv[1:] if folders else [without_folders(word) for word in sys.argv[1:]]
    words = shlex.join(["snakewalk", *given])
    when = datetime.now().astimezone().isoformat(" ", "seconds")
    return f"Made by {words} on {platform.node()} ({platform.machine()}), {when}."


def write_artifacts(
    record: RunRecord,
    folder: Path,
    numbers: RunSummary | None = None,
    *,
    film: FilmChoice | None,
    folders: bool = False,
) -> Artifacts:
    """Make report and film of a run; print on standard error why a file is missing.

    ``folders`` shows the folders of the user's files in the report.

    Raises:
        InputError: another run uses the folder.

    """
    what = _origin_text(folders)
    folder.mkdir(parents=True, exist_ok=True)
    with locked_folder(folder):
        artifacts: Artifacts = require("results", "report", "--film").load()(
            record, folder, numbers, film=film, made=what, folders=folders
        )
    for line in artifacts.notes:
        LOGGER.warning("%s", line)
    return artifacts


def show_result(
    result: RunResult,
    facts: Mapping[str, object],
    options: RunOptions,
    *,
    look: str = LOOK,
    accept_dead_reckoning: bool = False,
) -> None:
    """Make report and film, and print facts and files.

    Raises:
        SystemExit: with the exit code of the run if it is not 0.

    """
    is_accepted = result.verdict.accepted(accept_dead_reckoning)
    with result.ending.noted():
        artifacts = write_artifacts(
            result.record,
            result.folder,
            result.summary,
            film=FilmChoice(look) if options.film else None,
        )
        _show(result, is_accepted, facts, artifacts, options.as_json)
    if is_accepted.exit_code:
        raise SystemExit(is_accepted.exit_code)


def _show(
    result: RunResult,
    run_verdict: RunVerdict,
    facts: Mapping[str, object],
    artifacts: Artifacts,
    as_json: bool,
) -> None:
    """Print facts, files and verdict; the last line of a table is the verdict."""
    facts = {**facts, "friction_law": result.record.header.world.friction.law_text}
    names = {"log": str(result.log), "summary": str(result.folder / SUMMARY)}
    files = {**names, **artifacts.to_dict()}
    if as_json:
        stated = {
            "verdict": run_verdict.sentence,
            "cause": run_verdict.cause,
            "exit_code": run_verdict.exit_code,
            "next_command": run_verdict.next_command,
        }
        show({**facts, **stated, **result.summary.evidence, **files}, True)
    else:
        other_facts = {
            key: value for key, value in facts.items() if key not in result.summary.evidence
        }
        show({**other_facts, "pose": run_verdict.evidence, **files}, False)
    if run_verdict.explanation:
        LOGGER.warning("%s", run_verdict.explanation)
    if not as_json:
        shown = artifacts.report or result.log
        print(f"{run_verdict.sentence}; {'report' if artifacts.report else 'log'}: {shown}")


def by_evidence(result: RunResult, values: Mapping[str, object]) -> dict[str, object]:
    """Return values that need a measured pose, and its evidence.

    Otherwise they are None, each with a counterpart ``dead_reckoned_*``.
    """
    numbers = result.summary
    if numbers.is_measured:
        return {**values, **numbers.evidence}
    believed = {f"dead_reckoned_{key}": value for key, value in values.items()}
    return {**dict.fromkeys(values), **believed, **numbers.evidence}


def run_facts(result: RunResult) -> dict[str, object]:
    """Return what every run has: robot, world, duration and trip."""
    return {
        "robot": result.prepared.robot.name,
        "world": result.prepared.world.name,
        "duration_s": round(result.outcome.duration_s, 2),
        "tripped": result.outcome.tripped,
    }


def summarized(numbers: RunSummary, *keys: str) -> dict[str, object]:
    """Return numbers that need a measured pose, or their ``dead_reckoned_*``."""
    believed = () if numbers.is_measured else tuple(f"dead_reckoned_{key}" for key in keys)
    return {key: getattr(numbers, key) for key in (*keys, *believed)}
