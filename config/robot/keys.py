"""Top-level keys of a robot's file.

A key that `[[links]]` or `[[joints]]` may replace is not valid for all of them, so code cannot read
it: `robot.link_length_m` raises. `link_values` and `joint_values` give the value of each link and
joint.
"""

from typing import Any, NoReturn

from pydantic import Field

from snakewalk.config.base import Name, Strict
from snakewalk.config.camera import StereoHeadConfig
from snakewalk.config.pose import PoseConfig
from snakewalk.config.robot.imu import ImuConfig
from snakewalk.config.robot.joints import JointConfig
from snakewalk.config.robot.limbs import LimbsConfig
from snakewalk.config.robot.links import BellyConfig, LinkConfig
from snakewalk.config.robot.ports import PortConfig
from snakewalk.config.robot.power import PowerConfig
from snakewalk.config.robot.servo import ServoConfig
from snakewalk.config.ros import RosConfig
from snakewalk.config.servo_model import ServoModel
from snakewalk.config.tags import TagsConfig


class RobotKeys(Strict):
    """A robot's file as it is parsed."""

    name: Name
    joint_axes: str = Field(
        "",
        pattern=r"^[yp]*$",
        description="axes of the joints from the head, one letter each: y = yaw, p "
        "= pitch; required unless every joint of `[[joints]]` has its "
        "axis",
    )
    joints: tuple[JointConfig, ...] = Field(
        (), description="tables of the joints, one for each joint; default: all joints are equal"
    )
    links: tuple[LinkConfig, ...] = Field(
        (),
        description="tables of the links of the spine, one for each link; default: "
        "all links are equal",
    )
    link_length_m: float = Field(
        0.07, gt=0.005, le=1.0, description="distance from joint axis to joint axis"
    )
    body_radius_m: float = Field(
        0.03, gt=0.002, le=0.5, description="radius of the body, from its axis to the ground"
    )
    body_profile: tuple[float, ...] | None = Field(
        None,
        min_length=2,
        max_length=200,
        description="radii over body_radius_m at equal stations, head to tail, each over "
        "0.05 and at most 1; for the look and the ground step (snakewalk animal body measures it)",
    )
    belly: BellyConfig = BellyConfig()
    link_mass_kg: float = Field(0.11, gt=0.0001, le=20.0, description="mass of each link")
    yaw_limit_rad: float = Field(
        1.5, gt=0.05, le=3.1, description="largest angle of a yaw joint to each side"
    )
    pitch_limit_rad: float = Field(
        1.2, gt=0.05, le=3.1, description="largest angle of a pitch joint up and down"
    )
    joint_speed_limit_rad_s: float = Field(
        2.0, gt=0.0, description="largest speed of a joint in a plan"
    )
    joint_acceleration_limit_rad_s2: float = Field(
        25.0, gt=0.0, description="largest acceleration of a joint in a plan"
    )
    torque_limit_n_m: float = Field(2.0, gt=0.0, description="torque limit of a joint in a plan")
    limbs: tuple[LimbsConfig, ...] = Field(
        (), description="pairs of legs, from the tail to the head: tables [[limbs]]"
    )
    servo: ServoConfig = ServoConfig()
    described_models: tuple[ServoModel, ...] = Field(
        (),
        description="records of models that are not shipped; loading a robot fills it from the "
        "files that `model` names",
    )
    imu: ImuConfig | None = Field(None, description="a table [imu]; default: no IMU")
    stereo_head: StereoHeadConfig | None = Field(
        None, description="a table [stereo_head]; default: no stereo head"
    )
    pose: PoseConfig | None = Field(
        None,
        description="a table [pose]: the tracked body of an external pose source; default: the "
        "head link's centre in the world of the run",
    )
    tags: TagsConfig | None = Field(
        None, description="a table [tags]: printed tags on the links; default: no tags"
    )
    ros: RosConfig | None = Field(
        None,
        description="a table [ros]: frames that the ROS node publishes; default: the defaults of "
        "that table",
    )
    power: PowerConfig | None = Field(
        None, description="a table [power]; default: no voltage drop in the cables between servos"
    )
    ports: tuple[PortConfig, ...] = Field(
        (),
        description="tables [[ports]] of segments of the chain with separate "
        "adapters, for --port robot; default: all servos are on the "
        "port of --port",
    )


READ_INSTEAD = {
    "link_length_m": "link_lengths_m",
    "link_mass_kg": "link_masses_kg",
    "yaw_limit_rad": "limit_rad",
    "pitch_limit_rad": "limit_rad",
}
"""Keys that code cannot read, and the property that gives the value of each link or joint."""


class Unreadable:
    """Data descriptor of a parsed key that hides its value; pydantic still stores it."""

    def __get__(self, robot: object, owner: type) -> NoReturn:
        """Raise AttributeError; Python then calls ``RobotConfig.__getattr__``."""
        raise AttributeError

    def __set__(self, robot: object, value: object) -> NoReturn:
        """Raise AttributeError: a robot is frozen."""
        raise AttributeError


def parsed(robot: RobotKeys, key: str) -> Any:
    """Parsed value of a key; for this package only."""
    return robot.__dict__[key]
