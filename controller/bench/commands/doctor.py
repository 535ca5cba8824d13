"""``snakewalk doctor``: is this bus fit for a run, and what is to be done if not."""

from typing import Annotated

import typer

from snakewalk.config.loader import load_robot, load_run
from snakewalk.controller.bench.adapter import permission
from snakewalk.controller.bench.doctor import examine, examine_segments
from snakewalk.controller.bench.port_lines import open_lines
from snakewalk.controller.bench.scan import pick_port
from snakewalk.controller.console import completion
from snakewalk.controller.console.command import BUS, command
from snakewalk.controller.console.findings_table import show_findings
from snakewalk.controller.console.messages import stderr_console
from snakewalk.controller.console.options import DEFAULT_RUN, Json, Robot
from snakewalk.controller.run.backend import FILE_PORTS, on_ports, real_ports
from snakewalk.drivers.port.port_map import is_port_map, port_map_text


@command(
    "doctor", group=BUS, examples=("doctor", "doctor --port /dev/ttyUSB0 --robot alternating16")
)
def doctor(
    port: Annotated[
        str | None,
        typer.Option(
            help="serial port, or a URL such as socket://host:5000; 1-8=PORT,9-16=PORT, or robot, "
            "whose file says which; default: the only USB adapter there is"
        ),
    ] = None,
    robot: Robot = None,
    run: Annotated[
        str, typer.Option(help="run whose rate and limits count", autocompletion=completion.RUNS)
    ] = DEFAULT_RUN,
    wiggle: Annotated[
        bool,
        typer.Option("--wiggle", help="move all joints by 0.15 rad for 2 s: does the supply sag?"),
    ] = False,
    as_json: Json = False,
) -> None:
    """Examine adapter, bus and servos; every fault with its remedy.

    Changes nothing, unless the joints are to wiggle: then the chain is set up as in a run.
    """
    job = load_run(run)
    described = load_robot(robot if robot is not None else job.robot)
    if port is not None and (port == FILE_PORTS or is_port_map(port)):
        described = on_ports(described, port)
        device = port_map_text((each.port, each.ids) for each in described.ports)
        findings = [permission(each) for each in real_ports(described)]
    else:
        device = pick_port(port)
        findings = [permission(device)]
    if all(finding.grade != "fail" for finding in findings):
        with (
            open_lines(device, described.servo.baud) as lines,
            stderr_console().status("") as status,
        ):
            (line, ids), *others = lines.lines
            if others:
                segments = [(each, some or ()) for each, some in lines.lines]
                findings += examine_segments(
                    segments,
                    described,
                    job.safety,
                    job.cycle_hz,
                    wiggle=wiggle,
                    on_progress=status.update,
                )
            else:
                findings += examine(
                    line,
                    described,
                    job.safety,
                    job.cycle_hz,
                    latency_s=line.latency_s,
                    latency_timer_ms=line.latency_timer_ms,
                    wiggle=wiggle,
                    on_it=ids,
                    on_progress=lambda step: status.update(f"{device}: {step}"),
                )
    show_findings(findings, {"port": device, "robot": described.name}, as_json)
