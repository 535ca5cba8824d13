"""``snakewalk ros``: a robot in a ROS 2 graph."""

import re
from contextlib import nullcontext
from typing import Annotated

import typer

from snakewalk.config.errors import InputError
from snakewalk.controller.console import completion
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import (
    VIEW_AT,
    Force,
    Json,
    PartMb,
    PartMinutes,
    Robot,
    RunFolder,
    RunPort,
    Set,
    View,
    ViewAt,
    World,
    key_values,
)
from snakewalk.controller.console.progress import TimeBar
from snakewalk.controller.console.run_options import RunOptions
from snakewalk.controller.motion.commanded import Commanded
from snakewalk.controller.ros.ros_link import open_ros
from snakewalk.controller.ros.ros_options import RosOptions
from snakewalk.controller.run.commands.gait_options import Param, parameters
from snakewalk.controller.run.factory import prepare_commanded
from snakewalk.controller.run.kinds.gait_factory import gait_by_name
from snakewalk.controller.run.observers import PAGE, Observers, open_observer
from snakewalk.controller.run.results import run_facts, show_result
from snakewalk.controller.run.run_for_user import run_for_user

_WEEK_S = 604_800.0


@command(
    "ros",
    examples=(
        "ros",
        "ros --robot my.toml --port /dev/ttyUSB0 --domain 7 --namespace snake",
        "ros --robot alternating16 --gait rolling --network",
    ),
)
def ros(
    robot: Robot = None,
    world: World = None,
    port: RunPort = None,
    gait: Annotated[
        str | None,
        typer.Option(help="first gait; default: hold", autocompletion=completion.GAITS),
    ] = None,
    param: Param = None,
    domain: Annotated[
        int | None,
        typer.Option(
            min=0,
            max=232,
            help="ROS domain; default: ROS_DOMAIN_ID of the environment",
            show_default=False,
        ),
    ] = None,
    namespace: Annotated[str, typer.Option(help="namespace of all topics and services")] = "",
    network: Annotated[
        bool,
        typer.Option(
            "--network",
            help="let other machines see the node; default: as ROS_AUTOMATIC_DISCOVERY_RANGE "
            "says, else this machine only",
        ),
    ] = False,
    timeout: Annotated[
        float,
        typer.Option(
            help="stop moving joints after this many seconds without joint goals; inf: never"
        ),
    ] = 1.0,
    seconds: Annotated[
        float,
        typer.Option(
            min=0.1, help="switch torque off after this many seconds", show_default="a week"
        ),
    ] = _WEEK_S,
    part_mb: PartMb = None,
    part_minutes: PartMinutes = None,
    set_: Set = None,
    view: View = False,
    view_at: ViewAt = VIEW_AT,
    out: RunFolder = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Connect robot or simulator to ROS 2: command, watch and stop.

    It runs until ^C or a stop.
    """
    if not timeout > 0.0:
        raise InputError(f"--timeout {timeout:g}: expected seconds over 0, or inf")
    if not re.fullmatch(r"(/?[A-Za-z_]\w*(/[A-Za-z_]\w*)*)?", namespace, re.ASCII):
        raise InputError(f"--namespace {namespace}: expected a name as snake or lab/snake")
    options = RosOptions(domain, namespace, network, commands=True, timeout_s=timeout)
    begun = None if gait is None else gait_by_name(gait, parameters(param))[0]
    run_options = RunOptions(
        port=port,
        view=view,
        view_at=view_at,
        film=False,
        part_mb=part_mb,
        part_minutes=part_minutes,
        out=out,
        force=force,
        as_json=as_json,
    )
    opened = open_observer(PAGE, view_at) if view else nullcontext()
    with open_ros(options) as link, opened as page:
        prepared = prepare_commanded(
            lambda body, on_event: Commanded(
                body,
                body.joint_names,
                link.commands,
                on_event,
                timeout_s=timeout,
                gait=begun,
            ),
            robot=robot,
            world=world,
            seconds=seconds,
            name="ros",
            keys=key_values("--set", set_),
        )
        if begun is not None:
            begun.check(prepared.robot)
        result = run_for_user(
            prepared,
            f"ros-{prepared.robot.name}",
            run_options,
            bar=TimeBar(prepared.run.name, seconds),
            observers=nullcontext(Observers(link, page=page)),
        )
    facts = {
        **run_facts(result),
        "peak_current_a": result.summary.peak_current_a,
    }
    show_result(result, facts, run_options)
