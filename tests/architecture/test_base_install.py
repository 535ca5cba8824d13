"""The base install (no extras) runs a robot; what needs an extra says which one."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import typer

from snakewalk.controller.cli.command_line import app

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = ROOT / "tests" / "helpers" / "base_install.py"


class Result(NamedTuple):
    """Of one command."""

    code: int
    out: str
    err: str


def call(folder: Path, *commands: tuple[str, ...]) -> list[Result]:
    """Run commands one after the other in one interpreter without extras, in ``folder``."""
    ran = subprocess.run(
        [sys.executable, str(SCRIPT)],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(ROOT), "COLUMNS": "100", "TERM": "dumb"},
        input=json.dumps(commands),
        capture_output=True,
        text=True,
        timeout=240,
        check=False,
    )
    assert ran.returncode == 0, ran.stderr
    return [Result(*row) for row in json.loads(ran.stdout)]


def commands() -> list[tuple[str, ...]]:
    found: list[tuple[str, ...]] = []

    def walk(command: object, words: tuple[str, ...]) -> None:
        found.append(words)
        for name, inner in getattr(command, "commands", {}).items():
            walk(inner, (*words, name))

    walk(typer.main.get_command(app), ())  # type: ignore[arg-type]
    return found


BASE = [
    ("scan", "--port", "/dev/null", "--baud", "1000000"),
    ("doctor", "--port", "/dev/null", "--robot", "yaw16"),
    ("bus", "set", "--port", "/dev/null", "--id", "3", "--return-delay", "0", "--yes"),
    ("list",),
    ("gait", "list"),
    ("gait", "show", "rolling"),
    ("plan", "flat-slalom", "--motion", "serpenoid"),
    ("track", "worm-like"),
    ("analyse", "worm-like"),
    ("walk", "--graph", "er:40:5", "--repeats", "2"),
    ("play", "worm-like", "--port", "/dev/null", "--robot", "yaw16", "--out", "p"),
    ("bus", "serve", "--servos", "1-2", "--for", "0.1"),
]
"""Commands that need no extra."""

NEEDY = [
    (("run", "flat-slalom"), "sim"),
    (("gait", "run", "lateral-undulation"), "sim"),
    (("play", "worm-like"), "sim"),
    (("replay", "log.mcap"), "sim"),
    (("shadow", "log.mcap"), "sim"),
    (("gait", "run", "lateral-undulation", "--shadow", "--port", "/dev/null"), "sim"),
    (("bus", "serve", "--robot", "yaw16"), "sim"),
    (("sweep", "rolling", "--points", "1"), "sim"),
    (("sweep", "rolling", "--points", "1", "--dask", "tcp://localhost:1"), "sweep"),
    (("tune", "rolling"), "sim"),
    (("trials", "flat-slalom", "--seeds", "1"), "sim"),
    (("repertoire", "record"), "sim"),
    (("gait", "show", "rolling", "--picture", "a.png"), "view"),
    (("gait", "fit", "curve.csv", "--picture", "a.png"), "view"),
    (("track", "worm-like", "--picture", "a.png"), "view"),
    (("analyse", "worm-like", "--picture", "a.png"), "view"),
    (("walk", "--picture", "a.png"), "view"),
    (("sweep", "rolling", "--picture", "a.png"), "view"),
    (("repertoire", "record", "--picture", "a.png"), "view"),
    (("body", "worm-like", "-o", "b.glb"), "vision"),
    (("capture", "film.mp4"), "vision"),
    (("fish", "match", "film.mp4"), "vision"),
    (("fish", "film", "tank"), "vision"),
    (("export", "log.mcap", "--ros2", "b.mcap"), "export"),
    (("ros",), "ros"),
    (("export", "log.mcap", "--parquet", "tables"), "export"),
    (("run", "flat-slalom", "--pose", "camera", "--port", "/dev/null"), "vision"),
]
"""Commands, and the extra that each needs."""

ON_SERVOS = ("--port", "/dev/null", "--json")
GAIT = ("gait", "run", "lateral-undulation", "--seconds", "2", "--out", "gait", *ON_SERVOS)
JOB = (
    *("run", "flat-slalom", "--motion", "serpenoid", "--pose", "joints", "--out", "j"),
    *("--set", "run.time_limit_s=5", *ON_SERVOS),
)
EXPORT = ("export", "gait/log.mcap", "--csv", "tables", "--foxglove", "f.mcap", "--json")
