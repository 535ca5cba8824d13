"""``snakewalk list``: shipped and installed items."""

import json

from rich.table import Table

from snakewalk.config.loader import load_gait, load_robot, load_run, load_world, shipped
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import Json, console
from snakewalk.controller.console.plugins import OWN, plugins


@command("list", examples=("list --json",))
def list_(as_json: Json = False) -> None:
    """List runs, robots, worlds, recordings, policies, gaits and plug-ins."""
    rows = {
        "runs": [[n, f"{(r := load_run(n)).robot} on {r.world}"] for n in shipped("runs")],
        "robots": [
            [n, f"{b.joint_count} {', '.join(dict.fromkeys(b.servo_models))}, {b.length_m:.2f} m"]
            for n in shipped("robots")
            for b in [load_robot(n)]
        ],
        "worlds": [[n, load_world(n).ground.kind] for n in shipped("worlds")],
        "recordings": [
            [n, "snakewalk animal track, play, run --track"] for n in shipped("recordings")
        ],
        "policies": [[n, "snakewalk gait policy list, run"] for n in shipped("policies")],
        "gaits": [[n, f"{(g := load_gait(n)).gait} on {g.robot}"] for n in shipped("gaits")],
        "plug-ins": [
            [f"{plugin.kind} {plugin.name}", plugin.package]
            for plugin in plugins()
            if plugin.kind != "command" or not plugin.package.startswith(f"{OWN}.")
        ],
    }
    if as_json:
        print(json.dumps({kind: [name for name, _ in rs] for kind, rs in rows.items()}))
        return
    for kind, lines in rows.items():
        table = Table(title=kind, title_justify="left", box=None, show_header=False)
        for line in lines:
            table.add_row(f"  {line[0]}", line[1])
        console.print(table)
    console.print("all gaits: snakewalk gait list")
