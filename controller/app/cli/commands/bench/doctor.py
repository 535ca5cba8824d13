"""``snakewalk doctor``: is this bus fit for a run, and what is to be done if not."""

from typing import Annotated

import typer

from snakewalk.controller.app.cli import completion
from snakewalk.controller.app.cli.findings_table import show_findings
from snakewalk.controller.app.cli.options import DEFAULT_RUN, Json, Port, Robot
from snakewalk.controller.app.messages import stderr_console


def doctor(
    port: Port = None,
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
    from snakewalk.config.loader import load_robot, load_run  # noqa: PLC0415  --help stays quick
    from snakewalk.controller.app.service.adapter import permission  # noqa: PLC0415
    from snakewalk.controller.app.service.doctor import examine  # noqa: PLC0415
    from snakewalk.controller.app.service.scan import pick_port  # noqa: PLC0415
    from snakewalk.drivers.port.network_port import open_port  # noqa: PLC0415

    job = load_run(run)
    described = load_robot(robot if robot is not None else job.robot)
    device = pick_port(port)
    findings = [permission(device)]
    if findings[0].grade != "fail":
        with (
            open_port(device, described.servo.baud) as line,
            stderr_console().status("") as status,
        ):
            findings += examine(
                line,
                described,
                job.safety,
                job.cycle_hz,
                latency_s=line.latency_s,
                latency_timer_ms=line.latency_timer_ms,
                wiggle=wiggle,
                on_progress=lambda step: status.update(f"{device}: {step}"),
            )
    show_findings(findings, {"port": device, "robot": described.name}, as_json)
