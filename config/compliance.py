"""Joint goals that yield to the load in the measured current."""

from typing import Literal

from pydantic import Field

from snakewalk.config.base import Strict


class ComplianceConfig(Strict):
    """An admittance on the joints: a spring and a damper between the motion and the goals sent.

    At rest a joint that draws the current I beyond the dead band yields by ``I / stiffness_a_rad``.
    """

    joints: Literal["yaw", "pitch", "all"] = Field(
        "pitch", description="joints that yield to measured current"
    )
    stiffness_a_rad: float = Field(
        0.3, gt=0.0, le=100.0, description="current per radian that a joint yields"
    )
    damping_a_s_rad: float = Field(
        0.5, gt=0.0, le=100.0, description="current per rad/s at which a joint yields"
    )
    deadband_a: float = Field(
        0.0,
        ge=0.0,
        le=10.0,
        description="current to which no joint yields, such as the load of plain ground",
    )
    yield_limit_rad: float = Field(
        0.5, gt=0.0, le=3.0, description="largest angle by which a joint yields"
    )
    yield_rate_rad_s: float = Field(
        1.0, gt=0.0, le=10.0, description="largest speed at which a joint yields"
    )
    windows: int | None = Field(
        None,
        ge=1,
        le=100,
        description="parts of the body whose bends shrink and grow alike, so that its shape keeps "
        "its kind; default: each joint yields by itself",
    )
