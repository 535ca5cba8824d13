"""``snakewalk stop``: stop a run from another terminal, or switch torque off on a free port."""

import json
import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated

import typer

from snakewalk.config.errors import InputError
from snakewalk.controller.bench import emergency_stop
from snakewalk.controller.bench.scan import check_bauds, pick_port
from snakewalk.controller.bench.torque_off import torque_off
from snakewalk.controller.console.command import command
from snakewalk.controller.console.messages import stderr_console
from snakewalk.controller.console.options import Json, console
from snakewalk.drivers.errors import PortError
from snakewalk.drivers.port.port_map import is_port_map, ports_in

if TYPE_CHECKING:
    from snakewalk.controller.bench.emergency_stop import StopOutcome


@command(
    "stop",
    examples=("stop", "stop --port /dev/ttyUSB0 --json", "stop runs/flat-square-walk-seed0"),
)
def stop(
    run: Annotated[
        str | None,
        typer.Argument(
            help="name, folder or process of a run; default: all your runs on this machine that "
            "hold a port, else the newest simulated run",
            show_default=False,
        ),
    ] = None,
    port: Annotated[
        str | None,
        typer.Option(help="stop the run that holds this serial port (or URL), or the servos on it"),
    ] = None,
    baud: Annotated[
        list[int] | None,
        typer.Option(
            help="baud rate of a port that no program holds; may be repeated; default: all"
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """Stop a run at once; without a run, switch off the servos of a port.

    The stop is latched. Without a run, all servos on the port lose their torque.
    """
    if run is not None and port is not None:
        raise InputError("stop: a run and --port exclude each other; leave one out")
    who = f"snakewalk stop (process {os.getpid()})"
    outcomes = emergency_stop.stop_runs(emergency_stop.runs_of(port, run), who)
    if run is not None and not outcomes:
        raise InputError(f"{run}: no such run is under way")
    devices = _free_ports(port) if not outcomes else []
    # a run that was killed leaves its servos holding
    devices += [port for each in outcomes if not each.safe for port in each.ports]
    if devices:
        outcomes += _torque_off(devices, baud or ())
    stopped = {name for each in outcomes if each.safe for name in each.names}
    safe = all(name in stopped for each in outcomes for name in each.names)
    if as_json:
        print(json.dumps({"safe": safe, "stopped": [each.to_dict() for each in outcomes]}))
    else:
        for each in outcomes:
            after = "" if each.after_s is None else f" after {each.after_s * 1e3:.0f} ms"
            console.print(f"{each.what}: {each.how}{after}: {each.text}")
    if not safe:
        raise SystemExit(1)


def _free_ports(port: str | None) -> list[str]:

    if port is not None and is_port_map(port):
        return ports_in(port)
    try:
        return [pick_port(port)]
    except PortError as fault:
        raise PortError(f"nothing to stop: no run is under way; {fault}") from None


def _torque_off(devices: Sequence[str], bauds: Sequence[int]) -> "list[StopOutcome]":

    check_bauds(bauds)
    with stderr_console().status("") as status:
        return [torque_off(device, bauds, status.update) for device in devices]
