"""``snakewalk play``: a recording on the robot."""

from pathlib import Path
from typing import Annotated

import typer
from pydantic import Field

from snakewalk.config.answers import Answers
from snakewalk.config.playback import PlaybackConfig
from snakewalk.config.reading import store, texts, with_stored
from snakewalk.controller.console import completion
from snakewalk.controller.console.command import command
from snakewalk.controller.console.option import Flag
from snakewalk.controller.console.options import (
    Robot,
    Set,
    World,
    key_values,
)
from snakewalk.controller.console.progress import TimeBar
from snakewalk.controller.console.run_options import RunOptions
from snakewalk.controller.run.factory import prepare_playback
from snakewalk.controller.run.results import show_result
from snakewalk.controller.run.run_for_user import run_for_user


class PlaybackOptions(PlaybackConfig, Answers):
    """The keys of ``[playback]`` as options."""

    joints: Annotated[dict[str, str], Flag(("--joint",), metavar="ROBOT=FILE")] = Field(
        {},
        description="joint of the file that moves a joint of the robot; ROBOT=rest keeps it at 0; "
        "may be repeated",
    )


@command(
    "play",
    examples=(
        "play worm-like",
        "play fish.npz --robot yaw16 --speed 0.5 --json",
        "play angles.csv --unit deg --joint yaw1=motor_1",
    ),
)
def play(
    track: Annotated[
        str,
        typer.Argument(
            help="shipped recording, file, ROS 2 bag, or dataset",
            autocompletion=completion.RECORDINGS,
        ),
    ],
    robot: Robot = None,
    world: World = None,
    set_: Set = None,
    *,
    playback: PlaybackOptions,
    options: RunOptions,
) -> None:
    """Play a recording or joint angles on servos or in the simulator.

    It leaves a log and a film.
    """
    prepared = prepare_playback(
        track,
        robot=robot,
        world=world,
        keys=key_values("--set", set_),
        **playback.model_dump(exclude={"remember"}),
    )
    if playback.remember:
        store(Path(track), with_stored(Path(track), playback.request)[0])
    name = f"play-{prepared.run.name}"
    result = run_for_user(
        prepared, name, options, bar=TimeBar(prepared.run.name, prepared.duration_s)
    )
    facts: dict[str, object] = {
        "recording": track,
        "robot": prepared.robot.name,
        "world": prepared.world.name,
        "speed": round(prepared.speed, 4),
        "scale": playback.scale,
        "clipped": prepared.clipped,
        "facts": texts(prepared.facts),
        "notes": list(prepared.notes),
        "duration_s": round(result.outcome.duration_s, 2),
        "tripped": result.outcome.tripped,
        "peak_current_a": result.summary.peak_current_a,
    }
    show_result(result, facts, options)
