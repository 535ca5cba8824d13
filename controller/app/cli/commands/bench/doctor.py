"""``snakewalk doctor``: is this bus fit for a run, and what is to be done if not."""

import json
from typing import Annotated

import typer
from rich.table import Table
from rich.text import Text

from snakewalk.controller.app.cli import completion
from snakewalk.controller.app.cli.options import DEFAULT_RUN, Json, Port, Robot, console
from snakewalk.controller.app.messages import stderr_console

_COLOURS = {"ok": "green", "warn": "yellow", "fail": "red"}


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
    from snakewalk.controller.app.service.finding import worst  # noqa: PLC0415
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
    grade = worst(findings)
    if as_json:
        shown = [finding.to_dict() for finding in findings]
        print(
            json.dumps({"port": device, "robot": described.name, "worst": grade, "findings": shown})
        )
    else:
        table = Table(box=None, show_header=False)
        for finding in findings:
            mark = Text(finding.grade, style=_COLOURS[finding.grade])
            table.add_row(mark, finding.check, finding.found)
            if finding.remedy:
                table.add_row("", "", Text(f"-> {finding.remedy}", style="bold"))
        console.print(table)
    if grade == "fail":
        raise SystemExit(1)
