"""``snakewalk bus set``: ID, baud rate and limits of one servo."""

import json
import sys
from typing import Annotated

import typer
from rich.table import Table

from snakewalk.controller.app.cli.options import Json, Port, console


def bus_set(
    servo_id: Annotated[int, typer.Option("--id", help="the servo, 0 to 252")],
    port: Port = None,
    baud: Annotated[int, typer.Option(help="at which it answers now")] = 1_000_000,
    new_id: Annotated[int | None, typer.Option(help="0 to 252")] = None,
    new_baud: Annotated[int | None, typer.Option(help="bit/s")] = None,
    min_position: Annotated[float | None, typer.Option(help="rad, 0 is straight")] = None,
    max_position: Annotated[float | None, typer.Option(help="rad, 0 is straight")] = None,
    current_limit: Annotated[float | None, typer.Option(help="A")] = None,
    temperature_limit: Annotated[float | None, typer.Option(help="C")] = None,
    voltage_min: Annotated[float | None, typer.Option(help="V")] = None,
    voltage_max: Annotated[float | None, typer.Option(help="V")] = None,
    return_delay: Annotated[float | None, typer.Option(help="us")] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="show the changes, no more")] = False,
    yes: Annotated[bool, typer.Option("--yes", "-y", help="write without asking")] = False,
    as_json: Json = False,
) -> None:
    """Change settings of one servo that outlive its power; shows them and asks first."""
    from snakewalk.controller.app.service.scan import pick_port  # noqa: PLC0415  --help stays quick
    from snakewalk.controller.app.service.servo_settings import (  # noqa: PLC0415
        Wish,
        apply,
        as_dict,
        open_servo,
        plan,
    )
    from snakewalk.drivers.errors import ControlTableError  # noqa: PLC0415
    from snakewalk.drivers.port.serial_port import SerialPort  # noqa: PLC0415
    from snakewalk.drivers.protocol.registers import BAUDS  # noqa: PLC0415

    if baud not in BAUDS:
        raise ControlTableError(f"--baud {baud}: servos have {', '.join(map(str, BAUDS))}")
    wish = Wish(
        new_id=new_id,
        new_baud=new_baud,
        min_position_rad=min_position,
        max_position_rad=max_position,
        current_limit_a=current_limit,
        temperature_limit_c=temperature_limit,
        voltage_min_v=voltage_min,
        voltage_max_v=voltage_max,
        return_delay_us=return_delay,
    )
    with SerialPort(pick_port(port), baud) as line:
        bus = open_servo(line, servo_id, line.latency_s)
        changes = plan(bus, servo_id, wish)
        if not as_json:
            _show(servo_id, bus.table.model, changes)
        written = bool(changes) and not dry_run and (yes or _confirmed(as_json))
        if written:
            apply(bus, servo_id, changes)
    if as_json:
        print(json.dumps(as_dict(servo_id, changes, written)))
    elif changes:
        console.print("written and read back" if written else "nothing written")


def _show(servo_id: int, model: str, changes: tuple[object, ...]) -> None:
    from snakewalk.controller.app.service.servo_settings import Change  # noqa: PLC0415

    if not changes:
        console.print(f"servo {servo_id} ({model}): nothing to change")
        return
    table = Table(f"servo {servo_id} ({model})", "now", "then", "", box=None)
    for change in changes:
        assert isinstance(change, Change)
        table.add_row(change.register, str(change.before), str(change.after), change.meaning)
    console.print(table)


def _confirmed(as_json: bool) -> bool:
    """Ask a person, if there is one."""
    if as_json or not sys.stdin.isatty():
        print("snakewalk: nothing written; say --yes to write without asking", file=sys.stderr)
        return False
    return typer.confirm("write this?", default=False)
