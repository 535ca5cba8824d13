"""``snakewalk gait policy list``: the shipped policies."""

import json

from snakewalk.config.loader import shipped
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import Json, print_table
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
    lines = []
    for policy in policies:
        origin = policy.origin
        hz = "changing" if policy.network else f"{policy.wave.frequency_hz:.2f}"
        learnt = (origin.world, origin.law, origin.method, origin.seed, origin.steps)
        lines.append((policy.name, policy.robot, *learnt, hz, origin.software))
    heads = ("policy", "robot", "world", "law", "learnt by", "seed", "steps", "Hz", "made with")
    print_table(heads, lines)
