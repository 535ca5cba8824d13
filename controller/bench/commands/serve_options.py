"""Options of ``snakewalk bus serve`` that concern a robot on its ground."""

from pathlib import Path
from typing import Annotated

import typer

from snakewalk.controller.console import completion

SimulatedRobot = Annotated[
    str | None,
    typer.Option(
        help="shipped robot or a TOML file to simulate on the ground of --world",
        autocompletion=completion.ROBOTS,
    ),
]
OfRun = Annotated[
    str | None,
    typer.Option(
        "--run",
        help="use robot, world and start of a shipped run or a RUN.toml, instead of --robot",
        autocompletion=completion.RUNS,
    ),
]
At = Annotated[
    str | None,
    typer.Option(
        metavar="X,Y[,DEG]",
        help="place of the head (m) and direction of the body; default: start of --run, else 0,0,0",
    ),
]
PoseOut = Annotated[
    str | None,
    typer.Option(metavar="udp:HOST:PORT", help="publish the robot's pose at this address"),
]
Tracker = Annotated[
    list[str] | None,
    typer.Option(
        metavar="KEY=VALUE",
        help="errors of the published poses: noise_m, noise_deg, delay_s, dropout_every_s, ...; "
        "may be repeated",
    ),
]
TruthFile = Annotated[
    Path | None,
    typer.Option(
        "--truth", help="write the true poses here as JSON lines, for `snakewalk log judge`"
    ),
]
