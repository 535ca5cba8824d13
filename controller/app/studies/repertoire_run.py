"""A planned sequence of actions, run: what was predicted, and what was measured."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from snakewalk.controller.app.runs.execute import Finished, execute
from snakewalk.controller.app.runs.repertoire_run import RepertoireRun, RouteMotion
from snakewalk.controller.repertoire.route import Follower
from snakewalk.controller.runtime.drive import OnProgress


@dataclass(frozen=True, slots=True)
class RouteRun:
    """A run of a plan, and what its follower saw."""

    job: RepertoireRun
    finished: Finished
    follower: Follower

    @property
    def complete(self) -> bool:
        """Whether every waypoint was reached without a trip."""
        return self.finished.outcome.complete(len(self.job.run.waypoints_m))

    def facts(self) -> dict[str, object]:
        """Numbers for a command's answer."""
        job, outcome, follower = self.job, self.finished.outcome, self.follower
        found: dict[str, object] = {
            "waypoints": len(job.run.waypoints_m),
            "waypoints_reached": outcome.reached,
            "replanned": job.replan,
            "actions_planned": len(job.route.actions),
            "actions_run": len(follower.measured),
            "predicted_s": round(job.route.duration_s, 2),
            "duration_s": round(outcome.duration_s, 2),
            "tripped": outcome.tripped,
        }
        cycle, route = follower.errors(), follower.route_errors()
        if len(cycle):
            found |= {
                "cycle_error_median_m": round(float(np.median(cycle[:, 0])), 4),
                "cycle_error_median_rad": round(float(np.median(cycle[:, 1])), 4),
            }
        if len(route) and not job.replan:
            found |= {
                "open_loop_error_max_m": round(float(route[:, 0].max()), 4),
                "open_loop_error_end_m": round(float(route[-1, 0]), 4),
                "open_loop_error_end_rad": round(float(route[-1, 1]), 4),
            }
        return found


def default_folder(job: RepertoireRun) -> Path:
    """Where a run goes that is told nothing."""
    how = "repertoire" if job.replan else "repertoire-open"
    return Path("runs") / f"{job.run.name}-{job.robot.name}-{how}"


def run_route(
    job: RepertoireRun,
    folder: Path,
    port: str | None,
    on_progress: OnProgress = lambda progress: None,
) -> RouteRun:
    """Execute a plan on ``port``, or on the simulator where it is None.

    Raises:
        InputError: as ``execute``.

    """
    finished = execute(job, folder, port, on_progress=on_progress)
    assert isinstance(finished.source, RouteMotion), "a repertoire run has no other motion"
    return RouteRun(job, finished, finished.source.follower)
