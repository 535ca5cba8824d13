"""``snakewalk robot power``: the voltage along a chain under a load, computed from its cables."""

from typing import Annotated

import typer

from snakewalk.config.loader import load_robot
from snakewalk.config.robot import PowerConfig
from snakewalk.controller.bench.cable_drop import CONTACT_LIMIT_A, best_injection, drop_along
from snakewalk.controller.console.command import command
from snakewalk.controller.console.messages import LOGGER
from snakewalk.controller.console.options import Json, RobotName, print_table, show
from snakewalk.sim.servo.supply import Cabling


@command("robot power", examples=("robot power alternating16", "robot power my.toml --current 0.5"))
def power(
    name: RobotName,
    current: Annotated[
        float,
        typer.Option(min=0.0, max=10.0, help="supply current of each working servo in A"),
    ] = 0.1,
    leads: Annotated[
        int,
        typer.Option(
            min=0, max=3, help="number of additional places for injecting power to propose"
        ),
    ] = 2,
    as_json: Json = False,
) -> None:
    """Compute the voltage of each servo under a load, and where to inject power.

    Cables and leads come from the table `power` of the robot. Without one, the command assumes
    standard cables and power at the first servo.
    """
    robot = load_robot(name)
    described = robot.power or PowerConfig()
    drop = drop_along(robot, described, current)
    ids = robot.servo_ids
    cabling = Cabling.of(robot, described)
    most_a = float(abs(drop.cable_a).max(initial=0.0))
    low_v, high_v = float(drop.servo_v.min()), float(drop.servo_v.max())
    facts: dict[str, object] = {
        "robot": robot.name,
        "table [power]": "in the file" if robot.power is not None else "none: cables as sold",
        "supply_v": robot.servo.supply_v,
        "current_a": round(float(drop.drawn_a.sum()), 3),
        "highest_v": round(high_v, 2),
        "lowest_v": round(low_v, 2),
        "lowest_id": ids[int(drop.servo_v.argmin())],
        "cable_max_a": round(most_a, 2),
    }
    for count in range(1, leads + 1):
        best = best_injection(cabling, ids, robot.servo.supply_v, drop.drawn_a, count)
        if len(best.servo_ids) == count:
            facts[f"with {count} more"] = (
                f"at ID {', '.join(map(str, best.servo_ids))}: {best.lowest_v:.2f} V at the lowest"
            )
    rows = [
        {"id": servo_id, "voltage_v": round(float(v), 2), "cable_behind_a": a}
        for servo_id, v, a in zip(
            ids, drop.servo_v, [*(round(float(a), 2) for a in drop.cable_a), None], strict=True
        )
    ]
    show(facts | ({"servos": rows} if as_json else {}), as_json)
    if as_json:
        return
    print_table(("ID", "V", "cable behind it, A"), (row.values() for row in rows))
    if low_v < robot.servo.supply_limits_v[0]:
        LOGGER.warning("a run stops below %.1f V", robot.servo.supply_limits_v[0])
    if most_a > CONTACT_LIMIT_A:
        LOGGER.warning("the plugs are made for %g A", CONTACT_LIMIT_A)
