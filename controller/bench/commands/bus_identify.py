"""``snakewalk bus inventory``: the servos on a bus, and a robot file to begin with."""

import json
from pathlib import Path
from typing import Annotated

import typer

from snakewalk.config.constants import DEFAULT_BAUD
from snakewalk.config.errors import InputError
from snakewalk.controller.bench import inventory, scan
from snakewalk.controller.bench.commands.bus_options import Bauds
from snakewalk.controller.bench.port_lines import open_lines
from snakewalk.controller.console.command import command
from snakewalk.controller.console.messages import LOGGER
from snakewalk.controller.console.options import ChainPort, Force, Json, console, print_table
from snakewalk.controller.console.result_files import check_ending, write_result


@command(
    "bus inventory",
    examples=("bus inventory", "bus inventory --axes yp -o mine.toml"),
    results=("out",),
)
def bus_identify(
    port: ChainPort = None,
    baud: Bauds = None,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="write a first robot file here (.toml)")
    ] = None,
    axes: Annotated[
        str,
        typer.Option(
            help="axes of the joints from the head: y turns about the vertical, p lifts; a short "
            "word repeats, e.g. yp"
        ),
    ] = "y",
    force: Force = False,
    as_json: Json = False,
) -> None:
    """List the servos on the wire: models, IDs, firmware, faults; suggest a robot file."""
    check_ending(out, "a robot's file", ".toml")
    if not axes or set(axes) - {"y", "p"}:
        raise InputError(f"--axes {axes}: expected the letters y and p, e.g. yp")
    scan.check_bauds(baud or ())
    with open_lines(port, baud[0] if baud else DEFAULT_BAUD) as lines:
        entries = [
            (line.name, entry)
            for line, _ in lines.lines
            for entry in inventory.take_inventory(
                line, line.latency_s, baud or (), lambda step: typer.echo(step, err=True)
            )
        ]
    if len(entries) < len(axes):
        raise InputError(_too_few(lines.port, len(entries), axes))
    for note in lines.misplaced((name, entry.found.servo_id) for name, entry in entries):
        LOGGER.warning("%s", note)
    if out is not None:
        segments = [
            (line.name, [entry.found.servo_id for name, entry in entries if name == line.name])
            for line, _ in lines.lines
        ]
        text = inventory.robot_skeleton(
            out.stem, [entry for _, entry in entries], segments if lines.several else (), axes=axes
        )
        write_result(out, text)
    if as_json:
        servos = [entry.to_dict() | {"port": name} for name, entry in entries]
        print(json.dumps({"port": lines.port, "servos": servos, "robot": out and str(out)}))
        return
    heads = ("ID", "model", "firmware", "baud", "volt", "Celsius", "torque", "fault")
    rows = []
    for name, entry in entries:
        servo = entry.found
        state = entry.report
        state_cells = ("-",) * 3
        if state is not None:
            torque = "on" if state.torque_on else "off"
            state_cells = f"{state.voltage_v:.1f}", f"{state.temperature_c:.0f}", torque
        about = (servo.servo_id, servo.model, servo.firmware, servo.baud)
        rows.append((*about, *state_cells, entry.fault, *([name] if lines.several else [])))
    print_table((*heads, *(["port"] if lines.several else [])), rows)
    if out is not None:
        console.print(
            f"robot {out}: check its joint_axes, then: snakewalk bus calibrate --robot {out}"
        )


def _too_few(port: str, count: int, axes: str) -> str:
    if not count:
        return f"{port}: no servo replies; check power, cable and the adapter's switch"
    return (
        f"--axes {axes}: {len(axes)} joints, but servos reply with {count} IDs; check power and "
        "plugs. New servos share ID 1: connect each alone and change it "
        "(snakewalk bus set --baud 57600 --id 1 --new-id 2)"
    )
