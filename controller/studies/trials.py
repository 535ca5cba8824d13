"""Runs and gaits over many seeds, motions, robots, grounds and frictions, on a process pool."""

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from snakewalk.config.archive import parse_json
from snakewalk.config.errors import InputError
from snakewalk.config.loader import digest
from snakewalk.controller.console.pool import each
from snakewalk.controller.metrics.ground_contact import ground_contact
from snakewalk.controller.run.factory import changed, prepare_job
from snakewalk.controller.run.kinds.gait_factory import is_gait, prepare_gait
from snakewalk.controller.run.kinds.walk_run import WalkRun
from snakewalk.controller.run.prepared_run import PreparedRun
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_keys import with_compliance
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.terrain.summary import path_relief
from snakewalk.controller.track.readers.load import load_track

Value = str | int | float | bool

GAIT_SECONDS = 20.0
_START_DRAWS = 1000


@dataclass(frozen=True, slots=True)
class Case:
    """Parameters of one row of the table; None leaves the run's own."""

    run: str
    motion: str
    robot: str | None = None
    relief: float = 1.0
    """Factor on the heights of the ground."""
    keys: tuple[tuple[str, Value], ...] = ()
    """Replaced values of run, robot and world; ``_deg`` for ``_rad``."""
    compliance: bool | None = None
    """Whether joints yield to measured current."""
    world: str | None = None

    @property
    def is_gait(self) -> bool:
        """Whether ``run`` names a gait, or a set of its parameters."""
        return is_gait(self.run)


@dataclass(frozen=True, slots=True)
class Trial:
    """One simulated run."""

    case: Case
    seed: int
    start_m: tuple[float, float] | None = None
    """Start of the head; None if the run could not be prepared."""
    waypoints: int = 0
    complete: bool = False
    """Whether the body truly reached every waypoint, without a trip."""
    reached: int = 0
    """Waypoints that the body truly came to, in order."""
    missed: int = 0
    """Number of new paths after a missed waypoint, or a body off the path or stuck."""
    duration_s: float = math.nan
    slope_median_deg: float = math.nan
    """Median slope of the surface in the body's strip along the path."""
    path_error_m: float = math.nan
    """Mean."""
    path_error_max_m: float = math.nan
    eta: float = math.nan
    """Forward speed over pulse speed."""
    cost_of_transport: float = math.nan
    """Electrical."""
    lead_max_rad: float = math.nan
    """Largest difference between an asked and a measured joint angle."""
    speed_m_s: float = math.nan
    """Speed of a gait over the ground, net, at full rate."""
    current_max_a: float = math.nan
    roll_max_deg: float = math.nan
    in_air: float = math.nan
    """Share of links that do not touch the ground, mean."""
    truly_reached: float = math.nan
    """Truly reached waypoints with an estimated pose; NaN with a measured one."""
    head_error_m: float = math.nan
    """Root mean square error of the estimated head; NaN with a measured pose."""
    pose_evidence: str = ""
    """Evidence of the poses: ``measured``, ``dead-reckoned``, ..."""
    pose_source: str = ""
    alarms: int = 0
    """Number of alarms for missing advance."""
    cause: str = ""
    """Cause of an incomplete run, of ``metrics.failure``, or ``refused`` or ``error``."""
    why: str = ""
    """Cause of an incomplete run, in a sentence."""
    verdict: str = ""
    """End of the run according to its own log, in a sentence."""
    exit_code: int = 2
    """Exit code of ``snakewalk run`` with this end; 2 if the run could not be prepared."""

    @property
    def first_pass(self) -> bool:
        """Whether every waypoint was reached on the first path."""
        return self.complete and self.missed == 0


def prepare_case(
    case: Case, seed: int, spread_m: float, changes: Mapping[str, object]
) -> PreparedRun:
    """Prepare one trial's run; a normal deviate from the seed moves its start.

    A walk's start on unsafe ground is drawn again.

    Raises:
        InputError: the run cannot be prepared, or the ground about its start is unsafe.

    """
    prepared_run = _prepared_trial(case, seed, changes)
    prepared_run = changed(prepared_run, run=with_compliance(prepared_run.run, case.compliance))
    if case.relief != 1.0:
        prepared_run = changed(prepared_run, world=prepared_run.world.with_relief(case.relief))
    if spread_m == 0.0:
        return prepared_run
    relief = prepared_run.planner.relief if isinstance(prepared_run, WalkRun) else None
    start_m = np.array(prepared_run.run.start_m)
    rng = np.random.default_rng(seed)
    for _ in range(_START_DRAWS):
        x_m, y_m = start_m + spread_m * rng.standard_normal(2)
        if relief is None or relief.safe(x_m, y_m):
            moved = prepared_run.run.model_copy(update={"start_m": (float(x_m), float(y_m))})
            return changed(prepared_run, run=moved)
    raise InputError(
        f"run {prepared_run.run.name}: no safe ground within {spread_m:g} m of the start "
        f"({start_m[0]:.2f}, {start_m[1]:.2f}); move the start or give --start-spread 0"
    )


