"""Shared parts of the commands: options, and the display of a result."""

import json
import os
import re
import stat
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import typer
from rich.table import Table

from snakewalk.config.archive import parse_json
from snakewalk.config.errors import InputError
from snakewalk.config.units import label_and_unit
from snakewalk.controller.console import completion
from snakewalk.controller.console.plain_console import PlainConsole
from snakewalk.controller.console.plugins import require
from snakewalk.drivers.errors import PortError

try:
    import termios
except ImportError:  # Windows: opening a port reports the remedy
    termios = None  # type: ignore[assignment]

_NO_DEVICES = ("sim", "robot")
"""Names for simulated servos, and for the ports in the robot's file."""
_IDS = re.compile(r"\s*\d[\d\s-]*=")
_PSEUDO_TERMINALS = range(136, 144)
"""Major numbers of Linux's pseudo-terminals, which have no entry below ``/sys/dev/char``."""


def check_port_name(port: str | None) -> str | None:
    """Return ``--port`` if each name in it is a URL of a known scheme, or may be a serial device.

    A missing name passes; opening it reports that.

    Raises:
        PortError: one line per fault.

    """
    if port is None:
        return None
    names = [_IDS.sub("", part, count=1) for part in port.split(",")]
    faults = [fault for fault in map(_fault, names) if fault is not None]
    if faults:
        raise PortError(faults)
    return port


def _fault(name: str) -> str | None:
    from snakewalk.config.robot.ports import port_fault  # noqa: PLC0415  --help loads no schema

    if (fault := port_fault(name)) is not None:
        return f"{name}: {fault}"
    if termios is None or name in _NO_DEVICES:
        return None
    path = Path(name)
    if path.is_symlink() and not path.exists():
        return (
            f"{name}: leads to {os.readlink(path)}, which is gone: its server has ended; start it "
            "again"
        )
    try:
        facts = path.stat()
    except (OSError, ValueError):
        return None
    if stat.S_ISCHR(facts.st_mode) and _is_terminal(facts.st_rdev):
        return None
    return f"{name}: is not a serial device; name one such as /dev/ttyUSB0"


def _is_terminal(device: int) -> bool:
    major, minor = os.major(device), os.minor(device)
    if major in _PSEUDO_TERMINALS:
        return True
    subsystem = Path(f"/sys/dev/char/{major}:{minor}/subsystem")
    return not subsystem.exists() or subsystem.resolve().name == "tty"


