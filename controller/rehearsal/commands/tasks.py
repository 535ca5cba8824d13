"""``snakewalk trials tasks``: controllers on twelve tasks, as one table."""

import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from snakewalk.config.extras import require_extra
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import (
    FirstSeed,
    Json,
    Seeds,
    Workers,
    console,
    print_table,
)
from snakewalk.controller.console.pool import each
from snakewalk.controller.console.progress import show_progress
from snakewalk.controller.rehearsal.result_lines import append_lines, read_lines
from snakewalk.controller.rehearsal.tasks import (
    CONTROLLERS,
    TASKS,
    TRACKER,
    ControllerTask,
    TaskResult,
    TaskRun,
    run_task,
    task_named,
)


@command(
    "trials tasks",
    examples=(
        "trials tasks --conditions",
        "trials tasks slalom pegs --controller walk --controller gait --json",
        "trials tasks --controller my_motion -o mine.jsonl",
    ),
)
def tasks(
    names: Annotated[
        list[str] | None, typer.Argument(help="tasks to run; default: all", metavar="TASK")
    ] = None,
    controller: Annotated[
        list[str] | None,
        typer.Option(
            help="walk, serpenoid, gait, cpg, a policy, or the motion of a plug-in; may be "
            "repeated; default: all built-in ones"
        ),
    ] = None,
    seeds: Seeds = 1,
    first_seed: FirstSeed = 0,
    conditions: Annotated[
        bool, typer.Option("--conditions", help="list the tasks and their conditions; run nothing")
    ] = False,
    workers: Workers = 1,
    out: Annotated[
        Path,
        typer.Option(
            "--out",
            "-o",
            dir_okay=False,
            help="write the results here as JSON lines; runs that it contains are skipped",
        ),
    ] = Path("tasks.jsonl"),
    as_json: Json = False,
) -> None:
    """Run controllers on twelve tasks with stated conditions; list what the body truly did."""
    chosen = [task_named(name) for name in names or ()] or list(TASKS)
    if conditions:
        _print_conditions(chosen, as_json)
        return
    require_extra("tasks need", "mujoco")
    by = controller or list(CONTROLLERS)
    planned = [
        TaskRun(task.name, controller_name, seed)
        for seed in range(first_seed, first_seed + seeds)
        for task in chosen
        for controller_name in by
    ]
    lines = read_lines(out, lambda row: TaskResult(**row), "a result of a task")
    results = {TaskRun(row.task, row.controller, row.seed): row for row in lines}
    missing = [item for item in planned if item not in results]
    finished = show_progress(
        each(run_task, missing, workers=workers),
        str(out),
        len(planned),
        done=len(planned) - len(missing),
    )
    for item, result in append_lines(out, finished, asdict):
        results[item] = result
    rows = [results[item] for item in planned]
    if as_json:
        print(json.dumps({"tasks": [asdict(row) for row in rows], "file": str(out)}))
    else:
        _print(rows, chosen, by)


def _print(rows: Sequence[TaskResult], chosen: Sequence[ControllerTask], by: Sequence[str]) -> None:
    def share(name: str, by_name: str) -> str:
        return cell([row for row in rows if (row.task, row.controller) == (name, by_name)])

    cells = [(task.name, *(share(task.name, by_name) for by_name in by)) for task in chosen]
    print_table(("task", *by), cells)
    console.print("share of the task, mean duration; - : the controller does not fit the task")


def cell(rows: Sequence[TaskResult]) -> str:
    """Return the text of one cell of the table: mean share and duration over the seeds."""
    ran = [row for row in rows if row.share is not None]
    if not ran:
        return "-"
    share = sum(row.share or 0.0 for row in ran) / len(ran)
    seconds = sum(row.duration_s or 0.0 for row in ran) / len(ran)
    tripped = sum(row.is_tripped for row in ran)
    return f"{share:.2f} {seconds:.0f} s" + (f", {tripped} tripped" if tripped else "")


def condition(task: ControllerTask) -> dict[str, object]:
    """Return the conditions of a task: goal, world, friction, robot, servo model and noise."""
    run, robot, world = task.parts()
    goal = (
        f"{task.distance_m:g} m along {task.axis}"
        if run is None
        else f"{len(run.waypoints_m)} waypoints within {run.waypoint_radius_m:g} m"
    )
    noise = (
        f"pose {TRACKER.noise_m:g} m, {TRACKER.noise_deg:g} deg, {TRACKER.delay_s:g} s late; "
        "errors of friction, mass, one servo and horns"
        if task.is_rehearsed
        else "encoders only; true pose"
    )
    return {
        "task": task.name,
        "goal": goal,
        "seconds": task.seconds,
        "world": world.name,
        "along": world.friction.along,
        "across": world.friction.across,
        "robot": robot.name,
        "servo": robot.servo.model,
        "gait": task.gait,
        "noise": noise,
    }


def _print_conditions(chosen: Sequence[ControllerTask], as_json: bool) -> None:
    rows = [condition(task) for task in chosen]
    if as_json:
        print(json.dumps({"conditions": rows}))
        return
    print_table(rows[0], (row.values() for row in rows))
