"""The command line: ``snakewalk COMMAND --help``."""

import json
import sys
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import track
from rich.table import Table

from config.errors import InputError
from config.loader import load_robot, load_run, load_world, shipped

app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
    help="Run gaits on a DYNAMIXEL servo snake, or on a simulated one that answers the same bytes.",
)
console = Console(highlight=False)

RunName = Annotated[str, typer.Argument(help="shipped run, or a RUN.toml", show_default=True)]
Json = Annotated[bool, typer.Option("--json", help="print the result as JSON")]
Seed = Annotated[int | None, typer.Option(help="of every random choice")]
Motion = Annotated[str | None, typer.Option(help="walk, walk-printed, walk-blind or serpenoid")]


@app.command("list", epilog="Example: [bold]snakewalk list --json[/bold]")
def list_(as_json: Json = False) -> None:
    """List the shipped runs, robots and worlds."""
    rows = {
        "runs": [[n, f"{(r := load_run(n)).robot} on {r.world}"] for n in shipped("runs")],
        "robots": [
            [n, f"{(b := load_robot(n)).joint_count} {b.servo.model}, {b.length_m:.2f} m"]
            for n in shipped("robots")
        ],
        "worlds": [[n, load_world(n).ground.kind] for n in shipped("worlds")],
    }
    if as_json:
        print(json.dumps({kind: [name for name, _ in rs] for kind, rs in rows.items()}))
        return
    for kind, lines in rows.items():
        table = Table(title=kind, title_justify="left", box=None, show_header=False)
        for line in lines:
            table.add_row(f"  {line[0]}", line[1])
        console.print(table)


@app.command(
    epilog="Examples: [bold]snakewalk plan[/bold]   "
    "[bold]snakewalk plan flat-slalom --motion serpenoid --json[/bold]"
)
def plan(
    run: RunName = "flat-square", seed: Seed = None, motion: Motion = None, as_json: Json = False
) -> None:
    """Judge a run on paper: library, path and joint limits, with no servo and no simulator."""
    from controller.app.prepare import prepare  # noqa: PLC0415  heavy; --help stays quick

    prepared = prepare(run, seed=seed, motion=motion)
    ahead = prepared.forecast()
    found: dict[str, object] = {
        "run": prepared.run.name,
        "robot": prepared.robot.name,
        "motion": prepared.run.motion,
        "seed": prepared.run.seed,
        "waypoints": len(prepared.run.waypoints_m),
        "waypoints_reached": ahead.reached,
        "passed_by": ahead.missed,
        "path_m": round(prepared.path.length_m, 3),
        "duration_s": round(ahead.duration_s, 2),
        "joint_speed_rad_s": round(float(ahead.joint_speed_rad_s.max()), 3),
        "joint_reach_rad": round(float(abs(ahead.joint_rad).max()), 3),
        "predicted_gain": round(prepared.gain, 3),
    }
    if prepared.run.motion != "serpenoid":
        found["states"] = prepared.library.counts
    _show(found, as_json)


@app.command(
    epilog="Examples: [bold]snakewalk run[/bold]   "
    "[bold]snakewalk run flat-slalom --seed 3[/bold]   "
    "[bold]snakewalk run my-run.toml --port /dev/ttyUSB0[/bold]"
)
def run(
    run: RunName = "flat-square",
    port: Annotated[str | None, typer.Option(help="serial port; without it, the simulator")] = None,
    robot: Annotated[str | None, typer.Option(help="shipped robot or a TOML file")] = None,
    seed: Seed = None,
    motion: Motion = None,
    out: Annotated[Path | None, typer.Option(help="folder for log and summary")] = None,
    as_json: Json = False,
) -> None:
    """Run a job on servos or in the simulator; leaves a log and a summary."""
    from controller.app.execute import execute  # noqa: PLC0415  heavy; --help stays quick
    from controller.app.prepare import prepare  # noqa: PLC0415
    from controller.app.progress import PathProgress  # noqa: PLC0415

    prepared = prepare(run, seed=seed, motion=motion, robot=robot)
    name = f"{prepared.run.name}-{prepared.run.motion}-seed{prepared.run.seed}"
    folder = out if out is not None else Path("runs") / name
    with PathProgress(prepared.path.length_m, len(prepared.run.waypoints_m)) as progress:
        finished = execute(prepared, folder, port, (progress,))
    outcome = finished.outcome
    _show(
        {
            "run": name,
            "waypoints": len(prepared.run.waypoints_m),
            "waypoints_reached": outcome.reached,
            "duration_s": round(outcome.duration_s, 2),
            "tripped": outcome.tripped,
            "advance_alarms": outcome.alarms,
            "log": str(finished.log),
            "summary": str(folder / "summary.json"),
        },
        as_json,
    )
    if not outcome.complete(len(prepared.run.waypoints_m)):
        raise SystemExit(1)


@app.command(
    epilog="Example: [bold]snakewalk trials flat-slalom --seeds 10 --motion walk "
    "--motion serpenoid --json[/bold]"
)
def trials(
    run: RunName = "flat-square",
    seeds: Annotated[int, typer.Option(min=1, max=1000, help="runs a motion")] = 10,
    motion: Annotated[
        list[str] | None, typer.Option(help="may be given again; default: all")
    ] = None,
    workers: Annotated[int, typer.Option(min=1, help="processes")] = 2,
    as_json: Json = False,
) -> None:
    """Simulate a job over many seeds and motions, and tabulate what was reached."""
    from dataclasses import asdict  # noqa: PLC0415

    from controller.app.prepare import prepare  # noqa: PLC0415  heavy; --help stays quick
    from controller.app.trials import table  # noqa: PLC0415
    from controller.app.trials import trials as run_trials  # noqa: PLC0415

    motions = motion or ["walk", "walk-printed", "walk-blind", "serpenoid"]
    for name in motions:
        prepare(run, motion=name)  # refuse bad input before any process starts
    total = len(motions) * seeds
    found = []
    for done in track(
        run_trials(run, motions, seeds, workers),
        total=total,
        description=run,
        console=Console(stderr=True),
    ):
        found.append(done)
    rows = table(found)
    if as_json:
        print(json.dumps({"run": run, "table": rows, "trials": [asdict(t) for t in found]}))
        return
    shown = Table(*[key.replace("_", " ") for key in rows[0]], title=run)
    for row in rows:
        shown.add_row(*[str(value) for value in row.values()])
    console.print(shown)


def _show(found: dict[str, object], as_json: bool) -> None:
    if as_json:
        print(json.dumps(found))
        return
    table = Table(box=None, show_header=False)
    for key, value in found.items():
        text = ", ".join(f"{k} {v}" for k, v in value.items()) if isinstance(value, dict) else value
        table.add_row(key.replace("_", " "), str(text))
    console.print(table)


def main() -> None:
    """Run the command line; bad input ends with exit code 2 and one line per fault."""
    try:
        app()
    except InputError as error:
        for line in error.faults:
            print(f"snakewalk: {line}", file=sys.stderr)
        raise SystemExit(2) from None
    except OSError as error:
        print(f"snakewalk: {Path(str(error.filename or ''))}: {error.strerror}", file=sys.stderr)
        raise SystemExit(2) from None
