"""``snakewalk run``: the main job, on servos or in the simulator."""

from typing import Annotated

import typer

from snakewalk.controller.console import completion
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import (
    DEFAULT_RUN,
    Compliant,
    Look,
    Motion,
    Observe,
    Robot,
    RunName,
    Seed,
    Set,
    Shadow,
    TrackFile,
    World,
)
from snakewalk.controller.console.run_options import RunOptions
from snakewalk.controller.run.job import Job


@command(
    "run",
    examples=("run", "run flat-slalom --seed 3", "run my-run.toml --port /dev/ttyUSB0"),
)
def run(
    run: RunName = DEFAULT_RUN,
    robot: Robot = None,
    world: World = None,
    track: TrackFile = None,
    seed: Seed = None,
    motion: Motion = None,
    pose: Annotated[
        str | None,
        typer.Option(
            help="pose source of the head: simulator, camera, tags, imu, joints, udp:PORT, "
            "ros:/TOPIC, or a source of a plug-in",
            autocompletion=completion.words(
                "simulator", "camera", "tags", "imu", "joints", "udp:", "ros:"
            ),
        ),
    ] = None,
    map_: Annotated[
        str | None,
        typer.Option(
            "--map",
            help="map of hilly ground: world (the true ground), or stereo (the part that the "
            "robot's stereo head has seen)",
            autocompletion=completion.words("world", "stereo"),
        ),
    ] = None,
    set_: Set = None,
    compliance: Compliant = None,
    shadow: Shadow = False,
    live: Annotated[
        bool,
        typer.Option(
            "--live",
            help="set waypoints in the page (--view) or by ROS (--ros) during the walk; at the "
            "last one the robot waits",
        ),
    ] = False,
    observe: Observe = None,
    look: Look = "servos",
    accept_dead_reckoning: Annotated[
        bool,
        typer.Option(
            "--accept-dead-reckoning",
            help="exit with 0 instead of 3 if the arrival was dead-reckoned, not measured",
        ),
    ] = False,
    *,
    options: RunOptions,
) -> None:
    """Run a job on servos or in the simulator; leaves log, report, film.

    `--set run.behaviour.pulse_body_lengths_s=0.3` sets the speed of the walk.
    """
    job = Job(
        run=run, robot=robot, world=world, track=track, seed=seed, motion=motion, pose=pose,
        map_source=map_, keys=set_, compliance=compliance, live=live, observe=observe,
        shadow=shadow, options=options,
    )  # fmt: skip
    raise SystemExit(job.carry_out(look=look, accept_dead_reckoning=accept_dead_reckoning))
