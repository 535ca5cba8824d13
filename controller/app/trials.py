"""One job over many seeds and motions, on a process pool: what holds in general, not once."""

from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from controller.app.execute import execute
from controller.app.prepare import prepare


@dataclass(frozen=True, slots=True)
class Trial:
    """One simulated run."""

    motion: str
    seed: int
    complete: bool
    reached: int
    missed: int
    duration_s: float
    path_error_m: float
    lead_max_rad: float
    """Largest difference between an asked and a measured joint angle."""
    current_max_a: float
    tripped: str | None


def run_trial(run: str, motion: str, seed: int) -> Trial:
    """Simulate one run; its log is not kept."""
    prepared = prepare(run, motion=motion, seed=seed)
    with TemporaryDirectory() as folder:
        finished = execute(prepared, Path(folder))
    numbers, outcome = finished.summary, finished.outcome
    return Trial(
        motion,
        seed,
        outcome.complete(len(prepared.run.waypoints_m)),
        outcome.reached,
        outcome.missed,
        outcome.duration_s,
        _number(numbers["path_error_mean_m"]),
        _number(numbers["tracking_max_rad"]),
        _number(numbers["peak_current_a"]),
        outcome.tripped,
    )


def trials(run: str, motions: list[str], seeds: int, workers: int) -> Iterator[Trial]:
    """Yield trials as they finish."""
    with ProcessPoolExecutor(workers) as pool:
        waiting = [
            pool.submit(run_trial, run, motion, seed) for motion in motions for seed in range(seeds)
        ]
        for done in as_completed(waiting):
            yield done.result()


def table(found: list[Trial]) -> list[dict[str, object]]:
    """One row a motion: runs complete, and means over its runs."""
    rows: list[dict[str, object]] = []
    for motion in dict.fromkeys(t.motion for t in sorted(found, key=lambda t: t.motion)):
        some = [t for t in found if t.motion == motion]
        rows.append(
            {
                "motion": motion,
                "complete": f"{sum(t.complete for t in some)} of {len(some)}",
                "waypoints": round(float(np.mean([t.reached for t in some])), 2),
                "passed by": round(float(np.mean([t.missed for t in some])), 2),
                "duration_s": round(float(np.mean([t.duration_s for t in some])), 1),
                "path_error_m": round(float(np.mean([t.path_error_m for t in some])), 3),
                "lead_max_rad": round(max(t.lead_max_rad for t in some), 3),
                "current_max_a": round(max(t.current_max_a for t in some), 2),
                "trips": sum(t.tripped is not None for t in some),
            }
        )
    return rows


def _number(value: object) -> float:
    return float(value) if isinstance(value, int | float) else float("nan")
