"""Configuration of the robot; LeRobot reads it from ``--robot.type=snakewalk`` and its keys."""

from dataclasses import dataclass, field

from lerobot.cameras import CameraConfig
from lerobot.robots import RobotConfig


@RobotConfig.register_subclass("snakewalk")
@dataclass(kw_only=True)
class SnakewalkConfig(RobotConfig):
    """A chain of servos on a port."""

    port: str
    """Serial device, for example one that ``snakewalk bus serve`` prints; or ``sim``: servos on a
    bench, simulated in this process; with ``simulator_camera``, the robot in a child process."""
    robot: str = "yaw16"
    """Name of a shipped robot, or a TOML file."""
    rate_hz: float = 50.0
    """Control cycles per second; LeRobot's frame rate may be lower."""
    cameras: dict[str, CameraConfig] = field(default_factory=dict)
    """Cameras of LeRobot, by name."""
    simulator_camera: bool = False
    """Observe pictures of the simulated robot, 480 by 640, as ``simulator``; needs port ``sim``."""
    world: str = "flat"
    """Ground of the robot that ``simulator_camera`` shows: a shipped world, or a TOML file."""
