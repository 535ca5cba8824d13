"""``snakewalk policy``: learnt policies: list, run, compare with gaits, learn one."""

import json
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import fmean, stdev
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from snakewalk.config.errors import InputError
from snakewalk.config.extras import require_extra
from snakewalk.config.loader import shipped
from snakewalk.controller.console import completion
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import (
    VIEW_AT,
    Film,
    FirstSeed,
    Force,
    GivenRobot,
    GivenWorld,
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
    console,
    key_values,
)
from snakewalk.controller.console.progress import ProgressBar, TimeBar, in_real_time, show_progress
from snakewalk.controller.console.result_files import atomic_write, refuse_to_overwrite, run_folder
from snakewalk.controller.learning import policy_trials as study
from snakewalk.controller.motion.policy import load_policy
from snakewalk.controller.run.execute import execute
from snakewalk.controller.run.factory import prepare_policy
from snakewalk.controller.run.finish import show_run
from snakewalk.controller.run.watchers import watched

if TYPE_CHECKING:
    from snakewalk.controller.learning.policy_trials import PolicyTrial, PolicyTrialResult

Name = Annotated[
    str,
    typer.Argument(help="shipped policy, or a POLICY.toml", autocompletion=completion.POLICIES),
]


@command("policy list", examples=("policy list --json",))
def list_policies(as_json: Json = False) -> None:
    """List the shipped policies, and how each was learnt."""
    policies = [load_policy(name) for name in shipped("policies")]
    if as_json:
        rows = [
            policy.model_dump(exclude={"network"})
            | {
                "weights": sum(
                    len(each.bias) * (len(each.weights[0]) + 1) for each in policy.network
                )
            }
            for policy in policies
        ]
        print(json.dumps({"policies": rows}))
        return
    table = Table(box=None, pad_edge=False)
    for title in ("policy", "robot", "world", "learnt by", "seed", "steps", "Hz", "made with"):
        table.add_column(title, justify="right" if title in {"seed", "steps", "Hz"} else "left")
    for policy in policies:
        origin = policy.origin
        hz = "changing" if policy.network else f"{policy.wave.frequency_hz:.2f}"
        numbers = (str(origin.seed), str(origin.steps), hz)
        table.add_row(
            *(policy.name, policy.robot, origin.world, origin.method, *numbers, origin.software)
        )
    console.print(table)


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
        "travelled_m": finished.summary.travelled_m,
        "electrical_energy_j": finished.summary.electrical_energy_j,
        "peak_current_a": finished.summary.peak_current_a,
    }
    show_run(finished, folder, result, as_json, film=film)


@command(
    "policy learn",
    examples=("policy learn -o mine.toml", "policy learn --seed 1 --workers 8 -o one.toml"),
)
def learn_policy(
    out: Annotated[Path, typer.Option("--out", "-o", help="the policy (.toml)")],
    robot: GivenRobot = "yaw16",
    world: GivenWorld = "flat",
    generations: Annotated[int, typer.Option(min=1, max=100_000)] = 24,
    population: Annotated[
        int, typer.Option(min=4, max=10_000, help="candidates of a generation")
    ] = 12,
    steps: Annotated[int, typer.Option(min=50, max=100_000, help="of 20 ms, in an episode")] = 250,
    seed: Annotated[int, typer.Option(min=0, help="of candidates and starts")] = 0,
    workers: Annotated[int, typer.Option(min=1, help="processes")] = 2,
    force: Force = False,
) -> None:
    """Learn a wave with its feedback by CMA-ES, on episodes of the Gymnasium environment."""
    if out.suffix != ".toml":
        raise InputError(f"{out}: a policy's file ends in .toml")
    refuse_to_overwrite([out], force)
    require_extra("learning a policy needs", "cma", "gymnasium", "mujoco")

    from snakewalk.controller.learning.wave_search import search_wave  # noqa: PLC0415

    with ProgressBar(f"{robot} on {world}", generations) as bar:
        policy = search_wave(
            out.stem,
            robot=robot,
            world=world,
            generations=generations,
            population=population,
            steps=steps,
            seed=seed,
            workers=workers,
            on_progress=lambda done, mean_m: bar.update(done, note=f"{mean_m:.2f} m an episode"),
        )
    with atomic_write(out) as part:
        part.write_text(policy.toml(), encoding="utf-8")
    console.print(f"{out}: {policy.origin.steps} steps; snakewalk policy run {out}")


