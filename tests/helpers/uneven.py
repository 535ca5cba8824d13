"""Robots whose links differ: heavy long head, two-axis modules, light tail."""

from snakewalk.config.robot import LinkConfig, RobotConfig

_MODULE = (LinkConfig(length_m=0.0, mass_kg=0.01), LinkConfig(mass_kg=0.2))
UNEVEN = RobotConfig(
    name="uneven",
    joint_axes="ypypypypyp",
    link_length_m=0.08,
    body_radius_m=0.04,
    links=(
        LinkConfig(length_m=0.12, mass_kg=0.3),
        *(4 * _MODULE),
        LinkConfig(length_m=0.0, mass_kg=0.01),
        LinkConfig(length_m=0.15, mass_kg=0.06, radius_m=0.02, shape="ball"),
    ),
)
"""Five two-axis modules: the axes of joints 1 and 2, 3 and 4 ... cross at one place."""


def spelt_out(robot: RobotConfig) -> RobotConfig:
    """The same chain, with each link's figures in a table of its own."""
    link = LinkConfig(
        length_m=robot.mean_link_length_m,
        mass_kg=robot.mean_link_mass_kg,
        radius_m=robot.body_radius_m,
        shape=robot.belly.shape,
    )
    return robot.model_copy(update={"links": (link,) * robot.link_count})