_PIPE_COLUMNS = 200
"""Columns of a pipe or a file, which break no line."""
console = PlainConsole(
    highlight=False,
    markup=False,
    emoji=False,  # er:100:9 is a graph
    width=None if sys.stdout.isatty() else _PIPE_COLUMNS,
)
DEFAULT_RUN = "jacksboro-traverse"
RunName = Annotated[
    str,
    typer.Argument(
        help="shipped run, or a RUN.toml", show_default=True, autocompletion=completion.RUNS
    ),
]
Json = Annotated[bool, typer.Option("--json", help="print the result as JSON")]
Workers = Annotated[int, typer.Option(min=1, help="number of processes")]
Seeds = Annotated[int, typer.Option(min=1, max=100_000, help="number of runs per row of the table")]
RunSeconds = Annotated[
    float, typer.Option(min=4.0, max=3600.0, help="duration of each run in seconds")
]
TableParquet = Annotated[
    Path | None, typer.Option(help="write the table --out as Parquet here, in addition")
]
RunLog = Annotated[
    Path, typer.Argument(help="log.mcap of a run with all its parts, or a part or .part of it")
]
Dask = Annotated[str | None, typer.Option(help="address of a Dask scheduler, e.g. tcp://host:8786")]
FirstSeed = Annotated[int, typer.Option(min=0, max=10**15, help="first seed; the others follow it")]
Motion = Annotated[
    str | None,
    typer.Option(
        help="kind of motion: walk, walk-printed, walk-blind or serpenoid",
        autocompletion=completion.MOTIONS,
    ),
]
Port = Annotated[
    str | None,
    typer.Option(
        callback=check_port_name,
        help="serial port, or a URL such as socket://pi:5000; default: the only USB adapter",
    ),
]
ChainPort = Annotated[
    str | None,
    typer.Option(
        callback=check_port_name,
        help="serial port, or a URL such as socket://pi:5000; 1-8=A,9-16=B for segments with "
        "separate ports; default: the only USB adapter",
    ),
]
RunPort = Annotated[
    str | None,
    typer.Option(
        callback=check_port_name,
        help="serial port, or a URL such as socket://pi:5000; 1-8=A,9-16=sim for segments "
        "(sim: simulated servos); robot: the ports of the robot's file; default: the "
        "simulator",
    ),
]
PartMb = Annotated[
    float | None,
    typer.Option(min=1.0, help="megabytes after which the log continues in a new file"),
]
PartMinutes = Annotated[
    float | None,
    typer.Option(min=0.1, help="minutes after which the log continues in a new file"),
]
Film = Annotated[bool, typer.Option("--film/--no-film", help="draw a film of the run")]
Marked = Annotated[
    bool,
    typer.Option(
        "--marks/--no-marks",
        help="draw waypoints, path, contour lines, scale and caption into the film",
    ),
]
Look = Annotated[
    str,
    typer.Option(
        help="body in the film: servos, animal, or a BODY that `snakewalk animal body` accepts",
        autocompletion=completion.LOOKS,
    ),
]
RunFolder = Annotated[
    Path | None,
    typer.Option(
        "--out", "-o", file_okay=False, help="folder of this run; default: a new one in runs/"
    ),
]
Compliant = Annotated[
    bool | None,
    typer.Option(
        "--compliance/--no-compliance",
        help="let joints yield to measured current, or not; default: the run's setting",
        show_default=False,
    ),
]
Shadow = Annotated[
    bool,
    typer.Option(
        "--shadow", help="compare the run with a simulation, and name the cause of differences"
    ),
]
View = Annotated[bool, typer.Option("--view", help="show the robot in a browser")]
ViewAt = Annotated[
    str,
    typer.Option("--view-at", metavar="HOST:PORT", help="address of the page"),
]
Ros = Annotated[
    bool, typer.Option("--ros", help="publish the run in ROS 2, with a service that stops it")
]
VIEW_AT = "127.0.0.1:8080"
Force = Annotated[bool, typer.Option("--force", help="overwrite existing files")]
Robot = Annotated[
    str | None, typer.Option(help="shipped robot, or a TOML file", autocompletion=completion.ROBOTS)
]
GivenRobot = Annotated[
    str, typer.Option(help="shipped robot, or a TOML file", autocompletion=completion.ROBOTS)
]
World = Annotated[
    str | None, typer.Option(help="shipped world, or a TOML file", autocompletion=completion.WORLDS)
]
GivenWorld = Annotated[
    str, typer.Option(help="shipped world, or a TOML file", autocompletion=completion.WORLDS)
]
TrackFile = Annotated[
    str | None,
    typer.Option(
        "--track",
        help="shipped recording, or a file of midlines or angles",
        autocompletion=completion.RECORDINGS,
    ),
]

FilmRate = Annotated[
    float | None,
    typer.Option(help="frame rate in frames per second; default: the rate that the film states"),
]
Set = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        help="replace a value of the run's, robot's or world's file, e.g. run.cycle_hz=25; "
        "may be repeated",
        metavar="KEY=VALUE",
        autocompletion=completion.keys,
    ),
]
_MESSAGES = "Messages"
"""Group of options in ``--help``."""
Verbose = Annotated[
    bool, typer.Option("--verbose", "-v", help="print every step", rich_help_panel=_MESSAGES)
]
Quiet = Annotated[
    bool,
    typer.Option("--quiet", "-q", help="print warnings and faults only", rich_help_panel=_MESSAGES),
]
LogLevel = Annotated[
    Literal["debug", "info", "warning", "error"] | None,
    typer.Option(
        help="lowest level of the messages to print; default: info",
        rich_help_panel=_MESSAGES,
        show_default=False,
    ),
]
LogFile = Annotated[
    Path | None,
    typer.Option(
        dir_okay=False, help="append all messages to this file", rich_help_panel=_MESSAGES
    ),
]


