"""``snakewalk repertoire``: record actions from the physics, look at them, run a plan of them."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from snakewalk.config.extras import require_extra
from snakewalk.config.loader import load_robot, load_world
from snakewalk.controller.console import completion
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import (
    VIEW_AT,
    Film,
    Force,
    GivenRobot,
    Json,
    Ros,
    RunFolder,
    RunPort,
    View,
    ViewAt,
    console,
    show,
)
from snakewalk.controller.console.progress import ProgressBar, TimeBar, in_real_time
from snakewalk.controller.console.result_files import (
    atomic_write,
    check_picture,
    refuse_to_overwrite,
    run_folder,
)
from snakewalk.controller.repertoire.repertoire import load_repertoire
from snakewalk.controller.repertoire.repertoire_planning import default_file, flat, load_plan
from snakewalk.controller.repertoire.repertoire_run import run_name, run_route
from snakewalk.controller.run.finish import write_artifacts
from snakewalk.controller.run.watchers import watched

if TYPE_CHECKING:
    from snakewalk.controller.repertoire.repertoire import Repertoire
    from snakewalk.controller.repertoire.repertoire_run import RepertoireRun
    from snakewalk.controller.run.watchers import Watchers

Picture = Annotated[Path | None, typer.Option(help="draw the actions' ways here")]


@command(
    "repertoire record", examples=("repertoire record", "repertoire record -o yaw16.npz --json")
)
def record(
    robot: GivenRobot = "yaw16",
    world: Annotated[
        str,
        typer.Option(help="shipped flat world, or a TOML file", autocompletion=completion.WORLDS),
    ] = "flat",
    out: Annotated[
        Path | None, typer.Option("-o", "--out", help="default: repertoire-ROBOT-WORLD.npz")
    ] = None,
    picture: Picture = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Run forward, left and right actions on the physics and keep a settled cycle of each."""
    check_picture(picture)
    refuse_to_overwrite([out, picture], force)

    from snakewalk.controller.repertoire.repertoire_recording import ACTIONS, record  # noqa: PLC0415

    body, ground = load_robot(robot), load_world(world)
    flat(ground)
    file = out or default_file(robot, world)
    refuse_to_overwrite([file, picture], force)
    require_extra("recording needs", "mujoco")
    with ProgressBar("record", float(len(ACTIONS))) as bar:
        begun: list[str] = []

        def on_progress(name: str, share: float) -> None:
            if name not in begun:
                begun.append(name)
            bar.update(len(begun) - 1 + share, description=name)

        repertoire = record(body, ground, on_progress=on_progress)
        bar.update(float(len(ACTIONS)), description="recorded")
    with atomic_write(file) as part:
        repertoire.save(part)
    if picture is not None:
        from snakewalk.controller.repertoire import repertoire_plots as plots  # noqa: PLC0415

        plots.draw_actions(repertoire, picture)
    _show_actions(file, repertoire, as_json)


@command("repertoire show", examples=("repertoire show repertoire-yaw16-flat.npz",))
def show_file(
    file: Annotated[Path, typer.Argument(help="a repertoire")] = Path("repertoire-yaw16-flat.npz"),
    picture: Picture = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Show the actions of a repertoire: speed, turn and closure error of a cycle."""
    refuse_to_overwrite([picture], force)
    check_picture(picture)

    repertoire = load_repertoire(file)
    if picture is not None:
        from snakewalk.controller.repertoire import repertoire_plots as plots  # noqa: PLC0415

        plots.draw_actions(repertoire, picture)
    _show_actions(file, repertoire, as_json)


@command(
    "repertoire run",
    examples=("repertoire run plan.json", "repertoire run plan.json --open-loop --json"),
)
def run_plan(
    plan: Annotated[Path, typer.Argument(help="made by: snakewalk plan --with repertoire -o")],
    port: RunPort = None,
    open_loop: Annotated[
        bool, typer.Option("--open-loop", help="as planned, without looking where the body is")
    ] = False,
    view: View = False,
    view_at: ViewAt = VIEW_AT,
    ros: Ros = False,
    film: Film = True,
    picture: Annotated[Path | None, typer.Option(help="draw predicted and measured way")] = None,
    out: RunFolder = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Run a plan on servos or in the simulator, and compare predicted with measured poses."""
    refuse_to_overwrite([picture], force)

    job = load_plan(plan, replan=not open_loop)
    with watched(view, view_at, ros) as watchers:
        found, complete = carry_out(job, port, out, film, picture, force, watchers)
    show({"plan": str(plan), **found}, as_json)
    if not complete and not open_loop:
        raise SystemExit(1)


def carry_out(
    job: "RepertoireRun",
    port: str | None,
    out: Path | None,
    film: bool,
    picture: Path | None,
    force: bool,
    watchers: "Watchers | None" = None,
) -> tuple[dict[str, object], bool]:
    """Execute a job with a bar; what it did, and whether it reached every waypoint."""
    check_picture(picture)
    with (
        run_folder(run_name(job), out) as folder,
        TimeBar(job.run.name, job.route.duration_s) as progress,
    ):
        paced = watchers is not None and port is None
        on_progress = in_real_time(progress.on_progress) if paced else progress.on_progress
        ran = run_route(job, folder, port, on_progress, force=force, view=watchers)
    finished = ran.finished
    artifacts = write_artifacts(finished.record, folder, finished.summary, film=film)
    if picture is not None:
        from snakewalk.controller.repertoire import repertoire_plots as plots  # noqa: PLC0415

        plots.draw_route(job, finished.record, picture)
    return ran.to_dict() | {"log": str(finished.log)} | artifacts.to_dict(), ran.complete


def _show_actions(file: Path, repertoire: "Repertoire", as_json: bool) -> None:
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
    heads = {
        "cycle_s": "cycle\ns",
        "speed_m_s": "speed\nm/s",
        "turn_rad_cycle": "turn, rad\na cycle",
    }
    heads |= {"closure_mm": "closure\nmm", "closure_mrad": "closure\nmrad"}
    table = Table(box=None, pad_edge=False)
    for key in rows[0]:
        name = key == "name"
        table.add_column(heads.get(key, key), justify="left" if name else "right", no_wrap=name)
    for row in rows:
        table.add_row(*(str(value) for value in row.values()))
    console.print(f"{file}: {repertoire.robot} on {repertoire.world}")
    console.print(table)
