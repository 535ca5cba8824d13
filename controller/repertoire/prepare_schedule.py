"""Runs of recorded actions, prepared from a file or from a run's configuration."""

from collections.abc import Mapping
from pathlib import Path

from snakewalk.config.errors import InputError
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.config.schedule import ScheduleConfig
from snakewalk.config.world import WorldConfig
from snakewalk.controller.console.command import plugin
from snakewalk.controller.console.messages import LOGGER
from snakewalk.controller.repertoire.repertoire import load_repertoire
from snakewalk.controller.repertoire.schedule_run import ScheduleRun
from snakewalk.controller.run.assembly import assemble, load_body
from snakewalk.controller.run.run_keys import OF_A_SCHEDULE, checked_keys


@plugin("run", "repertoire")
def prepare_repertoire(run: RunConfig, robot: RobotConfig, world: WorldConfig) -> ScheduleRun:
    """Recorded actions played by a schedule of speeds and turns."""
    if run.repertoire is None:
        raise InputError(f"run {run.name}: made again by: snakewalk gait repertoire run PLAN")
    return ScheduleRun(run, robot, world)


def prepare_schedule(
    file: Path,
    schedule: ScheduleConfig,
    *,
    robot: str | None = None,
    world: str | None = None,
    patience: int | None = None,
    seed: int = 0,
    keys: Mapping[str, object] | None = None,
) -> ScheduleRun:
    """Prepare to play recorded actions by wanted speed and turn; ``keys`` as of ``prepare_walk``.

    Robot and world are by default those of the recording.

    Raises:
        InputError: no repertoire, or one of other joints; a ground that is not flat; no action for
            a requested direction.

    """
    keys = checked_keys(keys, OF_A_SCHEDULE)
    recorded = load_repertoire(file)
    body = load_body(robot or recorded.robot, keys)
    fields = {
        "name": file.stem,
        "robot": body.name,
        "world": world or recorded.world,
        "motion": "repertoire",
        "seed": seed,
        "time_limit_s": schedule.duration_s + 30.0,
        "repertoire": schedule.model_dump() | {"file": str(file), "patience": patience},
    }
    run, ground = assemble(fields, keys, body)
    prepared = ScheduleRun(run, body, ground)
    prepared.check_plan()
    remark = prepared.remark()
    if remark is not None:
        LOGGER.warning("%s", remark)
    return prepared