def check_files(run: str | None, robot: str | None, world: str | None) -> None:
    """Load a user's files that a command names; shipped ones have no faults.

    Robot and world default to those of the run.

    Raises:
        ConfigError: all faults of the first faulty file.
        InputError: a run names a pose source that is not installed.

    """
    from snakewalk.config.loader import load_robot, load_run, load_world, place_of  # noqa: PLC0415  --help stays quick

    parent = None
    if run is not None and run.endswith(".toml"):
        parent = Path(run).parent
        given = load_run(run)
        robot = robot or given.robot
        world = world or given.world
        if given.pose is not None:
            require("pose", given.pose.partition(":")[0], place_of(Path(run), "pose"))
    if robot is not None and robot.endswith(".toml"):
        load_robot(robot, parent)
    if world is not None and world.endswith(".toml"):
        load_world(world, parent)


def check_idle(options: Mapping[str, object], defaults: Mapping[str, object]) -> None:
    """Reject options that have no effect without, or with, another one.

    Raises:
        InputError: one line per option.

    """
    given = {name for name, value in options.items() if value != defaults.get(name)}
    faults = []
    if options.get("view") is False and "view_at" in given:
        faults.append("--view-at: is of the page: add --view")
    if options.get("film") is False and "film" in given:
        faults += [
            f"--{name}: is of the film, which --no-film leaves out"
            for name in ("look", "fine", "marks")
            if name in given
        ]
    if faults:
        raise InputError(faults)


def key_values(option: str, given: list[str] | None, form: str = "KEY=VALUE") -> dict[str, Any]:
    """Read an option's KEY=VALUE pairs; a value is JSON or text.

    Raises:
        InputError: key or value is missing, or a key occurs twice.

    """
    values: dict[str, Any] = {}
    for text in given or []:
        key, equals, value = (part.strip() for part in text.partition("="))
        if not (key and equals and value):
            raise InputError(f"{option} {text}: expected {form}")
        if key in values:
            raise InputError(f"{option} {text}: {key} has a value already: leave one")
        try:
            values[key] = parse_json(value)
        except ValueError:  # not JSON, too long a number, or too deep a list
            values[key] = value
        if re.search(r"\b(NaN|Infinity)\b", value) and values[key] is not value:
            raise InputError(f"{option} {text}: must be a finite number")
    return values


_DIGITS = 4
"""Significant digits of a number in a table (ours); JSON has all of them."""


def show(result: Mapping[str, object], as_json: bool) -> None:
    """Print a result as a table of labels and values with units, or as JSON.

    The table leaves out what is None, an empty list or an empty text.
    """
    if as_json:
        print(json.dumps(result))
        return
    table = Table(box=None, show_header=False)
    for key, value in result.items():
        if value is not None and value not in ("", [], (), {}):
            table.add_row(*labelled(key, value))
    console.print(table)


_NUMBER = re.compile(r"[-+]?\d|-?$")


def print_table(
    heads: Iterable[str], rows: Iterable[Iterable[object]], title: str | None = None
) -> None:
    """Print rows below heads; numbers are on the right, and a None is empty."""
    cells = [["" if value is None else str(value) for value in row] for row in rows]
    table = Table(title=title, title_justify="left", box=None, pad_edge=False)
    for head, *column in zip(heads, *cells, strict=True):
        is_number = any(column) and all(map(_NUMBER.match, column))
        table.add_column(head, justify="right" if is_number else "left")
    for row in cells:
        table.add_row(*row)
    console.print(table)


def labelled(key: str, value: object) -> tuple[str, str]:
    """Return the label of a key, and its value with a unit."""
    label, unit = label_and_unit(key) if _is_number(value) else (key.replace("_", " "), "")
    return label, f"{_text(value)} {unit}".rstrip()


def _is_number(value: object) -> bool:
    if isinstance(value, list | tuple):
        return all(_is_number(element) for element in value)
    return isinstance(value, int | float) and not isinstance(value, bool)


def _text(value: object) -> str:
    """A value without brackets and quotes; floats are rounded."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.{_DIGITS}g}" if abs(value) < 10.0**_DIGITS else f"{value:.0f}"
    if isinstance(value, dict):
        return ", ".join(" ".join(labelled(key, part)) for key, part in value.items())
    if isinstance(value, list | tuple):
        return ", ".join(_text(part) for part in value)
    return "-" if value is None else str(value)


RobotName = Annotated[
    str, typer.Argument(help="shipped robot, or a TOML file", autocompletion=completion.ROBOTS)
]
Observe = Annotated[
    list[str] | None,
    typer.Option(
        "--observe",
        metavar="NAME",
        help="observer of a plug-in, NAME:ARGUMENT; `snakewalk list` shows them",
    ),
]
