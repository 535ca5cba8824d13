"""``snakewalk bus backup``: the EEPROM of all servos in a file."""

from pathlib import Path
from typing import Annotated

import typer

from snakewalk.config.constants import DEFAULT_BAUD
from snakewalk.controller.bench.commands.bus_options import Baud
from snakewalk.controller.bench.eeprom_backup import back_up_all, backup_text
from snakewalk.controller.bench.port_lines import open_lines
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import ChainPort, Force, Json, show
from snakewalk.controller.console.result_files import write_result


@command(
    "bus backup",
    examples=("bus backup -o servos.json", "bus backup --baud 57600 -o one.json"),
    results=("out",),
)
def backup(
    out: Annotated[Path, typer.Option("--out", "-o", help="write the backup to this file (.json)")],
    port: ChainPort = None,
    baud: Baud = DEFAULT_BAUD,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Write the EEPROM of all servos on the bus into a file; changes nothing."""
    with open_lines(port, baud) as lines:
        backup_data = back_up_all(lines, lambda step: typer.echo(step, err=True))
    write_result(out, backup_text(backup_data))
    show({"servos": [servo.id for servo in backup_data.servos], "backup": str(out)}, as_json)
