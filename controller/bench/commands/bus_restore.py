"""``snakewalk bus restore``: the values of a backup, where they differ."""

import json
from pathlib import Path
from typing import Annotated

import typer

from snakewalk.config.constants import DEFAULT_BAUD
from snakewalk.config.errors import InputError
from snakewalk.controller.bench.commands.bus_options import Baud, DryRun, Yes, confirmed
from snakewalk.controller.bench.eeprom_backup import RestoreJournal, load_backup, plan_all
from snakewalk.controller.bench.port_lines import open_lines
from snakewalk.controller.bench.servo_settings import apply
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import ChainPort, Json, console, print_table


@command(
    "bus restore",
    examples=("bus restore servos.json --dry-run", "bus restore servos.json --id 7 --yes"),
)
def restore(
    file: Annotated[Path, typer.Argument(help="file of `snakewalk bus backup`", dir_okay=False)],
    servo_id: Annotated[
        list[int] | None, typer.Option("--id", help="restore only this servo; may be repeated")
    ] = None,
    port: ChainPort = None,
    baud: Baud = DEFAULT_BAUD,
    dry_run: DryRun = False,
    yes: Yes = False,
    as_json: Json = False,
) -> None:
    """Write the values of a backup that differ; shows them and asks first.

    Checks all values before the first write. After an interruption the same command continues.
    """
    servos = {servo.id: servo for servo in load_backup(file).servos}
    chosen_ids = servo_id or list(servos)
    missing = [str(restored_id) for restored_id in chosen_ids if restored_id not in servos]
    if missing:
        raise InputError(
            f"{file}: has no ID {', '.join(missing)}; it has {', '.join(map(str, servos))}"
        )
    with open_lines(port, baud) as lines:
        buses = {restored_id: lines.open_servo(restored_id) for restored_id in chosen_ids}
        changed = plan_all(buses, servos)
        if not as_json:
            rows = [
                (restored_id, change.register, change.before, change.after)
                for restored_id, changes in changed.items()
                for change in changes
            ]
            if rows:
                print_table(("ID", "register", "now", "then"), rows)
            else:
                console.print("nothing to restore")
        written = (
            bool(changed)
            and not dry_run
            and (yes or confirmed("bus restore", "write this?", as_json=as_json))
        )
        journal = RestoreJournal(file)
        if written:
            journal.note(changed, {servo_id: buses[servo_id].table.model for servo_id in changed})
            typer.echo(f"if interrupted, undo: snakewalk bus restore {journal.path}", err=True)
            for changed_id, changes in changed.items():
                apply(buses[changed_id], changed_id, changes)
        if not dry_run and (written or not changed):
            journal.remove()
    if as_json:
        shown = {
            str(restored_id): {c.register: [c.before, c.after] for c in changes}
            for restored_id, changes in changed.items()
        }
        print(json.dumps({"changes": shown, "written": written}))
    elif changed:
        console.print("written and read back" if written else "nothing written")
