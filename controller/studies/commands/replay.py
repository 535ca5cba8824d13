"""``snakewalk log replay``: a log run again on the simulator."""

import json
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated

import typer

from snakewalk.config.errors import InputError
from snakewalk.config.extras import require_extra
from snakewalk.controller.console.command import command
from snakewalk.controller.console.opened_log import open_log
from snakewalk.controller.console.options import Force, Json, RunLog, console
from snakewalk.controller.console.progress import ProgressBar
from snakewalk.controller.console.result_files import refuse_to_overwrite
from snakewalk.controller.runlog.reader import read_log
from snakewalk.controller.studies import replay as replaying


@command("log replay", examples=("log replay runs/flat-square-walk-seed0/log.mcap --json",))
def replay(
    log: RunLog,
    tolerance_rad: Annotated[
        float,
        typer.Option(
            min=0.0, help="tolerance of a measured joint in rad; default: one encoder step"
        ),
    ] = 0.0016,
    tolerance_m: Annotated[
        float,
        typer.Option(
            min=0.0, help="tolerance of the head's position in metres, if its pose was measured"
        ),
    ] = 0.002,
    out: Annotated[Path | None, typer.Option(help="write the log of the replay here")] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Send a log's commands to simulated servos again; exit code 1 if the replies differ."""
    if out is not None and out.resolve() == log.resolve():
        raise InputError(f"{out}: is the log itself; give another name")
    refuse_to_overwrite([out], force)

    require_extra("a replay needs", "mujoco")
    record = open_log(log)
    with TemporaryDirectory() as folder, ProgressBar("replay") as bar:
        file = Path(folder) / "replay.mcap" if out is None else out
        again = read_log(replaying.replay(record, file, on_progress=bar.update))
    comparison = replaying.differences(record, again, tolerance_rad, tolerance_m)
    if as_json:
        print(
            json.dumps({"log": str(log), "backend": record.header.backend} | comparison.to_dict())
        )
    else:
        for line in comparison.lines():
            console.print(line)
    if not comparison.is_equal:
        raise SystemExit(1)
