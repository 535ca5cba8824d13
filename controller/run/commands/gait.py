"""``snakewalk gait``: which gaits there are, and what they look like."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table

from snakewalk.config.loader import load_gait, shipped
from snakewalk.controller.console import completion
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import Force, Json, Robot, console, key_values, show
from snakewalk.controller.console.result_files import check_picture, refuse_to_overwrite
from snakewalk.controller.figures.gait import draw_gait
from snakewalk.controller.gaits.gait import ranges
from snakewalk.controller.gaits.registry import GAITS
from snakewalk.controller.motion.gait_cycle import GaitCycle
from snakewalk.controller.run.factory import prepare_gait

if TYPE_CHECKING:
    from snakewalk.controller.gaits.gait import Gait

Name = Annotated[
    str,
    typer.Argument(
        help="gait, shipped set of parameters, or a SET.toml", autocompletion=completion.GAITS
    ),
]
Param = Annotated[
    list[str] | None, typer.Option("--param", "-p", help="NAME=VALUE; may be given again")
]


@command("gait list", examples=("gait list --json",))
def list_gaits(as_json: Json = False) -> None:
    """List the gaits, what joints they need, and the shipped sets of their parameters."""
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


@command("gait show", examples=("gait show sidewinding", "gait show rolling --picture rolling.png"))
def show_gait(
    name: Name,
    robot: Robot = None,
    param: Param = None,
    picture: Annotated[
        Path | None, typer.Option(help="draw the body over a cycle here (.png, .svg, .pdf)")
    ] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Show a gait's parameters with ranges and units, its source, and how fast joints must be."""
    check_picture(picture)
    refuse_to_overwrite([picture], force)

    prepared = prepare_gait(name, robot=robot, parameters=parameters(param))
    gait, body = prepared.gait, prepared.robot
    cycle = GaitCycle(gait, body)
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
                "description": span.description,
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
        table.add_row(key, shown, least, most, span.description)
    console.print()
    console.print(table)


def parameters(given: list[str] | None) -> dict[str, Any]:
    """Read NAME=VALUE pairs; the gait's model says what a value must be."""
    return key_values("--param", given, "NAME=VALUE")


def _needs(gait: "type[Gait]") -> list[str]:
    return [name for name in ("yaw", "pitch", "legs", "wheels") if getattr(gait.needs, name)]
