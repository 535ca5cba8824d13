"""``snakewalk list``: what is shipped."""

import json

from rich.table import Table

from snakewalk.controller.app.cli.options import Json, console


def list_(as_json: Json = False) -> None:
    """List the shipped runs, robots and worlds."""
    from snakewalk.config.loader import load_robot, load_run, load_world, shipped  # noqa: PLC0415  --help stays quick

    rows = {
        "runs": [[n, f"{(r := load_run(n)).robot} on {r.world}"] for n in shipped("runs")],
        "robots": [
            [n, f"{b.joint_count} {', '.join(dict.fromkeys(b.servo_models))}, {b.length_m:.2f} m"]
            for n in shipped("robots")
            for b in [load_robot(n)]
        ],
        "worlds": [[n, load_world(n).ground.kind] for n in shipped("worlds")],
    }
    if as_json:
        print(json.dumps({kind: [name for name, _ in rs] for kind, rs in rows.items()}))
        return
    for kind, lines in rows.items():
        table = Table(title=kind, title_justify="left", box=None, show_header=False)
        for line in lines:
            table.add_row(f"  {line[0]}", line[1])
        console.print(table)
