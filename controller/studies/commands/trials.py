"""``snakewalk trials run``: runs over seeds, motions, robots, worlds and steepnesses."""

import json
from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import asdict
from itertools import product
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import typer

from snakewalk.config.errors import InputError
from snakewalk.config.extras import require_extra
from snakewalk.controller.console import completion
from snakewalk.controller.console.command import command
from snakewalk.controller.console.messages import LOGGER
from snakewalk.controller.console.options import (
    DEFAULT_RUN,
    Dask,
    FirstSeed,
    Force,
    Json,
    Seeds,
    TableParquet,
    TrackFile,
    Workers,
    console,
    print_table,
)
from snakewalk.controller.console.parquet import check_parquet, table_to_parquet
from snakewalk.controller.console.progress import show_progress
from snakewalk.controller.console.result_files import check_picture
from snakewalk.controller.run.kinds.gait_factory import moves_by_gait
from snakewalk.controller.studies import trials as study
from snakewalk.controller.studies.commands.pictures import pictures
from snakewalk.controller.studies.trials_table import KINDS, TrialsTable

_HEADS = {
    "run": "run",
    "robot": "robot",
    "world": "world",
    "motion": "motion",
    "compliance": "com-\npliance",
    "relief": "relief",
    "slope_deg": "slope\ndeg",
    "complete": "com-\nplete",
    "first_pass": "first\npass",
    "passed_by": "mis-\nses",
    "truly_complete": "truly\nthere",
    "head_error_m": "head\noff m",
    "duration_s": "time\ns",
    "speed_m_s": "speed\nm/s",
    "speed_sd_m_s": "sd",
    "path_error_m": "error\nm",
    "path_error_max_m": "worst\nm",
    "eta": "eta",
    "cost_of_transport": "cost",
    "in_air": "in\nair",
    "roll_max_deg": "roll\ndeg",
    "pose": "pose",
    "why": "why",
}
"""Columns of the table, with units below the names."""


Over = Annotated[
    list[str] | None,
    typer.Option(
        help="values of a key of the run, robot or world, e.g. run.cycle_hz=25,50; if "
        "repeated, every combination runs",
        metavar="KEY=V1,V2",
    ),
]
StartSpread = Annotated[
    float,
    typer.Option(
        min=0.0,
        max=1.0,
        help="spread of the start in x and y in metres; 0: the start does not move",
    ),
]
Relief = Annotated[
    list[float] | None,
    typer.Option(min=0.0, max=5.0, help="factor on the ground's heights; may be repeated"),
]


TrialsPicture = Annotated[
    Path | None,
    typer.Option(help="draw complete and failed runs with reasons (.png, .svg, .pdf)"),
]
TrialsOut = Annotated[
    Path | None,
    typer.Option(
        "--out", "-o", help="write a CSV of all runs here; runs that it contains are skipped"
    ),
]


