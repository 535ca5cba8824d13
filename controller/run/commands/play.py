"""``snakewalk play``: a recording in time on the robot."""

from typing import Annotated

import typer

from snakewalk.config.errors import InputError
from snakewalk.controller.console import completion
from snakewalk.controller.console.command import MOTION, command
from snakewalk.controller.console.options import (
    Robot,
    Set,
    World,
    key_values,
)
from snakewalk.controller.console.progress import TimeBar
from snakewalk.controller.console.run_options import RunOptions
from snakewalk.controller.run.carry_out import carry_out, watched_by
from snakewalk.controller.run.factory import prepare_playback
from snakewalk.controller.run.finish import show_run


@command(
    "play",
    group=MOTION,
    examples=("play worm-like", "play fish.npz --robot yaw16 --speed 0.5 --json"),
)
def play(
    track: Annotated[
        str,
        typer.Argument(help="shipped recording, or a file", autocompletion=completion.RECORDINGS),
    ],
    robot: Robot = None,
    world: World = None,
    speed: Annotated[
        str,
        typer.Option(
            help="factor on the animal's speed; auto: as fast as the joints can, at most 1"
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
    set_: Set = None,
    *,
    options: RunOptions,
) -> None:
    """Play a recording on servos or in the simulator; leaves a log, a report and a film."""
    prepared = prepare_playback(
        track,
        robot=robot,
        world=world,
        speed=_speed(speed),
        scale=scale,
        clip=clip,
        keys=key_values("--set", set_),
    )
    bar = TimeBar(prepared.run.name, prepared.duration_s)
    with watched_by(options) as watchers:
        finished, folder = carry_out(prepared, f"play-{prepared.run.name}", bar, options, watchers)
    result: dict[str, object] = {
        "recording": track,
        "robot": prepared.robot.name,
        "world": prepared.world.name,
        "speed": round(prepared.speed, 4),
        "scale": scale,
        "clipped": prepared.clipped,
        "duration_s": round(finished.outcome.duration_s, 2),
        "tripped": finished.outcome.tripped,
        "peak_current_a": finished.summary.peak_current_a,
    }
    show_run(finished, folder, result, options.as_json, film=options.film)


def _speed(text: str) -> float | None:
    if text == "auto":
        return None
    try:
        return float(text)
    except ValueError:
        raise InputError(f"--speed {text}: expected auto or a factor") from None
