"""``snakewalk robot show``: a robot in figures."""

from snakewalk.config.loader import load_robot
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import Json, RobotName, print_table, show


@command("robot show", examples=("robot show alternating16", "robot show my.toml"))
def show_robot(name: RobotName, as_json: Json = False) -> None:
    """Show a robot: its links, and servo, sign, zero and limit of each joint."""
    robot = load_robot(name)
    columns = (robot.servo_ids, robot.servo_models, robot.signs, robot.zeros_rad, robot.limit_rad)
    joints: list[dict[str, object]] = [
        {
            "joint": k,
            "axis": axis,
            "id": i,
            "model": m,
            "sign": s,
            "zero_rad": z,
            "limit_rad": limit,
        }
        for k, (axis, i, m, s, z, limit) in enumerate(
            zip(robot.all_axes, *columns, strict=True), start=1
        )
    ]
    links: list[dict[str, object]] = [
        {"link": k, "length_m": length_m, "mass_kg": mass_kg, "radius_m": radius_m, "shape": shape}
        for k, (length_m, mass_kg, radius_m, shape) in enumerate(
            zip(
                robot.link_lengths_m,
                robot.link_masses_kg,
                robot.link_radii_m,
                robot.link_shapes,
                strict=True,
            )
        )
        if robot.links
    ]
    facts: dict[str, object] = {
        "robot": robot.name,
        "links": robot.link_count,
        "link_length_m": round(robot.mean_link_length_m, 4),
        "body_radius_m": robot.body_radius_m,
        "length_m": round(robot.length_m, 4),
        "mass_kg": round(robot.mass_kg, 4),
        "baud": robot.servo.baud,
        "supply_v": robot.servo.supply_v,
    }
    show(facts | ({"joints": joints, "each_link": links} if as_json else {}), as_json)
    for rows in () if as_json else (joints, links):
        if rows:
            heads = (key.replace("_", " ") for key in rows[0])
            print_table(heads, (row.values() for row in rows))
