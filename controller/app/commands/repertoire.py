"""``snakewalk repertoire``: record actions from the physics, look at them, run a plan of them."""

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from config.errors import InputError
from controller.app.commands.common import Json, console, show

if TYPE_CHECKING:
    from controller.app.repertoire_job import RepertoireJob

Force = Annotated[bool, typer.Option("--force", help="overwrite files")]


def default_file(robot: str, world: str) -> Path:
    """Name of a repertoire where none is given."""
    return Path(f"repertoire-{Path(robot).stem}-{Path(world).stem}.npz")


def free(path: Path | None, force: bool) -> None:
    """Refuse to overwrite, or to write where there is no folder.

    Raises:
        InputError: one line.

    """
    if path is None:
        return
    if path.exists() and not force:
        raise InputError(f"{path}: exists; --force overwrites it")
    if not path.parent.is_dir():
        raise InputError(f"{path}: no such folder {path.parent}")


def record(
    robot: Annotated[str, typer.Option(help="shipped robot, or a TOML file")] = "yaw16",
    world: Annotated[str, typer.Option(help="shipped flat world, or a TOML file")] = "flat",
    out: Annotated[
        Path | None, typer.Option("-o", "--out", help="default: repertoire-ROBOT-WORLD.npz")
    ] = None,
    picture: Annotated[Path | None, typer.Option(help="draw the actions' ways here")] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Run forward, left and right actions on the physics and keep a settled cycle of each."""
    from config.loader import load_robot, load_world  # noqa: PLC0415  heavy; --help stays quick
    from controller.app.gait_picture import check_picture  # noqa: PLC0415
    from controller.app.repertoire_picture import draw_actions  # noqa: PLC0415
    from controller.app.repertoire_planning import flat  # noqa: PLC0415
    from controller.app.repertoire_recording import ACTIONS, record  # noqa: PLC0415

    body, ground = load_robot(robot), load_world(world)
    flat(ground)
    file = out or default_file(robot, world)
    free(file, force)
    free(picture, force)
    if picture is not None:
        check_picture(picture)
    with _progress() as progress:
        task = progress.add_task("record", total=float(len(ACTIONS)))
        begun: list[str] = []

        def told(name: str, share: float) -> None:
            if name not in begun:
                begun.append(name)
            progress.update(task, completed=len(begun) - 1 + share, description=name)

        repertoire = record(body, ground, told=told)
        progress.update(task, completed=float(len(ACTIONS)), description="recorded")
    repertoire.save(file)
    if picture is not None:
        draw_actions(repertoire, picture)
    _show_actions(file, as_json)


def show_file(
    file: Annotated[Path, typer.Argument(help="a repertoire")],
    picture: Annotated[Path | None, typer.Option(help="draw the actions' ways here")] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Show the actions of a repertoire: way, turn and closure error of a cycle."""
    from controller.app.gait_picture import check_picture  # noqa: PLC0415  heavy
    from controller.app.repertoire_picture import draw_actions  # noqa: PLC0415
    from controller.repertoire.repertoire import load_repertoire  # noqa: PLC0415

    repertoire = load_repertoire(file)
    if picture is not None:
        free(picture, force)
        check_picture(picture)
        draw_actions(repertoire, picture)
    _show_actions(file, as_json)


def run_plan(
    plan: Annotated[Path, typer.Argument(help="made by: snakewalk plan --with repertoire -o")],
    port: Annotated[str | None, typer.Option(help="serial port; without it, the simulator")] = None,
    open_loop: Annotated[
        bool, typer.Option("--open-loop", help="as planned, without looking where the body is")
    ] = False,
    film: Annotated[bool, typer.Option("--film/--no-film", help="draw a film of the run")] = True,
    picture: Annotated[Path | None, typer.Option(help="draw predicted and measured way")] = None,
    out: Annotated[Path | None, typer.Option(help="folder for log and summary")] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Run a plan on servos or in the simulator, and compare predicted with measured poses."""
    from controller.app.repertoire_planning import load_plan  # noqa: PLC0415  heavy

    free(picture, force)
    job = load_plan(plan, replan=not open_loop)
    found, complete = carry_out(job, port, out, film, picture)
    show({"plan": str(plan), **found}, as_json)
    if not complete and not open_loop:
        raise SystemExit(1)


def carry_out(
    job: "RepertoireJob", port: str | None, out: Path | None, film: bool, picture: Path | None
) -> tuple[dict[str, object], bool]:
    """Execute a job with a bar; what it did, and whether it reached every waypoint."""
    import numpy as np  # noqa: PLC0415  heavy; --help stays quick

    from controller.app.execute import execute  # noqa: PLC0415
    from controller.app.gait_picture import check_picture  # noqa: PLC0415
    from controller.app.gait_progress import GaitProgress  # noqa: PLC0415
    from controller.app.repertoire_job import WatchedJob  # noqa: PLC0415
    from controller.app.repertoire_picture import draw_way  # noqa: PLC0415
    from controller.app.report.leave import leave_report  # noqa: PLC0415
    from drivers.telemetry.reader import read_log  # noqa: PLC0415

    if picture is not None:
        check_picture(picture)
    how = "repertoire" if job.replan else "repertoire-open"
    folder = out if out is not None else Path("runs") / f"{job.run.name}-{job.robot.name}-{how}"
    watched = WatchedJob.of(job)
    with GaitProgress(job.run.name, job.route.duration_s) as progress:
        finished = execute(watched, folder, port, (progress,))
    follower = watched.kept
    left = leave_report(finished.log, folder, film=film)
    for line in left.notes:
        print(f"snakewalk: {line}", file=sys.stderr)
    if picture is not None:
        draw_way(job, read_log(finished.log), picture)
    cycle, route = follower.errors(), follower.route_errors()
    found: dict[str, object] = {
        "waypoints": len(job.run.waypoints_m),
        "waypoints_reached": finished.outcome.reached,
        "replanned": job.replan,
        "actions_planned": len(job.route.actions),
        "actions_run": len(follower.measured),
        "predicted_s": round(job.route.duration_s, 2),
        "duration_s": round(finished.outcome.duration_s, 2),
        "tripped": finished.outcome.tripped,
    }
    if len(cycle):
        found |= {
            "cycle_error_median_m": round(float(np.median(cycle[:, 0])), 4),
            "cycle_error_median_rad": round(float(np.median(cycle[:, 1])), 4),
        }
    if len(route) and not job.replan:
        found |= {
            "open_loop_error_max_m": round(float(route[:, 0].max()), 4),
            "open_loop_error_end_m": round(float(route[-1, 0]), 4),
            "open_loop_error_end_rad": round(float(route[-1, 1]), 4),
        }
    found |= {
        "log": str(finished.log),
        "report": None if left.report is None else str(left.report),
        "film": None if left.film is None else str(left.film),
    }
    whole = finished.outcome.complete(len(job.run.waypoints_m))
    return found, whole


def plan_with_repertoire(
    run: str,
    *,
    repertoire: Path | None,
    robot: str | None,
    world: str | None,
    beam: int,
    physics: int,
    out: Path | None,
    carry: bool,
    force: bool,
    as_json: bool,
) -> None:
    """Search, show, and where asked save, time on the physics, and run."""
    from config.loader import load_run  # noqa: PLC0415  heavy; --help stays quick
    from controller.app.repertoire_planning import plan_route, save_plan  # noqa: PLC0415
    from controller.app.repertoire_timing import search_cost  # noqa: PLC0415

    free(out, force)
    known = load_run(run)
    file = repertoire or default_file(robot or known.robot, world or known.world)
    job = plan_route(run, file, robot=robot, world=world, beam=beam)
    names = [segment.name for segment in job.repertoire.segments]
    found: dict[str, object] = {
        "run": job.run.name,
        "robot": job.robot.name,
        "world": job.world.name,
        "repertoire": str(file),
        "waypoints": len(job.run.waypoints_m),
        "waypoints_reached": job.route.reached,
        "duration_s": round(job.route.duration_s, 2),
        "candidates": job.route.candidates,
        "actions": [names[k] for k in job.route.actions],
    }
    if physics:
        with _progress() as progress:
            task = progress.add_task("candidates on the physics", total=physics)
            cost = search_cost(
                job, physics, beam=beam, told=lambda done: progress.update(task, completed=done)
            )
        found |= {
            "search_s": round(cost.candidates * cost.candidate_s, 4),
            "physics_candidates_run": cost.ran,
            "physics_search_s_extrapolated": round(cost.physics_search_s, 1),
            "times_quicker": round(cost.ratio),
        }
    complete = True
    if out is not None:
        save_plan(job, out)
        found["plan"] = str(out)
    if not as_json:
        found["actions"] = ", ".join(names[k] for k in job.route.actions)
    if carry:
        told, complete = carry_out(job, None, None, False, None)
        found["ran"] = told
    show(found, as_json)
    if not complete:
        raise SystemExit(1)


def _show_actions(file: Path, as_json: bool) -> None:
    from controller.repertoire.repertoire import load_repertoire  # noqa: PLC0415  heavy

    repertoire = load_repertoire(file)
    rows = [
        {
            "name": segment.name,
            "kind": segment.kind,
            "frames": segment.frames,
            "cycle_s": round(segment.duration_s, 3),
            "speed_m_s": round(segment.speed_m_s, 4),
            "turn_rad_cycle": round(segment.turn_rad_s * segment.duration_s, 4),
            "closure_mm": round(1e3 * segment.closure_m, 3),
            "closure_mrad": round(1e3 * segment.closure_rad, 3),
        }
        for segment in repertoire.segments
    ]
    if as_json:
        about = {"file": str(file), "robot": repertoire.robot, "world": repertoire.world}
        print(json.dumps(about | {"actions": rows}))
        return
    table = Table(box=None, pad_edge=False)
    for title in rows[0]:
        table.add_column(
            title.replace("_", " "),
            justify="left" if title == "name" else "right",
            no_wrap=title == "name",
        )
    for row in rows:
        table.add_row(*(str(value) for value in row.values()))
    console.print(f"{file}: {repertoire.robot} on {repertoire.world}")
    console.print(table)


def _progress() -> Progress:
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TimeElapsedColumn(),
        console=Console(stderr=True),
    )
