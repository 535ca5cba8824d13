"""``snakewalk bus blink``: finds servos by their LED."""

from typing import Annotated

import typer

from snakewalk.config.constants import DEFAULT_BAUD
from snakewalk.controller.bench.commands.bus_options import Baud, Ids
from snakewalk.controller.bench.port_lines import open_lines
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import ChainPort, Json, show

_BLINK_S = 0.3
"""Time for which a LED is on, and then off."""


@command("bus blink", examples=("bus blink --id 7 --times 10",))
def blink(
    servo_id: Ids,
    port: ChainPort = None,
    baud: Baud = DEFAULT_BAUD,
    times: Annotated[
        int, typer.Option(min=1, max=1000, help="number of times that the LED blinks")
    ] = 5,
    as_json: Json = False,
) -> None:
    """Blink the LED of servos to find them; nothing moves."""
    with open_lines(port, baud) as lines:
        buses = {blink_id: lines.open_servo(blink_id) for blink_id in servo_id}
        clock = lines.lines[0][0].clock
        try:
            for _ in range(times):
                for on in (1, 0):
                    for blink_id, bus in buses.items():
                        bus.write(blink_id, "LED", on)
                    clock.sleep_until_s(clock.now_s() + _BLINK_S)
        finally:
            for blinked_id, bus in buses.items():
                bus.write(blinked_id, "LED", 0)
    show({"blinked": list(buses), "times": times}, as_json)
