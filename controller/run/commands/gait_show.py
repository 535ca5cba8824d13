"""``snakewalk gait show``: the parameters, the source and a picture of a gait."""

import json
from pathlib import Path
from typing import Annotated

import typer

from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import (
    Force,
    Json,
    Robot,
    console,
    print_table,
    show,
)
from snakewalk.controller.console.result_files import check_picture
from snakewalk.controller.gaits.gait import ranges
from snakewalk.controller.motion.gait_cycle import GaitCycle
from snakewalk.controller.run.commands.gait_options import Name, Param, needed_joints, parameters
from snakewalk.controller.run.kinds.gait_factory import prepare_gait


@command(
    "gait show",
    examples=("gait show sidewinding", "gait show rolling --picture rolling.png"),
    results=("picture",),
)
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
    """Show a gait's parameters with ranges and units, its source, and the joint speeds it needs."""
    check_picture(picture)
    prepared = prepare_gait(name, robot=robot, parameters=parameters(param))
    gait = prepared.gait
    body = prepared.robot
    cycle = GaitCycle(gait, body)
    spans = ranges(gait.model)
    facts: dict[str, object] = {
        "gait": gait.name,
        "title": gait.title,
        "source": gait.source,
        "needs": needed_joints(type(gait)),
        "robot": body.name,
        "frequency_hz": round(cycle.frequency_hz, 3),
        "joint_speed_rad_s": round(float(cycle.pace().speed_rad_s.max()), 3),
    }
    if picture is not None:
        from snakewalk.controller.figures.gait import draw_gait  # noqa: PLC0415  --picture: an extra

        draw_gait(gait, body, picture)
        facts["picture"] = str(picture)
    values = gait.params.model_dump()
    if as_json:
        rows = {
            key: {
                "value": values[key],
                "default": span.default,
                "low": span.low,
                "high": span.high,
                "description": span.description,
            }
            for key, span in spans.items()
        }
        print(json.dumps(facts | {"parameters": rows}))
        return
    facts["needs"] = ", ".join(needed_joints(type(gait)))
    show(facts, as_json=False)
    lines = []
    for key, span in spans.items():
        value = values[key]
        shown = str(value) if isinstance(value, bool | int) else f"{value:.4g}"
        least, most = ("", "") if span.kind is bool else (f"{span.low:.4g}", f"{span.high:.4g}")
        lines.append((key, shown, least, most, span.description))
    console.print()
    print_table(("parameter", "value", "least", "most", ""), lines)