@command(
    "trials run",
    examples=("trials run flat-slalom --seeds 10 --motion walk --motion serpenoid --json",),
    results=("picture", "parquet"),
    tables=("out",),
)
def trials(
    runs: Annotated[
        list[str] | None,
        typer.Argument(
            help=f"shipped runs, RUN.toml files, or gaits; default: {DEFAULT_RUN}",
            metavar="RUN",
            autocompletion=completion.RUNS_OR_GAITS,
        ),
    ] = None,
    seeds: Seeds = 20,
    first_seed: FirstSeed = 0,
    start_spread: StartSpread = 0.04,
    motion: Annotated[
        list[str] | None,
        typer.Option(
            help="kind of motion, or all; may be repeated; default: all",
            autocompletion=completion.MOTIONS,
        ),
    ] = None,
    robot: Annotated[
        list[str] | None,
        typer.Option(
            help="shipped robot, or a TOML file; may be repeated; default: the run's",
            autocompletion=completion.ROBOTS,
        ),
    ] = None,
    relief: Relief = None,
    over: Over = None,
    compliance: Annotated[
        list[str] | None,
        typer.Option(help="on or off: joints yield to current; may be repeated"),
    ] = None,
    seconds: Annotated[
        float | None, typer.Option(min=5.0, help="duration of a gait in seconds; default: 20")
    ] = None,
    world: Annotated[
        list[str] | None,
        typer.Option(
            help="shipped world, or a TOML file; may be repeated; default: the run's",
            autocompletion=completion.WORLDS,
        ),
    ] = None,
    errors: Annotated[
        bool,
        typer.Option(
            "--errors",
            help="add wrong friction and mass, any law of friction, a weak servo, and horns off "
            "by 2 degrees",
        ),
    ] = False,
    track: TrackFile = None,
    workers: Workers = 2,
    out: TrialsOut = None,
    dask: Dask = None,
    picture: TrialsPicture = None,
    parquet: TableParquet = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Simulate runs or gaits over seeds; list how many arrived, and why others failed.

    Each seed moves the start, so that runs differ even if the motion makes no random choice.
    The same files give the same run. After an update of the program, begin a new --out.
    """
    _check_results(picture, parquet, out)
    require_extra("trials need", "mujoco" if dask is None else "distributed")
    over_values = [study.parse_over(text) for text in over or ()]
    if errors:
        over_values.append(("run.deviation.drawn", (True,)))
    _check_keys([key for key, _ in over_values])
    cases = _cases(runs or [DEFAULT_RUN], motion, robot, world, relief, compliance, over_values)
    _check_used(cases, track, seconds)
    changes = {"track": track, "seconds": seconds}
    seed_range = range(first_seed, first_seed + seeds)
    planned = study.plan_trials(cases, seed_range, start_spread, changes)  # refuses bad input first
    finished_trials: list[study.Trial] = []
    try:
        _run(
            planned,
            cases,
            changes,
            start_spread,
            _SimulationPlace(workers, dask),
            out,
            finished_trials,
        )
    finally:  # also of trials that were stopped
        summaries = study.table(finished_trials, cases)
        if picture is not None and finished_trials:
            pictures().draw_trials(summaries, picture)
    if parquet is not None and out is not None:
        table_to_parquet(out, parquet, KINDS)
    rows = [asdict(summary) for summary in summaries]
    if as_json:
        settings = {"seeds": list(seed_range), "start_spread_m": start_spread}
        print(
            json.dumps(settings | {"table": rows, "trials": [asdict(t) for t in finished_trials]})
        )
    else:
        _print(rows, [key for key, values in over_values if len(values) > 1])
    if all(trial.cause == "refused" for trial in finished_trials):
        raise InputError(f"no run was possible: {study.reasons(finished_trials)}")


class _SimulationPlace(NamedTuple):
    """Place of the simulation: processes, or a Dask cluster."""

    workers: int
    dask: str | None


def _check_results(picture: Path | None, parquet: Path | None, out: Path | None) -> None:
    check_picture(picture)
    check_parquet(parquet)
    if parquet is not None and out is None:
        raise InputError(f"--parquet {parquet}: is made from the CSV: give --out FILE, too")


def _check_used(
    cases: Sequence[study.Case], track: Path | str | None, seconds: float | None
) -> None:
    if track is not None and all(case.motion in {"gait", "serpenoid"} for case in cases):
        raise InputError(f"--track {track}: is of walks, and none is tried")
    if seconds is not None and not any(case.is_gait for case in cases):
        raise InputError(f"--seconds {seconds:g}: is of gaits; a run has run.time_limit_s (--over)")


def _cases(
    runs: list[str],
    motion: list[str] | None,
    robot: list[str] | None,
    world: list[str] | None,
    relief: list[float] | None,
    compliance: list[str] | None,
    over_values: Sequence[tuple[str, Sequence[Any]]],
) -> list[study.Case]:
    """Return every combination of the options' values, each once.

    Raises:
        InputError: a value of ``--compliance`` is neither on nor off.

    """
    for word in compliance or ():
        if word not in {"on", "off"}:
            raise InputError(f"--compliance {word}: expected on or off")
    motions = motion or ["walk", "walk-printed", "walk-blind", "serpenoid"]
    moved_by = {run: ["gait"] if moves_by_gait(run) else motions for run in runs}
    keys = [key for key, _ in over_values]
    axes = [values for _, values in over_values]
    cases = [
        study.Case(run, m, r, k, tuple(zip(keys, values, strict=True)), c, w)
        for run in runs
        for r in (robot if robot else (None,))
        for w in (world if world else (None,))
        for k in (relief if relief else (1.0,))
        for m in moved_by[run]
        for c in ([word == "on" for word in compliance] if compliance else (None,))
        for values in product(*axes)
    ]
    return list(dict.fromkeys(cases))


def _run(
    planned: list[tuple[study.Case, int]],
    cases: list[study.Case],
    changes: dict[str, Any],
    start_spread: float,
    where: _SimulationPlace,
    out: Path | None,
    finished: list[study.Trial],
) -> None:
    """Add all trials to ``finished``; those that the table ``out`` lacks are run."""
    table = None
    if out is not None:
        configs = {case: study.config_digest(case, changes) for case in cases}
        table = TrialsTable(out, configs, start_spread)
    finished += table.finished(planned) if table else []
    done = {(trial.case, trial.seed) for trial in finished}
    missing = [item for item in planned if item not in done]
    with table or nullcontext():
        some = study.trials(
            missing, where.workers, dask=where.dask, spread_m=start_spread, changes=changes
        )
        for trial in show_progress(
            some, str(out or "trials"), len(planned), done=len(finished), transient=False
        ):
            finished.append(trial)
            LOGGER.debug("%s", trial)
            if table:
                table.add(trial)


def _check_keys(keys: list[str]) -> None:
    """Reject a repeated key: its last value would replace the others.

    Raises:
        InputError: a key is repeated.

    """
    for place, key in enumerate(keys):
        if key in keys[:place]:
            raise InputError(f"--over {key}: given twice; put its values in one: {key}=V1,V2")


def _print(rows: list[dict[str, Any]], varied: list[str]) -> None:
    """Print the table; ``varied``: keys that become columns of their own."""
    shown = [key for key in _HEADS if any(row[key] not in {"", None} for row in rows)]
    if len({row["relief"] for row in rows}) == 1:
        shown.remove("relief")
    poses = {row["pose"] for row in rows}
    if len(poses) == 1 and "pose" in shown:
        shown.remove("pose")
    heads = ["\n".join(key.split(".")[-2:]) for key in varied] + [_HEADS[key] for key in shown]
    cells = [[row["keys"][key] for key in varied] + [row[key] for key in shown] for row in rows]
    print_table(heads, cells)
    if "pose" not in shown and poses != {""}:
        console.print(f"pose: {poses.pop()}")
