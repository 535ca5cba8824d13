"""Joints in a robot's file."""

import math
from typing import Literal

from pydantic import Field, SerializerFunctionWrapHandler, model_serializer

from snakewalk.config.base import Strict
from snakewalk.config.joint_names import JOINT_NAME_PATTERN
from snakewalk.config.robot.servo import LAST_ID


class JointConfig(Strict):
    """Values of one joint, `[[joints]]` from the head; the other joints have those of the chain."""

    name: str | None = Field(
        None,
        max_length=60,
        pattern=JOINT_NAME_PATTERN,
        description="name of the joint in messages, tables and ROS: letters, "
        "digits and _; default: axis and place from the head, such as "
        "yaw_03",
    )
    axis: Literal["y", "p"] | None = Field(
        None,
        description="axis of the joint: y = yaw, p = pitch; required unless joint_axes is given",
    )
    id: int | None = Field(
        None,
        ge=0,
        le=LAST_ID,
        description="ID of the joint's servo; default: counted from servo.first_id",
    )
    model: str | None = Field(None, description="model of the joint's servo; default: servo.model")
    sign: Literal[1, -1] = Field(
        1,
        description="direction of the joint's servo: 1, or -1 if it is mounted the other way round",
    )
    zero_rad: float = Field(
        0.0,
        ge=-math.pi,
        le=math.pi,
        description="angle of the joint's servo, from the servo's zero, if the "
        "joint is straight; rounded to the nearest position",
    )
    limit_rad: float | None = Field(
        None,
        gt=0.05,
        le=3.1,
        description="largest angle of the joint to each side; default: "
        "yaw_limit_rad or pitch_limit_rad",
    )
    position_p_gain: int | None = Field(
        None,
        ge=0,
        le=16383,
        description="Position P Gain of the joint; default: servo.position_p_gain "
        "or servo.pitch_p_gain",
    )
    position_i_gain: int | None = Field(
        None,
        ge=0,
        le=16383,
        description="Position I Gain of the joint; default: servo.position_i_gain",
    )
    position_d_gain: int | None = Field(
        None,
        ge=0,
        le=16383,
        description="Position D Gain of the joint; default: servo.position_d_gain",
    )
    current_limit_a: float | None = Field(
        None,
        gt=0.0,
        description="Goal Current of a pitch joint; default: servo.pitch_current_limit_a",
    )
    armature_kg_m2: float | None = Field(
        None,
        ge=0.0,
        le=1.0,
        description="inertia of the joint's rotor and gears; default: servo.armature_kg_m2",
    )
    gear_drag_n_m_s: float | None = Field(
        None,
        ge=0.0,
        le=10.0,
        description="viscous loss of the joint's gears; default: servo.gear_drag_n_m_s",
    )

    @model_serializer(mode="wrap")
    def _without_a_default_name(self, handler: SerializerFunctionWrapHandler) -> dict[str, object]:
        """Omit an unset name, so that logs keep their bytes."""
        keys: dict[str, object] = handler(self)
        if self.name is None:
            keys.pop("name", None)
        return keys
