"""``snakewalk bus scan``: the servos on the bus."""

import json

from snakewalk.config.constants import DEFAULT_BAUD
from snakewalk.controller.bench import scan as scanning
from snakewalk.controller.bench.commands.bus_options import Bauds
from snakewalk.controller.bench.port_lines import open_lines
from snakewalk.controller.console.command import command
from snakewalk.controller.console.messages import LOGGER, stderr_console
from snakewalk.controller.console.options import ChainPort, Json, console, print_table


@command("bus scan", examples=("bus scan", "bus scan --port /dev/ttyUSB0 --baud 57600 --json"))
def scan(
    port: ChainPort = None,
    baud: Bauds = None,
    as_json: Json = False,
) -> None:
    """List the servos on a bus, at every baud rate; changes nothing."""
    scanning.check_bauds(baud or ())
    results = []
    noise: dict[str, dict[int, int]] = {}
    with (
        open_lines(port, baud[0] if baud else DEFAULT_BAUD) as lines,
        stderr_console().status("") as status,
    ):
        for line, _ in lines.lines:

            def show_step(step: str, name: str = line.name) -> None:
                status.update(f"{name}: {step}")

            report = scanning.scan(line, baud or (), show_step)
            results += [(line.name, result) for result in report.servos]
            if report.bad_line is not None:
                LOGGER.warning("%s: %s", line.name, report.bad_line)
            if report.noise_bytes:
                noise[line.name] = dict(report.noise_bytes)
    for note in lines.misplaced((name, servo.servo_id) for name, servo in results):
        LOGGER.warning("%s", note)
    if as_json:
        servos = [servo.to_dict() | {"port": name} for name, servo in results]
        print(json.dumps({"port": lines.port, "servos": servos, "noise_bytes": noise}))
    elif results:
        _print_servos(results, lines.several)
    elif noise:
        console.print(
            f"{lines.port}: no reply was complete; check cables, plugs, termination and ground"
        )
    else:
        console.print(f"{lines.port}: {_silence(baud)}")
    if not results:
        raise SystemExit(1)


def _print_servos(results: list[tuple[str, scanning.ScanResult]], several: bool) -> None:
    """Print a table, with the port if there are ``several``."""
    heads = ("ID", "model", "firmware", "baud", "port")
    rows = [
        (servo.servo_id, servo.model, servo.firmware, servo.baud, name) for name, servo in results
    ]
    count = 5 if several else 4
    print_table(heads[:count], (row[:count] for row in rows))
    for _, servo in results:
        if servo.secondary_id is not None:
            console.print(
                f"servo {servo.servo_id} obeys ID {servo.secondary_id} as well: its "
                "Secondary ID(12); a run sets it to 255"
            )


def _silence(bauds: list[int] | None) -> str:
    """Return what a silent bus means, and what to do."""
    if not bauds:
        return "no servo replies at any baud rate; check power, cable and the adapter's switch"
    rates = " or ".join(str(rate) for rate in bauds)
    return f"no servo replies at {rates} baud; leave --baud out to search all rates"
