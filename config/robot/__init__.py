"""Description of a robot: links, joints and servos of one chain."""

from snakewalk.config.robot.chain import RobotConfig
from snakewalk.config.robot.imu import ImuConfig, ImuModel
from snakewalk.config.robot.joints import JointConfig
from snakewalk.config.robot.limbs import LimbsConfig
from snakewalk.config.robot.links import BellyConfig, LinkConfig
from snakewalk.config.robot.ports import SIMULATED, PortConfig
from snakewalk.config.robot.power import PowerConfig
from snakewalk.config.robot.servo import LAST_ID, ServoConfig

__all__ = [
    "LAST_ID",
    "SIMULATED",
    "BellyConfig",
    "ImuConfig",
    "ImuModel",
    "JointConfig",
    "LimbsConfig",
    "LinkConfig",
    "PortConfig",
    "PowerConfig",
    "RobotConfig",
    "ServoConfig",
]
