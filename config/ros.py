"""Schema of a robot in a ROS graph: names of frames, and which of them are published."""

from typing import Literal

from pydantic import Field

from snakewalk.config.base import Strict

_FRAME = r"^[A-Za-z][A-Za-z0-9_/]*$"


class RosConfig(Strict):
    """Frames that the ROS node publishes (docs/ros.md)."""

    world_frame: str = Field(
        "world", pattern=_FRAME, max_length=100, description="frame of measured poses"
    )
    odom_frame: str = Field(
        "odom", pattern=_FRAME, max_length=100, description="frame of dead-reckoned poses"
    )
    tf: Literal["head", "links", "none"] = Field(
        "head",
        description="transforms to publish on /tf: of the head alone, as "
        "robot_state_publisher makes those of the links; of every "
        "link; or none",
    )
