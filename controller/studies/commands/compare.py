"""``snakewalk log compare``: several runs side by side, from their logs."""

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Column, Table

from snakewalk.config.errors import InputError
from snakewalk.controller.console.command import command
from snakewalk.controller.console.opened_log import open_log
from snakewalk.controller.console.options import Force, Json, console, labelled
from snakewalk.controller.console.result_files import check_picture
from snakewalk.controller.studies.commands.pictures import pictures
from snakewalk.controller.studies.run_comparison import compared_run, differing, flat, log_names

if TYPE_CHECKING:
    from snakewalk.controller.studies.run_comparison import ComparedRun

_HIDDEN_NUMBERS = frozenset(
    {"config_hash", "software", "outcome", "pose_evidence", "pose_source", "assumptions", "seed"}
)
"""Numbers that the verdicts or the differing settings state."""


@command(
    "log compare",
    examples=(
        "log compare runs/flat-square-walk-seed0/log.mcap runs/flat-square-walk-seed1/log.mcap",
        "log compare runs/*/log.mcap --picture compared.png --json",
    ),
    results=("picture",),
)
def compare(
    logs: Annotated[list[Path], typer.Argument(help="log.mcap of two or more runs")],
    picture: Annotated[
        Path | None, typer.Option(help="draw tracks and curves over each other: .png, .svg or .pdf")
    ] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Compare runs: their numbers, and the differences of run, robot and world."""
    if len(logs) < 2:
        raise InputError(f"{logs[0]}: one log is compared with nothing; give two or more")
    check_picture(picture)

    runs = []
    for log, name in zip(logs, log_names(logs), strict=True):
        record = open_log(log)
        runs.append(compared_run(record, name))
    if picture is not None:
        pictures().draw_comparison(runs, picture)
    changed = differing(runs)
    if as_json:
        logs_and_runs = zip(logs, runs, strict=True)
        summaries = [
            {"log": str(log), **run.summary.to_dict(), "verdict": run.verdict.to_dict()}
            for log, run in logs_and_runs
        ]
        drawn = None if picture is None else str(picture)
        print(json.dumps({"summaries": summaries, "differing": changed, "picture": drawn}))
        return
    _print_tables(runs, changed)


def _print_tables(runs: "list[ComparedRun]", changed: dict[str, list[Any]]) -> None:
    settings = _table("setting", "What differs", runs)
    for key, values in changed.items():
        settings.add_row(key, *(labelled(key, value)[1] for value in values))
    if changed:
        console.print(settings, "")
    else:
        console.print("Run, robot and world are the same.\n")
    numbers = _table("number", "Numbers that differ, the largest difference first", runs)
    summaries = [
        flat(run.summary.to_dict())
        | {
            "verdict": run.verdict.sentence,
            "exit_code": run.verdict.exit_code,
            "cause": run.verdict.cause,
        }
        for run in runs
    ]
    keys = dict.fromkeys(key for summary in summaries for key in summary)
    values_by_key = {key: [summary.get(key) for summary in summaries] for key in keys}
    for key in sorted(keys, key=lambda key: _spread(values_by_key[key]), reverse=True):
        values = values_by_key[key]
        if _spread(values) > 0.0 and key.split(".")[0] not in _HIDDEN_NUMBERS:
            cells = [labelled(key, value) for value in values]
            label = min(
                (spelling for spelling, _ in cells), key=len
            )  # without the unit, if one is known
            numbers.add_row(label, *(text for _, text in cells))
    if numbers.row_count:
        console.print(numbers)
    poses = ", ".join(dict.fromkeys(run.verdict.evidence for run in runs))
    console.print(f"The other numbers are the same; --json prints all. Pose: {poses}.")


def _spread(values: list[Any]) -> float:
    """Difference of values relative to the largest; infinite if one is missing or no number."""
    if all(value == values[0] for value in values):
        return 0.0
    if not all(isinstance(value, int | float) for value in values):
        return math.inf
    return float((max(values) - min(values)) / max(map(abs, values)))


def _table(heading: str, title: str, runs: "list[ComparedRun]") -> Table:
    columns = [Column(run.name, overflow="fold") for run in runs]
    return Table(heading, *columns, box=None, title=title, title_justify="left")
