"""``snakewalk policy run``: a learnt policy on servos or in the simulator."""

from contextlib import ExitStack
from typing import Annotated

import typer

from snakewalk.controller.console import completion
from snakewalk.controller.console.command import command
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
    Shadow,
    View,
    ViewAt,
    World,
    key_values,
)
from snakewalk.controller.console.progress import TimeBar, in_real_time
from snakewalk.controller.console.result_files import run_folder
from snakewalk.controller.run.execute import execute
from snakewalk.controller.run.factory import prepare_policy
from snakewalk.controller.run.finish import show_run, summarized
from snakewalk.controller.run.watchers import watched

Name = Annotated[
    str,
    typer.Argument(help="shipped policy, or a POLICY.toml", autocompletion=completion.POLICIES),
]


@command(
    "policy run",
    examples=(
        "policy run wave-cma --seconds 10",
        "policy run mine.toml --set world.friction.across=0.3 --json",
        "policy run wave-ppo --port /dev/ttyUSB0",
    ),
)
def run_policy(
    name: Name,
    robot: Robot = None,
    world: World = None,
    set_: Set = None,
    seconds: Annotated[
        float, typer.Option(min=1.0, max=3600.0, help="then it comes to rest")
    ] = 20.0,
    port: RunPort = None,
    shadow: Shadow = False,
    view: View = False,
    view_at: ViewAt = VIEW_AT,
    ros: Ros = False,
    film: Film = True,
    out: RunFolder = None,
    force: Force = False,
    seed: Annotated[int, typer.Option(min=0, help="of every random choice")] = 0,
    as_json: Json = False,
) -> None:
    """Run a learnt policy on servos or in the simulator; leaves a log, a report and a film."""
    keys = key_values("--set", set_)
    prepared = prepare_policy(name, robot=robot, world=world, seconds=seconds, seed=seed, keys=keys)
    run_name = prepared.run.name
    with ExitStack() as stack:
        folder = stack.enter_context(run_folder(f"policy-{run_name}-{prepared.robot.name}", out))
        watchers = stack.enter_context(watched(view, view_at, ros))
        bar = stack.enter_context(TimeBar(run_name, seconds))
        finished = execute(
            prepared,
            folder,
            port,
            force=force,
            view=watchers,
            shadow=shadow,
            on_progress=in_real_time(bar.on_progress) if watchers and not port else bar.on_progress,
            on_event=bar.on_event,
        )
    result: dict[str, object] = {
        "policy": name,
        "robot": prepared.robot.name,
        "world": prepared.world.name,
        "duration_s": round(finished.outcome.duration_s, 2),
        "tripped": finished.outcome.tripped,
        "slowed_to": round(finished.outcome.least_rate, 3),
        **summarized(finished.summary, "travelled_m"),
        "pose_evidence": finished.summary.pose_evidence,
        "pose_source": finished.summary.pose_source,
        "electrical_energy_j": finished.summary.electrical_energy_j,
        "peak_current_a": finished.summary.peak_current_a,
    }
    show_run(finished, folder, result, as_json, film=film)
