"""``snakewalk replay``: a log run again on the simulator, and where it differs."""

import json
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn

from snakewalk.config.extras import require_extra
from snakewalk.controller.app.cli.options import Json, console


def replay(
    log: Annotated[Path, typer.Argument(help="log.mcap of a run, simulated or on metal")],
    tolerance_rad: Annotated[
        float, typer.Option(min=0.0, help="of a measured joint; default: one encoder step")
    ] = 0.0016,
    tolerance_m: Annotated[
        float, typer.Option(min=0.0, help="of the head, where its pose was measured")
    ] = 0.002,
    out: Annotated[Path | None, typer.Option(help="keep the replay's log here")] = None,
    as_json: Json = False,
) -> None:
    """Send a log's commands to simulated servos again; exit code 1 where the answers differ."""
    from snakewalk.controller.app.studies.replay import differences  # noqa: PLC0415  heavy
    from snakewalk.controller.app.studies.replay import replay as run_again  # noqa: PLC0415
    from snakewalk.controller.runlog.reader import read_log  # noqa: PLC0415

    require_extra("a replay needs", "mujoco")
    record = read_log(log)
    if record.note:
        print(f"snakewalk: {log}: {record.note}", file=sys.stderr)
    with (
        TemporaryDirectory() as folder,
        Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            TaskProgressColumn(),
            TimeElapsedColumn(),
            console=Console(stderr=True),
        ) as progress,
    ):
        task = progress.add_task("replay", total=len(record.cycle.time_s))
        again = run_again(
            record,
            Path(folder) / "replay.mcap" if out is None else out,
            lambda done, of: progress.update(task, completed=done, total=of),
        )
        found = differences(record, read_log(again), tolerance_rad, tolerance_m)
    if as_json:
        print(json.dumps({"log": str(log), "backend": record.header.backend} | found.as_dict()))
    else:
        for line in found.lines():
            console.print(line)
    if not found.same:
        raise SystemExit(1)
