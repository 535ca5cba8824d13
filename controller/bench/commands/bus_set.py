"""``snakewalk bus set``: settings of a servo that outlive its power."""

import json
from typing import Annotated

import typer

from snakewalk.config.constants import DEFAULT_BAUD
from snakewalk.controller.bench.commands.bus_options import Baud, DryRun, Yes, confirmed
from snakewalk.controller.bench.fingerprints import fingerprint_file, note_changes
from snakewalk.controller.bench.port_lines import open_lines
from snakewalk.controller.bench.servo_settings import (
    SettingChange,
    SettingsRequest,
    SettingsResult,
    apply,
    plan,
)
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import ChainPort, Json, console, print_table
from snakewalk.drivers.errors import ControlTableError
from snakewalk.drivers.protocol.registers import BAUDS


@command(
    "bus set",
    examples=(
        "bus set --id 1 --baud 57600 --new-id 7 --new-baud 1000000 --dry-run",
        "bus set --id 7 --return-delay 0 --yes",
        "bus set --id 7 --register 'Angular Resolution=1'",
    ),
)
def bus_set(
    servo_id: Annotated[int, typer.Option("--id", help="ID of the servo, 0 to 252")],
    port: ChainPort = None,
    baud: Baud = DEFAULT_BAUD,
    new_id: Annotated[int | None, typer.Option(help="new ID, 0 to 252")] = None,
    new_baud: Annotated[int | None, typer.Option(help="new baud rate in bit/s")] = None,
    min_position: Annotated[
        float | None, typer.Option(help="lower position limit in rad; 0 is straight")
    ] = None,
    max_position: Annotated[
        float | None, typer.Option(help="upper position limit in rad; 0 is straight")
    ] = None,
    current_limit: Annotated[float | None, typer.Option(help="current limit in A")] = None,
    temperature_limit: Annotated[
        float | None, typer.Option(help="temperature limit in degrees C")
    ] = None,
    voltage_min: Annotated[float | None, typer.Option(help="lower voltage limit in V")] = None,
    voltage_max: Annotated[float | None, typer.Option(help="upper voltage limit in V")] = None,
    return_delay: Annotated[float | None, typer.Option(help="return delay time in us")] = None,
    register: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=VALUE", help="raw value of another setting; may be repeated"),
    ] = None,
    robot: Annotated[
        str | None, typer.Option(help="robot whose fingerprint file to update")
    ] = None,
    dry_run: DryRun = False,
    yes: Yes = False,
    as_json: Json = False,
) -> None:
    """Change settings of one servo that persist without power; shows them and asks first."""
    if baud not in BAUDS:
        raise ControlTableError(f"--baud {baud}: servos have {', '.join(map(str, BAUDS))}")
    request = SettingsRequest(
        new_id=new_id,
        new_baud=new_baud,
        min_position_rad=min_position,
        max_position_rad=max_position,
        current_limit_a=current_limit,
        temperature_limit_c=temperature_limit,
        voltage_min_v=voltage_min,
        voltage_max_v=voltage_max,
        return_delay_us=return_delay,
        registers=tuple(register or ()),
    )
    file = None if robot is None else fingerprint_file(robot, "--robot")
    with open_lines(port, baud) as lines:
        bus = lines.open_servo(servo_id)
        changes = plan(bus, servo_id, request)
        if not as_json:
            _show(servo_id, bus.table.model, changes)
        written = (
            bool(changes)
            and not dry_run
            and (yes or confirmed("bus set", "write this?", as_json=as_json))
        )
        if written:
            apply(bus, servo_id, changes)
            if file is not None and not note_changes(file, servo_id, changes):
                warn = f"{file.path}: has no servo {servo_id}; the next start adds it"
                typer.echo(warn, err=True)
    if as_json:
        print(json.dumps(SettingsResult(servo_id, changes, written).to_dict()))
    elif changes:
        console.print("written and read back" if written else "nothing written")


def _show(servo_id: int, model: str, changes: tuple[SettingChange, ...]) -> None:
    if not changes:
        console.print(f"servo {servo_id} ({model}): nothing to change")
        return
    print_table(
        (f"servo {servo_id} ({model})", "now", "then", ""),
        ((change.register, change.before, change.after, change.meaning) for change in changes),
    )
