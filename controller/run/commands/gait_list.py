"""``snakewalk gait list``: the gaits and their shipped parameters."""

import json

from snakewalk.config.loader import load_gait, shipped
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import Json, console, print_table
from snakewalk.controller.gaits.registry import GAITS
from snakewalk.controller.run.commands.gait_options import needed_joints


@command("gait list", examples=("gait list --json",))
def list_gaits(as_json: Json = False) -> None:
    """List the gaits, the joints that they need, and the shipped sets of their parameters."""
    sets = [load_gait(name) for name in shipped("gaits")]
    if as_json:
        rows = [
            {"name": g.name, "title": g.title, "needs": needed_joints(g), "source": g.source}
            for g in GAITS.values()
        ]
        print(json.dumps({"gaits": rows, "sets": [s.model_dump() for s in sets]}))
        return
    gaits = [(gait.name, ", ".join(needed_joints(gait)), gait.title) for gait in GAITS.values()]
    print_table(("gait", "needs", ""), gaits)
    if sets:
        console.print()
        print_table(("set", "gait", "robot"), ((s.name, s.gait, s.robot) for s in sets))
