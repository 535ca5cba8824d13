"""``snakewalk run``: the main job, on servos or in the simulator."""

from pathlib import Path
from typing import Annotated

import typer

from snakewalk.config.constants import LOOK
from snakewalk.config.errors import InputError
from snakewalk.config.key_types import Seed
from snakewalk.config.run import RunConfig
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
    Set,
    Shadow,
    TrackFile,
    World,
    key_values,
)
from snakewalk.controller.console.run_options import RunOptions
from snakewalk.controller.run.factory import changed, prepare_job, with_map
from snakewalk.controller.run.request import RunResult
from snakewalk.controller.run.results import by_evidence, check_look, show_result
from snakewalk.controller.run.run_for_user import observers_of, run_for_user
from snakewalk.controller.run.run_keys import with_compliance


@command(
    "run",
    examples=("run", "run flat-slalom --seed 3", "run my-run.toml --port /dev/ttyUSB0"),
)
def run(
    run: RunName = DEFAULT_RUN,
    robot: Robot = None,
    world: World = None,
    track: TrackFile = None,
    seed: Seed | None = None,
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
    look: Look = LOOK,
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
    check_look(look)
    if live and not (options.view or options.ros):
        raise InputError("--live: waypoints come from the page or from ROS; add --view or --ros")
    prepared = prepare_job(
        run,
        keys=key_values("--set", set_),
        seed=seed,
        motion=motion,
        robot=robot,
        world=world,
        track=track,
        pose=pose,
    )
    job = with_map(with_compliance(prepared.run, compliance), map_)
    name = _name(job, robot, world, track)
    result = run_for_user(
        changed(prepared, run=job),
        name,
        options,
        observers=observers_of(options, observe, live=live),
        live=live,
        shadow=shadow,
    )
    show_result(
        result,
        _facts(result, name),
        options,
        look=look,
        accept_dead_reckoning=accept_dead_reckoning,
    )


def _facts(result: RunResult, name: str) -> dict[str, object]:
    """Return what the command prints of a run, by key."""
    outcome = result.outcome
    return {
        "run": name,
        "waypoints": outcome.waypoints,
        **by_evidence(result, {"waypoints_reached": outcome.reached}),
        "duration_s": round(outcome.duration_s, 2),
        "tripped": outcome.tripped,
        "advance_alarms": outcome.alarms,
        **result.pose.facts(),
        **result.map.facts(),
    }


def _name(run: RunConfig, *replaced: str | None) -> str:
    """Return the name of the result folder: the run and all that differs from its file."""
    files = [Path(replaced_file).stem for replaced_file in replaced if replaced_file is not None]
    parts = [run.name, *files, run.motion, f"seed{run.seed}"]
    if run.pose is not None:
        parts.append(f"pose-{run.pose.partition(':')[0]}")
    if run.mapping is not None:
        parts.append(f"map-{run.mapping.source}")
    return "-".join(parts)