def _prepared_trial(case: Case, seed: int, changes: Mapping[str, object]) -> PreparedRun:
    given = {"robot": case.robot, "world": case.world}
    options: dict[str, Any] = dict(changes) | {k: v for k, v in given.items() if v is not None}
    seconds = options.pop("seconds", None)
    if not case.is_gait:
        options |= {"motion": case.motion, "seed": seed}
        return prepare_job(case.run, keys=dict(case.keys), **options)
    return prepare_gait(
        case.run,
        robot=case.robot,
        world=case.world,
        seconds=float(str(seconds)) if seconds is not None else GAIT_SECONDS,
        seed=seed,
        keys=dict(case.keys),
    )


def parse_over(text: str) -> tuple[str, tuple[Value, ...]]:
    """Read ``world.ground.slope_deg=5,10,15``: a key and its values in turn.

    Raises:
        InputError: the key or the value is missing.

    """
    key, equals, values = (part.strip() for part in text.partition("="))
    words = [word.strip() for word in values.split(",")]
    if not (key and equals and all(words)):
        raise InputError(f"--over {text}: must be KEY=VALUE,VALUE,...")
    return key, tuple(dict.fromkeys(_value(word) for word in words))


def _value(word: str) -> Value:
    try:
        value = parse_json(word)
    except ValueError:
        return word
    return value if isinstance(value, int | float | bool) else word


def config_digest(case: Case, changes: Mapping[str, object]) -> str:
    """Digest of a case: run, robot and world without seed and start.

    Raises:
        InputError: the case cannot be prepared.

    """
    prepared_run = prepare_case(case, 0, 0.0, changes)
    return digest(prepared_run.run, prepared_run.robot, prepared_run.world)


def is_fixed(case: Case, spread_m: float, changes: Mapping[str, object]) -> bool:
    """Whether all seeds give the same run, so that it counts once.

    The seed draws the start, errors of the robot and its ground, the walk's shapes, a camera's
    noise, and an IMU's bias and noise.
    """
    run = prepare_case(case, 0, 0.0, changes).run
    drawn = run.deviation.drawn or run.pose in {"camera", "imu"}
    return spread_m == 0.0 and run.motion in {"serpenoid", "gait"} and not drawn


def run_trial(case: Case, seed: int, spread_m: float, changes: Mapping[str, object]) -> Trial:
    """Simulate one run without its log; an exception is a result as well."""
    trial = Trial(case, seed)
    try:
        prepared = prepare_case(case, seed, spread_m, changes)
        trial = replace(
            trial, start_m=prepared.run.start_m, waypoints=len(prepared.run.waypoints_m)
        )
        if isinstance(prepared, WalkRun):
            slope_rad = path_relief(prepared.planner, prepared.path).median_footprint_slope_rad
            trial = replace(trial, slope_median_deg=math.degrees(slope_rad))
        return _measured_trial(trial, prepared)
    except InputError as error:
        return replace(trial, cause="refused", why=f"refused: {error.faults[0]}")
    except Exception as error:  # the other runs go on
        return replace(trial, cause="error", why=f"{type(error).__name__}: {error}", exit_code=1)


