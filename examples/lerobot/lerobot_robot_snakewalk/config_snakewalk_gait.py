"""Configuration of the teleoperator; LeRobot reads it from ``--teleop.type=snakewalk_gait``."""

from dataclasses import dataclass, field

from lerobot.teleoperators import TeleoperatorConfig


@TeleoperatorConfig.register_subclass("snakewalk_gait")
@dataclass(kw_only=True)
class SnakewalkGaitConfig(TeleoperatorConfig):
    """A gait of snakewalk that generates the joint goals."""

    robot: str = "yaw16"
    """Name of a shipped robot, or a TOML file; the same as of the robot."""
    gait: str = "lateral-undulation"
    """Name of the gait; ``snakewalk list`` shows all."""
    params: dict[str, float] = field(default_factory=dict)
    """Parameters of the gait that replace its defaults."""
