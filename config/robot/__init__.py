"""Description of a robot: links, joints and servos of one chain."""

from snakewalk.config.robot.chain import (
    LAST_ID,
    SIMULATED,
    STALL_CURRENT_A,
    BellyConfig,
    ImuConfig,
    ImuModel,
    JointConfig,
    LimbsConfig,
    LinkConfig,
    PortConfig,
    PowerConfig,
    RobotConfig,
    ServoConfig,
)

__all__ = [
    "LAST_ID",
    "SIMULATED",
    "STALL_CURRENT_A",
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