def _measured_trial(trial: Trial, prepared: PreparedRun) -> Trial:
    result = run_robot(RunRequest(prepared, stoppable=False))
    contact = ground_contact(result.record, prepared.ground)
    numbers = result.summary
    outcome = result.outcome
    off = result.pose.error
    reached = outcome.reached if off is None else off.waypoints_reached
    complete = outcome.tripped is None and reached == outcome.waypoints
    verdict = result.verdict
    return replace(
        trial,
        complete=complete,
        reached=reached,
        missed=outcome.missed,
        duration_s=outcome.duration_s,
        speed_m_s=_number(numbers.speed_m_s) if trial.case.is_gait else math.nan,
        path_error_m=_number(numbers.path_error_mean_m),
        path_error_max_m=_number(numbers.path_error_max_m),
        eta=_number(numbers.eta),
        cost_of_transport=_number(numbers.electrical_cost_of_transport),
        lead_max_rad=_number(numbers.tracking_max_rad),
        current_max_a=_number(numbers.peak_current_a),
        roll_max_deg=math.degrees(contact.roll_max_rad),
        in_air=contact.in_air,
        truly_reached=math.nan if off is None else float(off.waypoints_reached),
        head_error_m=math.nan if off is None else off.head_rms_m,
        pose_evidence=numbers.pose_evidence,
        pose_source=numbers.pose_source,
        alarms=outcome.alarms,
        cause="" if complete else verdict.failure or "",
        why="" if complete or verdict.failure is None else verdict.cause or "",
        verdict=verdict.sentence,
        exit_code=verdict.exit_code,
    )


def plan_trials(
    cases: Sequence[Case], seeds: Sequence[int], spread_m: float, changes: Mapping[str, object]
) -> list[tuple[Case, int]]:
    """List the runs to do, seed by seed, so that an early stop leaves complete seeds.

    A case with equal runs for all seeds is listed once.

    Raises:
        InputError: a case cannot be prepared, or its recording cannot be read.

    """
    shaped = [case for case in cases if case.motion not in {"serpenoid", "gait"}]
    for track in dict.fromkeys(prepare_case(case, 0, 0.0, changes).run.track for case in shaped):
        load_track(track)
    fixed = {case: is_fixed(case, spread_m, changes) for case in cases}
    return [(case, seed) for seed in seeds for case in cases if seed == seeds[0] or not fixed[case]]


def trials(
    planned: Sequence[tuple[Case, int]],
    workers: int,
    *,
    dask: str | None = None,
    spread_m: float,
    changes: Mapping[str, object],
) -> Iterator[Trial]:
    """Yield the planned trials as they finish; ``changes`` replace fields of the runs.

    ``dask`` is the address of a scheduler, whose workers simulate instead of ``workers`` processes.
    """
    work = partial(_run_seed, spread_m=spread_m, changes=changes)
    for _, trial in each(work, planned, workers=workers, dask=dask):
        yield trial


def _run_seed(item: tuple[Case, int], *, spread_m: float, changes: Mapping[str, object]) -> Trial:
    return run_trial(*item, spread_m, changes)


@dataclass(frozen=True, slots=True)
class CaseSummary:
    """Trials of one case, rounded; None if unknown. The fields are columns."""

    run: str
    robot: str
    motion: str
    relief: float
    keys: dict[str, Value]
    """Values that were replaced in the files."""
    runs: int
    slope_deg: float | None
    complete: str
    """Share of complete runs as ``n of m``."""
    complete_95: tuple[float, float]
    """Interval of the share of complete runs (Wilson, 95 %)."""
    first_pass: int
    """Complete runs that passed no waypoint by."""
    first_pass_95: tuple[float, float]
    reached: float | None
    passed_by: int
    """Number of waypoints that were passed by in all runs, also in those that are not complete."""
    duration_s: float | None
    path_error_m: float | None
    path_error_max_m: float | None
    eta: float | None
    cost_of_transport: float | None
    lead_max_rad: float | None
    current_max_a: float | None
    roll_max_deg: float | None
    in_air: float | None
    alarms: int
    causes: dict[str, int]
    """Number of runs by cause of failure, most first."""
    why: str
    """Reasons of failures in a line; unforeseen errors in full."""
    compliance: str = ""
    """Whether joints yield to current: ``on`` or ``off`` where it was chosen."""
    speed_m_s: float | None = None
    """Net speed of gaits, mean of the runs."""
    speed_sd_m_s: float | None = None
    """Standard deviation of that speed from run to run."""
    truly_complete: str = ""
    """Share of runs that truly reached every waypoint as ``n of m``, with an estimated pose."""
    head_error_m: float | None = None
    """Error of an estimated pose, mean over the runs."""
    world: str = ""
    """Name of the world where one was chosen."""
    pose: str = ""
    """Evidence of the poses: ``measured (simulator)``."""
    exit_codes: dict[str, int] | None = None
    """Number of runs by exit code. 0: as planned; 1: a waypoint missed, a stop or an error;
    2: rejected; 3: arrival not measured."""
    rolled: int = 0
    """Runs in which the head link was over 90 degrees on its side."""


