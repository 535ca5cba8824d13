"""``snakewalk gait policy list``: the shipped policies."""

import json

from rich.table import Table

from snakewalk.config.loader import shipped
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import Json, console
from snakewalk.controller.motion.policy import load_policy


@command("gait policy list", examples=("gait policy list --json",))
def list_policies(as_json: Json = False) -> None:
    """List the shipped policies, and how each was learnt."""
    policies = [load_policy(name) for name in shipped("policies")]
    if as_json:
        rows = [
            policy.model_dump(exclude={"network"})
            | {
                "weights": sum(
                    len(layer.bias) * (len(layer.weights[0]) + 1) for layer in policy.network
                )
            }
            for policy in policies
        ]
        print(json.dumps({"policies": rows}))
        return
    table = Table(box=None, pad_edge=False)
    for title in (
        "policy",
        "robot",
        "world",
        "law",
        "learnt by",
        "seed",
        "steps",
        "Hz",
        "made with",
    ):
        table.add_column(title, justify="right" if title in {"seed", "steps", "Hz"} else "left")
    for policy in policies:
        origin = policy.origin
        hz = "changing" if policy.network else f"{policy.wave.frequency_hz:.2f}"
        ground = (origin.world, origin.law)
        numbers = (str(origin.seed), str(origin.steps), hz)
        table.add_row(policy.name, policy.robot, *ground, origin.method, *numbers, origin.software)
    console.print(table)