@command(
    "policy trials",
    examples=(
        "policy trials wave-cma wave-ppo lateral-undulation --first-seed 1000",
        "policy trials mine.toml wave-cma --world flat --world flat-friction-3 --json",
    ),
)
def policy_trials(
    motions: Annotated[
        list[str],
        typer.Argument(
            help="policies, gaits, sets of parameters, or their files",
            metavar="MOTION...",
            autocompletion=completion.POLICIES_OR_GAITS,
        ),
    ],
    world: Annotated[
        list[str] | None,
        typer.Option(help="may be given again; default: flat", autocompletion=completion.WORLDS),
    ] = None,
    seeds: Annotated[int, typer.Option(min=1, max=1000, help="runs a row")] = 10,
    first_seed: FirstSeed = 0,
    seconds: Annotated[float, typer.Option(min=5.0, max=3600.0, help="of each run")] = 12.0,
    workers: Annotated[int, typer.Option(min=1, help="processes")] = 2,
    as_json: Json = False,
) -> None:
    """Compare policies with gaits: the same seeds move start, friction and supply of all."""
    require_extra("trials need", "mujoco")

    rows = [(motion, ground) for ground in world or ["flat"] for motion in motions]
    rows = list(dict.fromkeys(rows))  # what is given twice is run once
    planned = [
        study.PolicyTrial(motion, ground, seed, seconds)
        for motion, ground in rows
        for seed in range(first_seed, first_seed + seeds)
    ]
    some = study.policy_trials(planned, workers)
    found = list(show_progress(some, "trials", len(planned)))
    table = [
        _row(*row, [each for each in found if (each[0].motion, each[0].world) == row])
        for row in rows
    ]
    if as_json:
        trials = [asdict(trial) | asdict(result) for trial, result in found]
        print(json.dumps({"table": [asdict(row) for row in table], "trials": trials}))
        return
    grid = Table(box=None, pad_edge=False)
    for title in (
        "motion",
        "world",
        "m/s",
        "sd",
        "lengths\na cycle",
        "J/m",
        "course\nrad",
        "trips",
    ):
        grid.add_column(title, justify="left" if title in {"motion", "world"} else "right")
    for row in table:
        grid.add_row(*["-" if value is None else str(value) for value in asdict(row).values()])
    console.print(grid)


@dataclass(frozen=True, slots=True)
class _Row:
    """Means over the runs that did not trip; None where all have."""

    motion: str
    world: str
    speed_m_s: float | None
    speed_sd_m_s: float | None
    body_lengths_cycle: float | None
    energy_j_m: float | None
    course_rad: float | None
    """Root of the mean square: how far off x they went."""
    trips: int


def _row(motion: str, world: str, found: "list[tuple[PolicyTrial, PolicyTrialResult]]") -> _Row:
    whole = [result for _, result in found if result.tripped is None]
    speeds = [result.speed_m_s for result in whole]
    if not whole:
        return _Row(motion, world, None, None, None, None, None, len(found))
    return _Row(
        Path(motion).stem,
        world,
        round(fmean(speeds), 4),
        round(stdev(speeds), 4) if len(speeds) > 1 else None,
        round(fmean(result.body_lengths_cycle for result in whole), 3),
        round(fmean(result.energy_j_m for result in whole), 2),
        round(fmean(result.course_rad**2 for result in whole) ** 0.5, 3),
        len(found) - len(whole),
    )