_MEANS = {
    "reached": 2,
    "duration_s": 1,
    "path_error_m": 3,
    "eta": 2,
    "cost_of_transport": 2,
    "in_air": 2,
    "speed_m_s": 4,
    "head_error_m": 3,
}
_LARGEST = {"path_error_max_m": 2, "lead_max_rad": 3, "current_max_a": 2, "roll_max_deg": 0}
"""Values of trials whose mean or largest value is in the row of a case, and their digits."""


def table(all_trials: Sequence[Trial], cases: Sequence[Case]) -> list[CaseSummary]:
    """One row per case: complete runs, means and extremes, and reasons of failures."""
    rows: list[CaseSummary] = []
    for case in cases:
        some = sorted((t for t in all_trials if t.case == case), key=lambda t: t.seed)
        complete = sum(t.complete for t in some)
        first = sum(t.first_pass for t in some)
        statistics: dict[str, Any] = {
            name: statistic([getattr(t, name) for t in some], digits)
            for statistic, names in ((_mean, _MEANS), (_largest_value, _LARGEST))
            for name, digits in names.items()
        }
        rows.append(
            CaseSummary(
                **statistics,
                run=case.run,
                robot=case.robot or "",
                motion=case.motion,
                relief=case.relief,
                keys=dict(case.keys),
                runs=len(some),
                slope_deg=_mean([t.slope_median_deg for t in some], 1),
                complete=f"{complete} of {len(some)}",
                complete_95=wilson(complete, len(some)),
                first_pass=first,
                first_pass_95=wilson(first, len(some)),
                passed_by=sum(t.missed for t in some),
                alarms=sum(t.alarms for t in some),
                causes=_counts([t.cause for t in some if not t.complete]),
                why=reasons([t for t in some if not t.complete]),
                compliance={None: "", True: "on", False: "off"}[case.compliance],
                speed_sd_m_s=_deviation([t.speed_m_s for t in some], 4),
                truly_complete=_truly_complete(some),
                world=case.world or "",
                pose=_evidence(some),
                exit_codes=_counts([str(t.exit_code) for t in some]),
                rolled=sum(t.roll_max_deg > 90.0 for t in some),
            )
        )
    return rows


def _evidence(some: Sequence[Trial]) -> str:
    sources = {f"{t.pose_evidence} ({t.pose_source})": None for t in some if t.pose_evidence}
    return ", ".join(sources)


def _truly_complete(some: Sequence[Trial]) -> str:
    finite_trials = [t for t in some if np.isfinite(t.truly_reached)]
    if not finite_trials:
        return ""
    return f"{sum(t.truly_reached == t.waypoints for t in finite_trials)} of {len(finite_trials)}"


def wilson(successes: int, runs: int) -> tuple[float, float]:
    """Return the 95 % interval of a share by E. B. Wilson (1927), three digits; (0, 1) of no run.

    Unlike the normal approximation it holds for few runs and for shares of 0 and 1.
    """
    if runs == 0:
        return 0.0, 1.0
    z = 1.959964  # normal quantile of 97.5 %
    share = successes / runs
    square = z * z / runs
    middle = (share + square / 2.0) / (1.0 + square)
    half = z * math.sqrt((share * (1.0 - share) + square / 4.0) / runs) / (1.0 + square)
    return round(max(middle - half, 0.0), 3), round(min(middle + half, 1.0), 3)


def reasons(failed: Sequence[Trial]) -> str:
    """Reasons of failures in a line: ``2 slip; 1 refused: ...``."""
    words = [t.why if t.cause in {"safety", "refused", "error"} else t.cause for t in failed]
    return "; ".join(f"{count} {word}" for word, count in _counts(words).items())


def _counts(words: Sequence[str]) -> dict[str, int]:
    return dict(sorted(sorted(Counter(words).items()), key=lambda item: -item[1]))


def _number(value: object) -> float:
    return float(value) if isinstance(value, int | float) else math.nan


def _finite(values: list[float] | list[int]) -> list[float]:
    return [value for value in values if np.isfinite(value)]


def _mean(values: list[float] | list[int], digits: int) -> float | None:
    finite_values = _finite(values)
    return round(float(np.mean(finite_values)), digits) if finite_values else None


def _deviation(values: list[float], digits: int) -> float | None:
    finite_values = _finite(values)
    return round(float(np.std(finite_values, ddof=1)), digits) if len(finite_values) > 1 else None


def _largest_value(values: list[float], digits: int) -> float | None:
    finite_values = _finite(values)
    return round(max(finite_values), digits) if finite_values else None
