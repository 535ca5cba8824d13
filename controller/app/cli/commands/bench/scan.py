"""``snakewalk scan``: who is on the bus."""

import json
from typing import Annotated

import typer
from rich.table import Table

from snakewalk.controller.app.cli.options import Json, Port, console
from snakewalk.controller.app.messages import stderr_console


def scan(
    port: Port = None,
    baud: Annotated[
        list[int] | None, typer.Option(help="only this rate, may be given again; default: all")
    ] = None,
    as_json: Json = False,
) -> None:
    """List the servos on a bus, at every baud rate; changes nothing."""
    from snakewalk.controller.app.service import scan as scanning  # noqa: PLC0415  --help stays quick
    from snakewalk.drivers.port.network_port import open_port  # noqa: PLC0415

    scanning.check_bauds(baud or ())
    device = scanning.pick_port(port)
    with (
        open_port(device, baud[0] if baud else 1_000_000) as line,
        stderr_console().status("") as status,
    ):
        results = scanning.scan(line, baud or (), lambda step: status.update(f"{device}: {step}"))
    if as_json:
        print(json.dumps({"port": device, "servos": [servo.to_dict() for servo in results]}))
    elif results:
        table = Table("ID", "model", "firmware", "baud", box=None)
        for servo in results:
            table.add_row(str(servo.servo_id), servo.model, str(servo.firmware), str(servo.baud))
        console.print(table)
        for servo in results:
            if servo.secondary_id is not None:
                console.print(
                    f"servo {servo.servo_id} obeys ID {servo.secondary_id} as well: its "
                    "Secondary ID(12); a run sets it to 255"
                )
    else:
        console.print(f"{device}: nobody answers at any baud rate: power? cable? adapter's switch?")
    if not results:
        raise SystemExit(1)
