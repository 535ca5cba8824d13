"""``snakewalk log export``: a run's log for other programs."""

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from snakewalk.config.errors import InputError
from snakewalk.config.extras import require_extra
from snakewalk.controller.console.command import command
from snakewalk.controller.console.opened_log import open_log
from snakewalk.controller.console.options import Force, Json, RunLog, console
from snakewalk.controller.console.result_files import atomic_write, refuse_to_overwrite
from snakewalk.controller.exchange.flat_table import (
    flat_tables,
    write_csv,
    write_parquet,
)
from snakewalk.controller.exchange.foxglove_scene import write_foxglove_scene
from snakewalk.controller.exchange.ros_bag import write_ros_bag
from snakewalk.controller.runlog.column import registered_tables


@command(
    "log export",
    examples=(
        "log export runs/flat-square-walk-seed0/log.mcap --csv tables",
        "log export runs/flat-square-walk-seed0/log.mcap --parquet tables --foxglove body.mcap",
        "log export runs/flat-square-walk-seed0/log.mcap --ros2 bag.mcap --json",
    ),
)
def export(
    log: RunLog,
    csv: Annotated[
        Path | None,
        typer.Option(file_okay=False, help="write CSV tables into this folder, one per channel"),
    ] = None,
    parquet: Annotated[
        Path | None,
        typer.Option(
            file_okay=False, help="write Parquet tables into this folder, one per channel"
        ),
    ] = None,
    ros2: Annotated[
        Path | None,
        typer.Option(dir_okay=False, help="write a ROS 2 bag, FILE.mcap", metavar="FILE"),
    ] = None,
    foxglove: Annotated[
        Path | None,
        typer.Option(
            dir_okay=False, help="write a file for Foxglove in 3-D, FILE.mcap", metavar="FILE"
        ),
    ] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Write a run's log as tables, as a ROS 2 bag, or for Foxglove with the body in 3-D."""
    _check_names(log, csv, parquet, ros2, foxglove)
    tables_in = [(csv, "csv", write_csv), (parquet, "parquet", write_parquet)]
    results = {file for folder, ending, _ in tables_in for file in _tables(folder, ending)}
    refuse_to_overwrite([*sorted(results), ros2, foxglove], force)
    record = open_log(log)
    tables = flat_tables(record)
    writers: dict[Path, Callable[[Path], int | dict[str, int]]] = {}
    for folder, ending, write in tables_in:
        if folder is not None:
            writers |= {folder / f"{t.name}.{ending}": partial(write, t) for t in tables}
    if ros2 is not None:
        writers[ros2] = partial(write_ros_bag, record)
    if foxglove is not None:
        writers[foxglove] = partial(write_foxglove_scene, record)
    written: dict[str, int | dict[str, int]] = {}
    for file, write_to in writers.items():
        with atomic_write(file) as part:
            written[str(file)] = write_to(part)
    if as_json:
        print(json.dumps({"log": str(log), "written": written}))
        return
    for name, count in written.items():
        what = f"{count} rows" if isinstance(count, int) else f"{sum(count.values())} messages"
        console.print(f"{name}  {what}")


def _tables(folder: Path | None, ending: str) -> list[Path]:
    """Return the files of all tables in a folder, or the folder if it does not exist."""
    if folder is None:
        return []
    if not folder.exists():
        return [folder]
    return [folder / f"{table.topic.table_name}.{ending}" for table in registered_tables()]


def _check_names(
    log: Path, csv: Path | None, parquet: Path | None, ros2: Path | None, foxglove: Path | None
) -> None:
    """Refuse what cannot be written, before the log is read.

    Raises:
        InputError: nothing is asked for, a name is wrong, or a package is missing.

    """
    bags = [path for path in (ros2, foxglove) if path is not None]
    if not bags and csv is None and parquet is None:
        raise InputError(
            "choose what to write: --csv FOLDER, --parquet FOLDER, --ros2 FILE.mcap or "
            "--foxglove FILE.mcap"
        )
    faults = [
        f"{path}: is an MCAP file; name it {path.with_suffix('.mcap').name}"
        for path in bags
        if path.suffix != ".mcap"
    ]
    faults += [
        f"{path}: is the log itself; give another name"
        for path in bags
        if path.exists() and log.exists() and path.samefile(log)
    ]
    if faults:
        raise InputError(faults)
    if parquet is not None:
        require_extra("Parquet needs", "pyarrow")
    if ros2 is not None:
        require_extra("a ROS 2 bag needs", "rosbags")
