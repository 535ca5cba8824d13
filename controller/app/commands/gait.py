"""``snakewalk gait``: which gaits there are, what they look like, and one of them on the robot."""

import json
import math
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table

from config.errors import InputError
from controller.app.commands.common import Json, Robot, World, console, show

if TYPE_CHECKING:
    from controller.app.prepare_gait import Live
    from controller.gaits.gait import Gait

Name = Annotated[str, typer.Argument(help="gait, shipped set of parameters, or a SET.toml")]
Param = Annotated[
    list[str] | None, typer.Option("--param", "-p", help="NAME=VALUE; may be given again")
]


def list_gaits(as_json: Json = False) -> None:
    """List the gaits, what joints they need, and the shipped sets of their parameters."""
    from config.loader import load_gait, shipped  # noqa: PLC0415
    from controller.gaits.registry import GAITS  # noqa: PLC0415  heavy; --help stays quick

    sets = [load_gait(name) for name in shipped("gaits")]
    if as_json:
        rows = [
            {"name": g.name, "title": g.title, "needs": _needs(g), "source": g.source}
            for g in GAITS.values()
        ]
        print(json.dumps({"gaits": rows, "sets": [s.model_dump() for s in sets]}))
        return
    table = Table(box=None, pad_edge=False)
    for title in ("gait", "needs", ""):
        table.add_column(title, no_wrap=title != "")
    for gait in GAITS.values():
        table.add_row(gait.name, ", ".join(_needs(gait)), gait.title)
    console.print(table)
    if sets:
        table = Table(box=None, pad_edge=False)
        for title in ("set", "gait", "robot"):
            table.add_column(title)
        for each in sets:
            table.add_row(each.name, each.gait, each.robot)
        console.print()
        console.print(table)


def show_gait(
    name: Name,
    robot: Robot = None,
    param: Param = None,
    picture: Annotated[
        Path | None, typer.Option(help="draw the body over a cycle here (.png, .svg, .pdf)")
    ] = None,
    as_json: Json = False,
) -> None:
    """Show a gait's parameters with ranges and units, its source, and how fast joints must be."""
    from controller.app.gait_picture import check_picture, draw_gait  # noqa: PLC0415  heavy
    from controller.app.prepare_gait import prepare_gait  # noqa: PLC0415
    from controller.gaits.ranges import ranges  # noqa: PLC0415
    from controller.motion.gait_motion import Cycle  # noqa: PLC0415

    if picture is not None:
        check_picture(picture)
    prepared = prepare_gait(name, robot=robot, parameters=_parameters(param))
    gait, body = prepared.gait, prepared.robot
    cycle = Cycle(gait, body)
    spans = ranges(gait.model)
    found: dict[str, object] = {
        "gait": gait.name,
        "title": gait.title,
        "source": gait.source,
        "needs": _needs(type(gait)),
        "robot": body.name,
        "frequency_hz": round(cycle.frequency_hz, 3),
        "joint_speed_rad_s": round(float(cycle.pace().speed_rad_s.max()), 3),
    }
    if picture is not None:
        draw_gait(gait, body, picture)
        found["picture"] = str(picture)
    values = gait.params.model_dump()
    if as_json:
        rows = {
            key: {
                "value": values[key], "default": span.default, "low": span.low, "high": span.high,
                "description": span.said,
            }
            for key, span in spans.items()
        }  # fmt: skip
        print(json.dumps(found | {"parameters": rows}))
        return
    found["needs"] = ", ".join(_needs(type(gait)))
    show(found, as_json=False)
    table = Table(box=None, pad_edge=False)
    for title in ("parameter", "value", "least", "most", ""):
        table.add_column(title, justify="left" if title in {"parameter", ""} else "right")
    for key, span in spans.items():
        value = values[key]
        shown = str(value) if isinstance(value, bool | int) else f"{value:.4g}"
        least, most = ("", "") if span.kind is bool else (f"{span.low:.4g}", f"{span.high:.4g}")
        table.add_row(key, shown, least, most, span.said)
    console.print()
    console.print(table)


