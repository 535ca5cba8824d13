"""``snakewalk stop``: options that ``emergency_stop.stop_now`` does not understand by itself."""

from typing import Annotated

import typer

from snakewalk.controller.bench.emergency_stop import Stop
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import Json


@command(
    "stop",
    examples=("stop", "stop --port /dev/ttyUSB0 --json", "stop runs/flat-square-walk-seed0"),
)
def stop(
    run: Annotated[
        str | None,
        typer.Argument(
            help="name, folder or process of a run; without it the command stops all your runs "
            "that hold a port, else your newest simulated run, else the servos on the only serial "
            "adapter",
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
    raise SystemExit(Stop(run, port, baud or [], as_json).carry_out())
