"""``snakewalk gait repertoire play``: recorded actions by wanted speed and turn."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from snakewalk.config.errors import InputError
from snakewalk.config.key_types import SEED, Seed
from snakewalk.config.schedule import ScheduleConfig
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import Robot, Set, World, key_values
from snakewalk.controller.console.progress import TimeBar
from snakewalk.controller.console.result_files import check_picture
from snakewalk.controller.console.run_options import RunOptions
from snakewalk.controller.repertoire.commands.action_table import plots
from snakewalk.controller.repertoire.prepare_schedule import prepare_schedule
from snakewalk.controller.repertoire.schedule_run import (
    PlayedAction,
    ScheduleMotion,
    read_schedule,
)
from snakewalk.controller.run.results import show_result
from snakewalk.controller.run.run_for_user import run_for_user

Speed = Annotated[
    float | None, typer.Option(help="requested speed in m/s; negative: tail first; default: 0.4")
]
Turn = Annotated[
    float | None,
    typer.Option(help="requested turn rate in rad/s, positive to the left; default: 0"),
]
Seconds = Annotated[
    float | None, typer.Option(help="duration of the motion in seconds; default: 20")
]
Schedule = Annotated[
    Path | None,
    typer.Option(
        help="speed and turn rate over time: TOML, or CSV with time_s,speed_m_s,turn_rad_s"
    ),
]
Patience = Annotated[
    int | None,
    typer.Option(
        min=1, help="number of cycles after which an action is replaced by another of its kind"
    ),
]


@command(
    "gait repertoire play",
    examples=(
        "gait repertoire play --speed 0.6 --turn 0.3",
        "gait repertoire play repertoire-yaw16-flat.npz --schedule wanted.toml --picture w.png",
    ),
    results=("picture",),
)
def play_actions(
    file: Annotated[Path, typer.Argument(help="file of recorded actions")] = Path(
        "repertoire-yaw16-flat.npz"
    ),
    speed: Speed = None,
    turn: Turn = None,
    seconds: Seconds = None,
    schedule: Schedule = None,
    patience: Patience = None,
    robot: Robot = None,
    world: World = None,
    set_: Set = None,
    picture: Annotated[
        Path | None, typer.Option(help="draw requested and measured speed and turn rate")
    ] = None,
    seed: Seed = SEED,
    *,
    options: RunOptions,
) -> None:
    """Play recorded actions on servos or in the simulator for a requested speed and turn rate."""
    check_picture(picture)
    prepared = prepare_schedule(
        file,
        _asked(schedule, speed, turn, seconds),
        robot=robot,
        world=world,
        patience=patience,
        seed=seed,
        keys=key_values("--set", set_),
    )
    name = f"actions-{prepared.run.name}"
    result = run_for_user(
        prepared, name, options, bar=TimeBar(prepared.run.name, prepared.config.duration_s)
    )
    assert isinstance(result.source, ScheduleMotion), "a schedule's run has no other motion"
    played = result.source.played
    names = [segment.name for segment in prepared.repertoire.segments]
    facts: dict[str, object] = {
        "repertoire": str(file),
        "robot": prepared.robot.name,
        "world": prepared.world.name,
        "size": round(prepared.scale, 4),
        "duration_s": round(result.outcome.duration_s, 2),
        "tripped": result.outcome.tripped,
        "actions": [names[action.action] for action in played],
    }
    if played:
        facts |= _errors(played)
        if picture is not None:
            plots().draw_schedule(prepared, played, picture)
            facts["picture"] = str(picture)
    show_result(result, facts, options)


def _asked(
    schedule: Path | None, speed: float | None, turn: float | None, seconds: float | None
) -> ScheduleConfig:
    """Return the wanted speeds and turns.

    Raises:
        InputError: two options contradict each other, or a value is out of range.

    """
    given = {"speed_m_s": speed, "turn_rad_s": turn, "duration_s": seconds}
    changes = {key: value for key, value in given.items() if value is not None}
    if schedule is not None and (speed is not None or turn is not None):
        raise InputError("--schedule holds speed and turn: leave out --speed and --turn")
    asked = ScheduleConfig() if schedule is None else read_schedule(schedule)
    if seconds is not None and seconds <= 0.0:
        raise InputError(f"--seconds {seconds:g}: must be over 0")
    return asked.model_copy(update=changes)


def _errors(played: Sequence[PlayedAction]) -> dict[str, object]:
    """Return median errors of the choice of actions, and of the body that carried them out."""
    requested, recorded, measured = (
        np.array([getattr(action, key) for action in played])
        for key in ("requested", "recorded", "measured")
    )
    errors: dict[str, object] = {}
    for key, off in (("choice", recorded - requested), ("body", measured - recorded)):
        median = np.median(np.abs(off), axis=0)
        errors[f"{key}_error_median_m_s"] = round(float(median[0]), 4)
        errors[f"{key}_error_median_rad_s"] = round(float(median[1]), 4)
    return errors
