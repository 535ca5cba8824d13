"""``snakewalk doctor``: name the faults of a bus and their remedies before a run."""

import json
from typing import Annotated

import typer

from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot, load_run
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.bench.adapter import permission
from snakewalk.controller.bench.commands.bus_options import confirmed
from snakewalk.controller.bench.doctor import examine, examine_segments
from snakewalk.controller.bench.fingerprints import (
    differences,
    fingerprint_file,
    fingerprint_finding,
    read_all,
)
from snakewalk.controller.bench.port_lines import PortLines, open_lines
from snakewalk.controller.bench.scan import pick_port
from snakewalk.controller.bench.servo_checks import unnamed_robot
from snakewalk.controller.console import completion
from snakewalk.controller.console.command import command
from snakewalk.controller.console.finding import Finding
from snakewalk.controller.console.findings_table import show_findings
from snakewalk.controller.console.messages import stderr_console
from snakewalk.controller.console.options import DEFAULT_RUN, Json, Robot, check_port_name
from snakewalk.controller.run.backend import FILE_PORTS, on_ports, real_ports
from snakewalk.drivers.chain.fingerprint_file import FingerprintFile, user_file
from snakewalk.drivers.errors import BusError
from snakewalk.drivers.port.port_map import is_port_map, port_map_text

DoctorPort = Annotated[
    str | None,
    typer.Option(
        callback=check_port_name,
        help="serial port, or a URL such as socket://host:5000; 1-8=PORT,9-16=PORT for "
        "segments; robot: the ports of the robot's file; default: the only USB adapter",
    ),
]


@command("doctor", examples=("doctor", "doctor --port /dev/ttyUSB0 --robot alternating16"))
def doctor(
    port: DoctorPort = None,
    robot: Robot = None,
    run: Annotated[
        str,
        typer.Option(
            help="check against the rate and the limits of this run", autocompletion=completion.RUNS
        ),
    ] = DEFAULT_RUN,
    wiggle: Annotated[
        bool,
        typer.Option(
            "--wiggle",
            help="move all joints by 0.15 rad for 2 s, and check whether the supply sags",
        ),
    ] = False,
    accept: Annotated[
        bool,
        typer.Option(
            "--accept",
            help="show how the servos differ from the fingerprint file, and ask to update it",
        ),
    ] = False,
    yes: Annotated[
        bool, typer.Option("--yes", "-y", help="with --accept: write without asking")
    ] = False,
    as_json: Json = False,
) -> None:
    """Examine adapter, bus and servos; list every fault with its remedy.

    The command changes nothing, except with --wiggle: then it sets the chain up as in a run.
    """
    job = load_run(run)
    robot_file = robot if robot is not None else job.robot
    described = load_robot(robot_file)
    if yes and not accept:
        raise InputError("--yes: goes with --accept; doctor writes nothing else")
    if accept:
        _accept(robot_file, described, port, yes=yes, as_json=as_json)
        return
    if port is not None and (port == FILE_PORTS or is_port_map(port)):
        described = on_ports(described, port)
        device = port_map_text((segment.port, segment.ids) for segment in described.ports)
        findings = [permission(real_port) for real_port in real_ports(described)]
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
                segments = [(port_name, some or ()) for port_name, some in lines.lines]
                findings += examine_segments(
                    segments,
                    described,
                    job,
                    wiggle=wiggle,
                    on_progress=status.update,
                )
            else:
                findings += examine(
                    line,
                    described,
                    job,
                    latency_s=line.latency_s,
                    latency_timer_ms=line.latency_timer_ms,
                    wiggle=wiggle,
                    on_it=ids,
                    on_progress=lambda step: status.update(f"{device}: {step}"),
                )
            findings += _fingerprints(robot_file, described, lines)
    if robot is None and run == DEFAULT_RUN:
        unnamed = unnamed_robot(findings, described)
        findings += [] if unnamed is None else [unnamed]
    show_findings(findings, {"port": device, "robot": described.name}, as_json)


def _fingerprints(robot_file: str, robot: RobotConfig, lines: PortLines) -> list[Finding]:
    path = user_file(robot_file)
    if path is None:
        return []
    finding = fingerprint_finding(FingerprintFile(path), robot, read_all(lines, robot))
    return [] if finding is None else [finding]


def _accept(
    robot_file: str, robot: RobotConfig, port: str | None, *, yes: bool, as_json: bool
) -> None:
    """Show old and new values of each joint's servo, ask, and write the fingerprint file."""
    file = fingerprint_file(robot_file, "--accept")
    if port is not None and (port == FILE_PORTS or is_port_map(port)):
        robot = on_ports(robot, port)
        port = port_map_text((segment.port, segment.ids) for segment in robot.ports)
    stored_fingerprints = file.read() or {}
    with open_lines(port, robot.servo.baud) as lines:
        fingerprints = read_all(lines, robot)
    silent = [robot.joint_label(j) for j, i in enumerate(robot.servo_ids) if i not in fingerprints]
    if silent:
        raise BusError(f"{', '.join(silent)}: no reply; nothing is written")
    changed = differences(robot, stored_fingerprints, fingerprints)
    for line in () if as_json else changed:
        typer.echo(line)
    is_written = bool(changed) and (
        yes or confirmed("doctor --accept", f"write this into {file.path}?", as_json=as_json)
    )
    if is_written:
        file.write(fingerprints)
    if as_json:
        facts = {"file": str(file.path), "changes": changed, "written": is_written}
        print(json.dumps(facts))
    elif not changed:
        typer.echo(f"the servos are as in {file.path}")
    else:
        typer.echo(f"{file.path}: {'written' if is_written else 'nothing written'}")
