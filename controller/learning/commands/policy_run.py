"""``snakewalk gait policy run``: a learnt policy on servos or in the simulator."""

from typing import Annotated

import typer

from snakewalk.config.key_types import MOTION_S, SEED, MotionSeconds, Seed
from snakewalk.controller.console import completion
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import Robot, Set, Shadow, World, key_values
from snakewalk.controller.console.progress import TimeBar
from snakewalk.controller.console.run_options import RunOptions
from snakewalk.controller.run.factory import prepare_policy
from snakewalk.controller.run.results import run_facts, show_result, summarized
from snakewalk.controller.run.run_for_user import run_for_user

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
    seconds: MotionSeconds = MOTION_S,
    seed: Seed = SEED,
    shadow: Shadow = False,
    *,
    options: RunOptions,
) -> None:
    """Run a learnt policy on servos or in the simulator; leaves a log, a report and a film."""
    keys = key_values("--set", set_)
    prepared = prepare_policy(name, robot=robot, world=world, seconds=seconds, seed=seed, keys=keys)
    results = f"policy-{prepared.run.name}-{prepared.robot.name}"
    bar = TimeBar(prepared.run.name, seconds)
    result = run_for_user(prepared, results, options, bar=bar, shadow=shadow)
    facts: dict[str, object] = {
        "policy": name,
        **run_facts(result),
        "lowest_rate": round(result.outcome.least_rate, 3),
        **summarized(result.summary, "travelled_m"),
        "electrical_energy_j": result.summary.electrical_energy_j,
        "peak_current_a": result.summary.peak_current_a,
    }
    show_result(result, facts, options)
