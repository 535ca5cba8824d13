"""``snakewalk play``: a recording on the robot."""

from typing import Annotated

import typer

from snakewalk.config.errors import InputError
from snakewalk.controller.console import completion
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import (
    Robot,
    Set,
    World,
    key_values,
)
from snakewalk.controller.console.run_options import RunOptions
from snakewalk.controller.run.factory import prepare_playback
from snakewalk.controller.run.results import show_result
from snakewalk.controller.run.run_for_user import run_for_user


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
    speed: Annotated[
        str,
        typer.Option(
            help="factor on the animal's speed; auto: the largest that the joints allow, at most 1"
        ),
    ] = "auto",
    scale: Annotated[
        float, typer.Option(help="factor on the joint angles; below 1 the motion is smaller")
    ] = 1.0,
    clip: Annotated[
        bool,
        typer.Option(
            "--clip", help="hold joints at their limits where the recording bends further"
        ),
    ] = False,
    joint: Annotated[
        list[str] | None,
        typer.Option(
            metavar="ROBOT=FILE",
            help="joint of the file that moves a joint of the robot; ROBOT=rest keeps it at 0; may "
            "be repeated",
        ),
    ] = None,
    unit: Annotated[
        str | None, typer.Option(help="unit of joint angles if the file states none: rad or deg")
    ] = None,
    topic: Annotated[
        str | None, typer.Option(help="topic of a bag that has several topics of joint angles")
    ] = None,
    episode: Annotated[
        int | None, typer.Option(help="number of the episode of a LeRobot dataset, from 0")
    ] = None,
    set_: Set = None,
    *,
    options: RunOptions,
) -> None:
    """Play a recording or joint angles on servos or in the simulator.

    It leaves a log and a film.
    """
    prepared = prepare_playback(
        track,
        robot=robot,
        world=world,
        speed=_speed(speed),
        scale=scale,
        clip=clip,
        keys=key_values("--set", set_),
        joints={name: str(value) for name, value in key_values("--joint", joint).items()},
        unit=_unit(unit),
        topic=topic,
        episode=episode,
    )
    name = f"play-{prepared.run.name}"
    result = run_for_user(prepared, name, options, seconds=prepared.duration_s)
    facts: dict[str, object] = {
        "recording": track,
        "robot": prepared.robot.name,
        "world": prepared.world.name,
        "speed": round(prepared.speed, 4),
        "scale": scale,
        "clipped": prepared.clipped,
        "notes": list(prepared.notes),
        "duration_s": round(result.outcome.duration_s, 2),
        "tripped": result.outcome.tripped,
        "peak_current_a": result.summary.peak_current_a,
    }
    show_result(result, facts, options)


def _unit(text: str | None) -> str | None:
    if text not in (None, "rad", "deg"):
        raise InputError(f"--unit {text}: expected rad or deg")
    return text


def _speed(text: str) -> float | None:
    if text == "auto":
        return None
    try:
        return float(text)
    except ValueError:
        raise InputError(f"--speed {text}: expected auto or a factor") from None
