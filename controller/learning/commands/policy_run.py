"""``snakewalk gait policy run``: a learnt policy on servos or in the simulator."""

from typing import Annotated

import typer

from snakewalk.controller.console import completion
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import (
    Robot,
    Set,
    Shadow,
    World,
    key_values,
)
from snakewalk.controller.console.progress import TimeBar
from snakewalk.controller.console.run_options import RunOptions
from snakewalk.controller.run.carry_out import carry_out, watched_by
from snakewalk.controller.run.factory import prepare_policy
from snakewalk.controller.run.finish import show_run, summarized

Name = Annotated[
    str,
    typer.Argument(help="shipped policy, or a POLICY.toml", autocompletion=completion.POLICIES),
]


@command(
    "gait policy run",
    examples=(
        "gait policy run wave-cma --seconds 10",
        "gait policy run mine.toml --set world.friction.across=0.3 --json",
        "gait policy run wave-ppo --port /dev/ttyUSB0",
    ),
)
def run_policy(
    name: Name,
    robot: Robot = None,
    world: World = None,
    set_: Set = None,
    seconds: Annotated[
        float, typer.Option(min=1.0, max=3600.0, help="duration of the motion in seconds")
    ] = 20.0,
    seed: Annotated[int, typer.Option(min=0, help="seed of every random choice")] = 0,
    shadow: Shadow = False,
    *,
    options: RunOptions,
) -> None:
    """Run a learnt policy on servos or in the simulator; leaves a log, a report and a film."""
    keys = key_values("--set", set_)
    prepared = prepare_policy(name, robot=robot, world=world, seconds=seconds, seed=seed, keys=keys)
    run_name = prepared.run.name
    results = f"policy-{run_name}-{prepared.robot.name}"
    with watched_by(options) as watchers:
        finished, folder = carry_out(
            prepared, results, TimeBar(run_name, seconds), options, watchers, shadow=shadow
        )
    result: dict[str, object] = {
        "policy": name,
        "robot": prepared.robot.name,
        "world": prepared.world.name,
        "duration_s": round(finished.outcome.duration_s, 2),
        "tripped": finished.outcome.tripped,
        "slowed_to": round(finished.outcome.least_rate, 3),
        **summarized(finished.summary, "travelled_m"),
        "electrical_energy_j": finished.summary.electrical_energy_j,
        "peak_current_a": finished.summary.peak_current_a,
    }
    show_run(finished, folder, result, options.as_json, film=options.film)
