"""The actions of a repertoire as a table and as a picture."""

import json
from pathlib import Path
from types import ModuleType
from typing import Annotated

import typer

from snakewalk.controller.console.options import console, print_table
from snakewalk.controller.repertoire.repertoire import Repertoire

Picture = Annotated[Path | None, typer.Option(help="draw the path of each action here")]


def plots() -> ModuleType:
    """Return the module that draws a repertoire."""
    from snakewalk.controller.repertoire import repertoire_plots  # noqa: PLC0415  --picture: an extra

    return repertoire_plots


def show_actions(file: Path, repertoire: Repertoire, as_json: bool) -> None:
    """Print speed, turn and closure error of each action."""
    rows = [
        {
            "name": segment.name,
            "kind": segment.kind,
            "frames": segment.frames,
            "cycle_s": round(segment.duration_s, 3),
            "speed_m_s": round(segment.speed_m_s, 4),
            "turn_rad_cycle": round(segment.turn_rad_s * segment.duration_s, 4),
            "closure_mm": round(1e3 * segment.closure_m, 3),
            "closure_mrad": round(1e3 * segment.closure_rad, 3),
        }
        for segment in repertoire.segments
    ]
    if as_json:
        about = {"file": str(file), "robot": repertoire.robot, "world": repertoire.world}
        print(json.dumps(about | {"friction_law": repertoire.law, "actions": rows}))
        return
    heads = {
        "cycle_s": "cycle\ns",
        "speed_m_s": "speed\nm/s",
        "turn_rad_cycle": "turn, rad\na cycle",
    }
    heads |= {"closure_mm": "closure\nmm", "closure_mrad": "closure\nmrad"}
    console.print(
        f"{file}: {repertoire.robot} on {repertoire.world}, law of friction: {repertoire.law}"
    )
    print_table((heads.get(key, key) for key in rows[0]), (row.values() for row in rows))
