"""One job over many seeds, motions, robots and steepnesses, on a process pool."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from snakewalk.config.errors import InputError
from snakewalk.controller.app.runs.execute import execute
from snakewalk.controller.app.runs.factory import prepare_walk
from snakewalk.controller.app.runs.walk_run import WalkRun
from snakewalk.controller.app.studies.pool import each
from snakewalk.controller.metrics.ground_contact import ground_contact
from snakewalk.controller.terrain.summary import path_relief


@dataclass(frozen=True, slots=True)
class Case:
    """What distinguishes one row of the table; None leaves the run's own."""

    motion: str
    robot: str | None = None
    relief: float = 1.0
    """Factor on the heights of the ground."""


@dataclass(frozen=True, slots=True)
class Trial:
    """One simulated run."""

    case: Case
    seed: int
    waypoints: int
    complete: bool = False
    reached: int = 0
    missed: int = 0
    duration_s: float = math.nan
    slope_median_deg: float = math.nan
    """Of the path."""
    path_error_m: float = math.nan
    eta: float = math.nan
    """Forward speed over pulse speed."""
    lead_max_rad: float = math.nan
    """Largest difference between an asked and a measured joint angle."""
    current_max_a: float = math.nan
    roll_max_deg: float = math.nan
    in_air: float = math.nan
    """Share of links that do not touch the ground, mean."""
    alarms: int = 0
    """For missing advance."""
    tripped: str | None = None
    refused: str | None = None
    """Why the plan was refused, where it was."""


def prepare_case(run: str, case: Case, seed: int, changes: Mapping[str, object]) -> WalkRun:
    """Prepare one trial's run."""
    robot = {"robot": case.robot} if case.robot is not None else {}
    found = prepare_walk(run, motion=case.motion, seed=seed, **(dict(changes) | robot))
    if case.relief == 1.0:
        return found
    return replace(found, world=found.world.with_relief(case.relief))


def run_trial(run: str, case: Case, seed: int, changes: Mapping[str, object]) -> Trial:
    """Simulate one run; its log is not kept."""
    prepared = prepare_case(run, case, seed, changes)
    waypoints = len(prepared.run.waypoints_m)
    relief = path_relief(prepared.planner, prepared.path)
    slope_deg = float(np.degrees(relief.median_slope_rad))
    with TemporaryDirectory() as folder:
        try:
            finished = execute(prepared, Path(folder))
        except InputError as error:
            return Trial(case, seed, waypoints, slope_median_deg=slope_deg, refused=error.faults[0])
        stood = ground_contact(finished.record, prepared.ground)
    numbers, outcome = finished.summary, finished.outcome
    return Trial(
        case=case,
        seed=seed,
        waypoints=waypoints,
        complete=outcome.complete(waypoints),
        reached=outcome.reached,
        missed=outcome.missed,
        duration_s=outcome.duration_s,
        slope_median_deg=slope_deg,
        path_error_m=_number(numbers.path_error_mean_m),
        eta=_number(numbers.eta),
        lead_max_rad=_number(numbers.tracking_max_rad),
        current_max_a=_number(numbers.peak_current_a),
        roll_max_deg=float(np.degrees(stood.roll_max_rad)),
        in_air=stood.in_air,
        alarms=outcome.alarms,
        tripped=outcome.tripped,
    )


def trials(
    run: str, cases: Sequence[Case], seeds: int, workers: int, changes: Mapping[str, object]
) -> Iterator[Trial]:
    """Yield trials as they finish; ``changes`` replace fields of the run where not None."""
    work = partial(_run_seed, run=run, changes=changes)
    for _, trial in each(work, list(product(cases, range(seeds))), workers=workers):
        yield trial


def _run_seed(item: tuple[Case, int], *, run: str, changes: Mapping[str, object]) -> Trial:
    return run_trial(run, *item, changes)


@dataclass(frozen=True, slots=True)
class CaseSummary:
    """The trials of one case, rounded for a reader; None: not known. The fields are columns."""

    robot: str
    motion: str
    relief: float
    slope_deg: float | None
    complete: str
    """``n of m`` runs."""
    reached: float | None
    passed_by: float | None
    duration_s: float | None
    path_error_m: float | None
    eta: float | None
    lead_max_rad: float | None
    current_max_a: float | None
    roll_max_deg: float | None
    in_air: float | None
    alarms: int
    trips: int
    why: str


def table(found: Sequence[Trial], cases: Sequence[Case]) -> list[CaseSummary]:
    """One row a case: runs complete, means and extremes over its runs, and why others failed."""
    rows: list[CaseSummary] = []
    for case in cases:
        some = sorted((t for t in found if t.case == case), key=lambda t: t.seed)
        rows.append(
            CaseSummary(
                robot=case.robot or "",
                motion=case.motion,
                relief=case.relief,
                slope_deg=_mean([t.slope_median_deg for t in some], 1),
                complete=f"{sum(t.complete for t in some)} of {len(some)}",
                reached=_mean([t.reached for t in some], 2),
                passed_by=_mean([t.missed for t in some], 2),
                duration_s=_mean([t.duration_s for t in some], 1),
                path_error_m=_mean([t.path_error_m for t in some], 3),
                eta=_mean([t.eta for t in some], 2),
                lead_max_rad=_most([t.lead_max_rad for t in some], 3),
                current_max_a=_most([t.current_max_a for t in some], 2),
                roll_max_deg=_most([t.roll_max_deg for t in some], 0),
                in_air=_mean([t.in_air for t in some], 2),
                alarms=sum(t.alarms for t in some),
                trips=sum(t.tripped is not None for t in some),
                why="; ".join(sorted({why for t in some if (why := reason(t))})),
            )
        )
    return rows


def reason(trial: Trial) -> str:
    """Why a trial is not complete, in words; empty if it is."""
    if trial.complete:
        return ""
    if trial.refused:
        return f"refused: {trial.refused}"
    if trial.tripped:
        return trial.tripped.partition(": ")[2] or trial.tripped
    if trial.roll_max_deg > 60.0:
        return "rolls over"
    if trial.alarms:
        return "slips"
    return "passes by" if trial.missed else "out of time"


def _number(value: object) -> float:
    return float(value) if isinstance(value, int | float) else math.nan


def _mean(values: list[float] | list[int], digits: int) -> float | None:
    known = [v for v in values if np.isfinite(v)]
    return round(float(np.mean(known)), digits) if known else None


def _most(values: list[float], digits: int) -> float | None:
    known = [v for v in values if np.isfinite(v)]
    return round(max(known), digits) if known else None
