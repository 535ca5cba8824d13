"""``snakewalk trials rehearse``: many runs against served robots, in simulated time."""

import json
from collections.abc import Sequence
from pathlib import Path
from statistics import fmean
from typing import Annotated, Any

import typer

from snakewalk.config.loader import checked, load_run
from snakewalk.config.pose import TrackerConfig
from snakewalk.controller.console import completion
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import (
    FirstSeed,
    Json,
    Seeds,
    Workers,
    console,
    key_values,
    print_table,
)
from snakewalk.controller.console.pool import each
from snakewalk.controller.console.progress import show_progress
from snakewalk.controller.rehearsal.rehearsal import RUNS, RehearsalCase, case_of, rehearse
from snakewalk.controller.rehearsal.result_lines import append_lines, read_lines

_METRICS = {"distance %": "distance_m", "cost %": "cost_of_transport", "eta %": "eta"}
"""Columns of the largest errors of metrics."""
_TRACKER = {"noise_m": 0.01, "noise_deg": 3.0, "delay_s": 0.1}
"""Noise and delay that the walk must tolerate."""


@command(
    "trials rehearse",
    examples=(
        "trials rehearse flat-slalom --seeds 3",
        "trials rehearse --errors --seeds 20 -o errors.jsonl",
    ),
)
def rehearse_runs(
    runs: Annotated[
        list[str] | None,
        typer.Argument(
            help="shipped runs, or RUN.toml files; default: six on hills, ramps, steps and a floor",
            autocompletion=completion.RUNS,
        ),
    ] = None,
    seeds: Seeds = 3,
    first_seed: FirstSeed = 0,
    errors: Annotated[
        bool,
        typer.Option(
            "--errors",
            help="add wrong friction and mass, any law of friction, a weak servo, horns off by 2 "
            "degrees and goals 40 ms late",
        ),
    ] = False,
    tracker: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY=VALUE",
            help="errors of the simulated tracker; default: noise_m=0.01 noise_deg=3 delay_s=0.1",
        ),
    ] = None,
    workers: Workers = 1,
    out: Annotated[
        Path,
        typer.Option(
            "--out",
            "-o",
            dir_okay=False,
            help="write the results here as JSON lines, or continue an existing file",
        ),
    ] = Path("rehearsal.jsonl"),
    as_json: Json = False,
) -> None:
    """Rehearse runs against served robots in simulated time; exit code 1 if one did not arrive."""
    given = {**_TRACKER, **dict(key_values("--tracker", tracker))}
    config = checked(TrackerConfig, given, "--tracker")
    for run in runs or ():
        load_run(run)
    planned = [
        RehearsalCase(run, seed, errors, config)
        for seed in range(first_seed, first_seed + seeds)
        for run in runs or RUNS
    ]
    results = {case_of(row).key: row for row in read_lines(out, _rehearsal, "a rehearsal")}
    missing = [case for case in planned if case.key not in results]
    finished = show_progress(each(rehearse, missing, workers=workers), "rehearsals", len(missing))
    for case, row in append_lines(out, finished, dict):
        results[case.key] = row
    rows = [results[case.key] for case in planned]
    if as_json:
        print(json.dumps({"rehearsals": rows, "file": str(out)}))
    else:
        heads = ("run", "truly there", "false claims", "path m", "pose m", "pose deg", *_METRICS)
        names = dict.fromkeys(row["run"] for row in rows)
        cells = [_cells(name, [row for row in rows if row["run"] == name]) for name in names]
        print_table((*heads, "false alarms"), cells)
        for row in rows:
            if not row.get("has_arrived", False):
                console.print(f"{row['run']}, seed {row['seed']}: {_verdict(row)}")
    if not all(row.get("has_arrived", False) for row in rows):
        raise SystemExit(1)


def _rehearsal(row: dict[str, Any]) -> dict[str, Any]:
    case_of(row)  # rejects another row
    _verdict(row)
    return row


def _verdict(row: dict[str, Any]) -> str:
    return str(row.get("error") or row["verdict"])


def _worst_errors(metrics: Sequence[dict[str, Any]]) -> tuple[str, ...]:
    cells = []
    for key in _METRICS.values():
        pairs = [(task_metrics[key], task_metrics[f"true_{key}"]) for task_metrics in metrics]
        errors = [100.0 * (measured / true - 1.0) for measured, true in pairs if measured and true]
        cells.append(f"{max(errors, key=abs):+.1f}" if errors else "")
    false = sum(
        max(task_metrics["alarms"] - task_metrics["true_alarms"], 0) for task_metrics in metrics
    )
    return (*cells, str(false) if metrics else "")


def _cells(run: str, rows: Sequence[dict[str, Any]]) -> tuple[str, ...]:
    judged = [row for row in rows if "error" not in row]

    def mean(key: str, digits: int) -> str:
        values = [row[key] for row in judged if row[key] is not None]
        return f"{fmean(values):.{digits}f}" if values else ""

    return (
        run,
        f"{sum(row['has_arrived'] for row in judged)} of {len(rows)}",
        str(sum(not row["is_true"] for row in judged)),
        mean("path_error_mean_m", 2),
        mean("pose_error_rms_m", 3),
        mean("heading_error_rms_deg", 1),
        *_worst_errors([row["metrics"] for row in judged if row.get("metrics")]),
    )