def run_gait(
    name: Name,
    robot: Robot = None,
    world: World = None,
    param: Param = None,
    then: Annotated[
        list[str] | None,
        typer.Option(help="NAME@SECONDS[,PARAM=VALUE...]: change gait; may be given again"),
    ] = None,
    by: Annotated[str, typer.Option(help="how gaits change: blend, or cpg: oscillators")] = "blend",
    seconds: Annotated[float, typer.Option(help="then it comes to rest")] = 20.0,
    look_heading_rad: Annotated[
        float | None, typer.Option(help="world heading that the head keeps")
    ] = None,
    look_at: Annotated[
        str | None, typer.Option(help="X,Y in metres: point that the head looks at")
    ] = None,
    live: Annotated[bool, typer.Option("--live", help="change it by keys while it runs")] = False,
    gamepad: Annotated[
        Path | None, typer.Option(help="the same from a gamepad, e.g. /dev/input/js0")
    ] = None,
    port: Annotated[str | None, typer.Option(help="serial port; without it, the simulator")] = None,
    film: Annotated[bool, typer.Option("--film/--no-film", help="draw a film of the run")] = True,
    out: Annotated[Path | None, typer.Option(help="folder for log and summary")] = None,
    seed: Annotated[int, typer.Option(min=0, help="of every random choice")] = 0,
    as_json: Json = False,
) -> None:
    """Run a gait on servos or in the simulator; leaves a log, a report and a film."""
    from controller.app.execute import execute  # noqa: PLC0415  heavy; --help stays quick
    from controller.app.gait_progress import GaitProgress, RealTime  # noqa: PLC0415
    from controller.app.gait_way import gait_way  # noqa: PLC0415
    from controller.app.prepare_gait import prepare_gait  # noqa: PLC0415
    from controller.app.report.leave import leave_report  # noqa: PLC0415
    from drivers.telemetry.reader import read_log  # noqa: PLC0415

    if by not in {"blend", "cpg"}:
        raise InputError(f"--by {by}: expected blend or cpg")
    with ExitStack() as stack:
        prepared = prepare_gait(
            name,
            robot=robot,
            world=world,
            parameters=_parameters(param),
            seconds=seconds,
            seed=seed,
            look_heading_rad=look_heading_rad,
            look_at_m=_point(look_at),
            live=_live(stack, live, gamepad),
            then=[_change(text) for text in then or []],
            by="cpg" if by == "cpg" else "blend",
        )
        run = prepared.run
        folder = out if out is not None else Path("runs") / f"gait-{run.name}-{prepared.robot.name}"
        progress = stack.enter_context(GaitProgress(run.name, seconds))
        paced = (RealTime(),) if prepared.live is not None and port is None else ()
        finished = execute(prepared, folder, port, (progress, *paced), say=progress.note)
    left = leave_report(finished.log, folder, film=film)
    for line in left.notes:
        print(f"snakewalk: {line}", file=sys.stderr)
    found: dict[str, object] = {
        "gait": prepared.config.name,
        "robot": prepared.robot.name,
        "world": prepared.world.name,
        "duration_s": round(finished.outcome.duration_s, 2),
        "tripped": finished.outcome.tripped,
        "slowed_to": round(finished.outcome.least_rate, 3),
    }
    if prepared.config.then:
        found["then"] = [f"{change.name}@{change.at_s:g}" for change in prepared.config.then]
    if prepared.live is None and not prepared.config.then and by == "blend":
        way = gait_way(read_log(finished.log))
        found |= {
            "frequency_hz": round(way.frequency_hz, 3),
            "cycles": way.cycles,
            "forward_body_lengths_cycle": _digits(way.forward_bl),
            "left_body_lengths_cycle": _digits(way.left_bl),
            "up_body_lengths_cycle": _digits(way.up_bl),
            "turn_rad_cycle": _digits(way.turn_rad),
            "speed_m_s": _digits(way.speed_m_s),
        }
    found |= {
        "peak_current_a": finished.summary["peak_current_a"],
        "peak_temperature_c": finished.summary["peak_temperature_c"],
        "log": str(finished.log),
        "summary": str(folder / "summary.json"),
        "report": None if left.report is None else str(left.report),
        "film": None if left.film is None else str(left.film),
    }
    show(found, as_json)
    if finished.outcome.tripped is not None:
        raise SystemExit(1)


def _live(stack: ExitStack, live: bool, gamepad: Path | None) -> "Live | None":
    """Open what an operator holds; None without one."""
    if not live and gamepad is None:
        return None
    from controller.app.live.gamepad import Gamepad  # noqa: PLC0415
    from controller.app.live.keyboard import Keyboard  # noqa: PLC0415
    from controller.motion.operator import KEYS, Operator  # noqa: PLC0415

    hands: list[Keyboard | Gamepad] = []
    if live:
        hands.append(stack.enter_context(Keyboard()))
    if gamepad is not None:
        hands.append(stack.enter_context(Gamepad(gamepad)))
    print("  ".join(f"{key}: {what}" for key, what in KEYS.items()), file=sys.stderr)
    return lambda motion, robot, say: Operator(
        motion, robot, lambda: [key for hand in hands for key in hand.pressed()], say
    )


def _parameters(given: list[str] | None) -> dict[str, Any]:
    """Read NAME=VALUE pairs; the gait's model says what a value must be."""
    values: dict[str, Any] = {}
    for text in given or []:
        name, equals, value = text.partition("=")
        if not equals or not name or not value:
            raise InputError(f"--param {text}: expected NAME=VALUE")
        try:
            values[name] = json.loads(value)
        except json.JSONDecodeError:
            values[name] = value
    return values


def _change(text: str) -> tuple[float, str, dict[str, Any]]:
    """Read NAME@SECONDS[,PARAM=VALUE...]."""
    what, *values = text.split(",")
    name, at, seconds = what.rpartition("@")
    try:
        at_s = float(seconds)
    except ValueError:
        at = ""
    if not at or not name:
        raise InputError(f"--then {text}: expected NAME@SECONDS[,PARAM=VALUE...]")
    return at_s, name, _parameters(values)


def _point(text: str | None) -> tuple[float, float] | None:
    if text is None:
        return None
    try:
        x, y = (float(part) for part in text.split(","))
    except ValueError:
        raise InputError(f"--look-at {text}: expected X,Y in metres") from None
    return x, y


def _needs(gait: "type[Gait]") -> list[str]:
    return [name for name in ("yaw", "pitch", "wheels") if getattr(gait.needs, name)]


def _digits(value: float) -> float | None:
    return None if math.isnan(value) else round(value, 4)
