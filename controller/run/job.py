"""``snakewalk run``: from its options to log, report and film."""

import sys
from dataclasses import dataclass
from pathlib import Path

import typer

from snakewalk.config.errors import InputError
from snakewalk.controller.console.options import key_values, show
from snakewalk.controller.console.progress import PathBar, TimeBar
from snakewalk.controller.console.run_options import RunOptions
from snakewalk.controller.run.carry_out import Carried, carry_out, watched_by
from snakewalk.controller.run.factory import changed, prepare_job, with_map
from snakewalk.controller.run.film_look import check_look
from snakewalk.controller.run.finish import by_evidence, exit_code, write_artifacts
from snakewalk.controller.run.kinds.path_run import PathRun
from snakewalk.controller.run.prepared_run import PreparedRun
from snakewalk.controller.run.run_keys import with_compliance


@dataclass(frozen=True, slots=True, kw_only=True)
class Job:
    """Values of the options of ``snakewalk run``."""

    run: str
    robot: str | None
    world: str | None
    track: str | None
    seed: int | None
    motion: str | None
    pose: str | None
    map_source: str | None
    keys: list[str] | None
    """``KEY=VALUE`` each."""
    compliance: bool | None
    live: bool
    observe: list[str] | None
    shadow: bool
    options: RunOptions

    def carry_out(self, *, look: str, accept_dead_reckoning: bool) -> int:
        """Run the job and show its result; return the exit code.

        Raises:
            InputError: a value is unknown, or two contradict each other.

        """
        check_look(look)
        if self.live and not (self.options.view or self.options.ros):
            raise InputError(
                "--live: waypoints come from the page or from ROS; add --view or --ros"
            )
        prepared = self._prepared()
        name = self._name(prepared)
        finished, folder = self._execute(prepared, name)
        outcome = finished.outcome
        with finished.ending.noted():
            artifacts = write_artifacts(
                finished.record, folder, finished.summary, film=self.options.film, look=look
            )
            show(
                {
                    "run": name,
                    "waypoints": outcome.waypoints,
                    **by_evidence(finished, {"waypoints_reached": outcome.reached}),
                    "duration_s": round(outcome.duration_s, 2),
                    "tripped": outcome.tripped,
                    "advance_alarms": outcome.alarms,
                    **finished.pose.facts(),
                    **finished.map.facts(),
                    "log": str(finished.log),
                    "summary": str(folder / "summary.json"),
                    **artifacts.to_dict(),
                },
                self.options.as_json,
            )
        return exit_code(finished, accept_dead_reckoning)

    def _prepared(self) -> PreparedRun:
        prepared = prepare_job(
            self.run, keys=key_values("--set", self.keys), seed=self.seed, motion=self.motion,
            robot=self.robot, world=self.world, track=self.track, pose=self.pose,
        )  # fmt: skip
        run = with_map(with_compliance(prepared.run, self.compliance), self.map_source)
        return changed(prepared, run=run)

    def _name(self, prepared: PreparedRun) -> str:
        run = prepared.run
        replaced = [
            Path(each).stem for each in (self.robot, self.world, self.track) if each is not None
        ]
        parts = [run.name, *replaced, run.motion, f"seed{run.seed}"]
        if run.pose is not None:
            parts.append(f"pose-{run.pose.partition(':')[0]}")
        if run.mapping is not None:
            parts.append(f"map-{run.mapping.source}")
        return "-".join(parts)

    def _execute(self, prepared: PreparedRun, name: str) -> Carried:
        with watched_by(self.options, *(self.observe or ()), live=self.live) as watchers:
            commanded = watchers if self.live else None
            if commanded is not None and commanded.page is not None:
                commanded.page.on_course()
            return carry_out(
                prepared,
                name,
                progress_bar(prepared),
                self.options,
                watchers,
                shadow=self.shadow,
                confirm=_confirm if sys.stdin.isatty() else None,
                waypoint_commands=None if commanded is None else commanded.waypoint_commands,
            )


def _confirm(found: str) -> bool:
    """Ask whether an interrupted chain may continue; the servos hold meanwhile."""
    return typer.confirm(f"{found}; go on?", err=True)


def progress_bar(prepared: PreparedRun) -> PathBar | TimeBar:
    """Return the progress bar of a run: along its path, or over its time."""
    if isinstance(prepared, PathRun):
        return PathBar(prepared.path.length_m)
    return TimeBar(prepared.run.name, prepared.run.time_limit_s)
