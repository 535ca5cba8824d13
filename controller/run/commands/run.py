"""``snakewalk run``: the main job, on servos or in the simulator."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from snakewalk.config.errors import InputError
from snakewalk.controller.console import completion
from snakewalk.controller.console.command import JOB, command
from snakewalk.controller.console.options import (
    DEFAULT_RUN,
    VIEW_AT,
    Compliant,
    Film,
    Force,
    Json,
    Look,
    Motion,
    Observe,
    Robot,
    Ros,
    RunFolder,
    RunName,
    RunPort,
    Seed,
    Set,
    Shadow,
    TrackFile,
    View,
    ViewAt,
    World,
    key_values,
    show,
)
from snakewalk.controller.console.result_files import run_folder
from snakewalk.controller.run.finish import write_artifacts


@command(
    "run",
    group=JOB,
    examples=("run", "run flat-slalom --seed 3", "run my-run.toml --port /dev/ttyUSB0"),
)
def run(
    run: RunName = DEFAULT_RUN,
    port: RunPort = None,
    robot: Robot = None,
    world: World = None,
    track: TrackFile = None,
    seed: Seed = None,
    motion: Motion = None,
    pose: Annotated[
        str | None,
        typer.Option(
            help="pose source of the head: simulator, camera, imu, joints, or that of a plug-in",
            autocompletion=completion.words("simulator", "camera", "imu", "joints"),
        ),
    ] = None,
    map_: Annotated[
        str | None,
        typer.Option(
            "--map",
            help="what the walk knows of hilly ground: world (all of it), or stereo: what the "
            "robot's stereo head has seen so far",
            autocompletion=completion.words("world", "stereo"),
        ),
    ] = None,
    set_: Set = None,
    out: RunFolder = None,
    compliance: Compliant = None,
    shadow: Shadow = False,
    live: Annotated[
        bool,
        typer.Option(
            "--live",
            help="waypoints are set in the page as it walks (--view); at the last one it holds, "
            "and waits for more",
        ),
    ] = False,
    view: View = False,
    view_at: ViewAt = VIEW_AT,
    ros: Ros = False,
    observe: Observe = None,
    film: Film = True,
    look: Look = "servos",
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Run a job on servos or in the simulator; leaves a log, a report and a film."""
    from snakewalk.controller.console.progress import in_real_time  # noqa: PLC0415
    from snakewalk.controller.run.execute import execute  # noqa: PLC0415  heavy; --help stays quick
    from snakewalk.controller.run.factory import (  # noqa: PLC0415
        changed,
        prepare_job,
        with_compliance,
        with_map,
    )
    from snakewalk.controller.run.film_look import check_look  # noqa: PLC0415
    from snakewalk.controller.run.progress_bar import progress_bar  # noqa: PLC0415
    from snakewalk.controller.run.watchers import watched  # noqa: PLC0415

    check_look(look)
    if live and not view:
        raise InputError("--live: waypoints are set in the page: add --view")
    prepared = prepare_job(
        run, keys=key_values("--set", set_), seed=seed, motion=motion, robot=robot, world=world,
        track=track, pose=pose,
    )  # fmt: skip
    prepared = changed(prepared, run=with_map(with_compliance(prepared.run, compliance), map_))
    replaced = [Path(each).stem for each in (robot, world, track) if each is not None]
    parts = [prepared.run.name, *replaced, prepared.run.motion, f"seed{prepared.run.seed}"]
    if prepared.run.pose is not None:
        parts.append(f"pose-{prepared.run.pose}")
    if prepared.run.mapping is not None:
        parts.append(f"map-{prepared.run.mapping.source}")
    name = "-".join(parts)
    with (
        run_folder(name, out) as folder,
        watched(view, view_at, ros, observe) as watchers,
        progress_bar(prepared) as bar,
    ):
        page = watchers.page if watchers is not None and live else None
        if page is not None:
            page.on_course()
        finished = execute(
            prepared,
            folder,
            port,
            force=force,
            view=watchers,
            shadow=shadow,
            confirm=_confirm if sys.stdin.isatty() else None,
            waypoint_commands=None if page is None else page.pressed,
            on_progress=in_real_time(bar.on_progress) if watchers and not port else bar.on_progress,
            on_event=bar.on_event,
        )
    outcome = finished.outcome
    artifacts = write_artifacts(finished.record, folder, finished.summary, film=film, look=look)
    show(
        {
            "run": name,
            "waypoints": outcome.waypoints,
            "waypoints_reached": outcome.reached,
            "duration_s": round(outcome.duration_s, 2),
            "tripped": outcome.tripped,
            "advance_alarms": outcome.alarms,
            **finished.pose.facts(),
            **finished.map.facts(),
            "log": str(finished.log),
            "summary": str(folder / "summary.json"),
            **artifacts.to_dict(),
        },
        as_json,
    )
    if not outcome.complete:
        raise SystemExit(1)


def _confirm(found: str) -> bool:
    """Ask whether an interrupted chain may go on; the servos hold meanwhile."""
    return typer.confirm(f"{found}; go on?", err=True)
