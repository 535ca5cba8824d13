"""``snakewalk play``: a recording in time on the robot."""

from typing import Annotated

import typer

from snakewalk.config.errors import InputError
from snakewalk.controller.console import completion
from snakewalk.controller.console.command import MOTION, command
from snakewalk.controller.console.options import (
    VIEW_AT,
    Film,
    Force,
    Json,
    Robot,
    Ros,
    RunFolder,
    RunPort,
    Set,
    View,
    ViewAt,
    World,
    key_values,
)
from snakewalk.controller.console.progress import TimeBar, in_real_time
from snakewalk.controller.console.result_files import run_folder
from snakewalk.controller.run.execute import execute
from snakewalk.controller.run.factory import prepare_playback
from snakewalk.controller.run.finish import show_run
from snakewalk.controller.run.watchers import watched


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
        str, typer.Option(help="times the animal's own; auto: as fast as the joints can, at most 1")
    ] = "auto",
    scale: Annotated[
        float, typer.Option(help="times the joint angles: below 1 the whole motion is smaller")
    ] = 1.0,
    clip: Annotated[
        bool, typer.Option("--clip", help="hold joints within their limits where it bends further")
    ] = False,
    set_: Set = None,
    port: RunPort = None,
    view: View = False,
    view_at: ViewAt = VIEW_AT,
    ros: Ros = False,
    film: Film = True,
    out: RunFolder = None,
    force: Force = False,
    as_json: Json = False,
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
    with (
        run_folder(f"play-{prepared.run.name}", out) as folder,
        watched(view, view_at, ros) as watchers,
        TimeBar(prepared.run.name, prepared.duration_s) as bar,
    ):
        finished = execute(
            prepared,
            folder,
            port,
            force=force,
            view=watchers,
            on_progress=in_real_time(bar.on_progress) if watchers and not port else bar.on_progress,
            on_event=bar.on_event,
        )
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
    show_run(finished, folder, result, as_json, film=film)


def _speed(text: str) -> float | None:
    if text == "auto":
        return None
    try:
        return float(text)
    except ValueError:
        raise InputError(f"--speed {text}: expected auto or a factor") from None
