"""An IMU on the bus of the servos."""

import math
from typing import Literal, Self

from pydantic import Field, model_validator

from snakewalk.config.base import Strict
from snakewalk.config.robot.servo import LAST_ID

ImuModel = Literal["imu_to_dxl", "FFW-G40-IMU"]
Degrees3 = tuple[float, float, float]


class ImuConfig(Strict):
    """An IMU on the bus of the servos, in a link of the spine (docs/imu.md).

    The noise and the bias are those of the simulated device; on servos they are what they are.
    """

    model: ImuModel = Field(
        "imu_to_dxl", description="model of the IMU, which selects one of two public control tables"
    )
    id: int = Field(200, ge=0, le=LAST_ID, description="ID of the IMU on the bus")
    link: int = Field(0, ge=0, description="link of the spine that contains the IMU; 0 is the head")
    mounting_deg: Degrees3 = Field(
        (0.0, 0.0, 0.0),
        description="roll, pitch and yaw of the IMU's axes in the link's (forward, "
        "left, up), turned about the link's axes in this order",
    )
    gyro_range_dps: float | None = Field(
        None,
        gt=0.0,
        le=4000.0,
        description="turn rate of 32768 counts; required for FFW-G40-IMU, whose "
        "control table does not state it",
    )
    acceleration_range_g: float | None = Field(
        None,
        gt=0.0,
        le=64.0,
        description="acceleration of 32768 counts; required for FFW-G40-IMU",
    )
    gyro_bias_dps: float = Field(
        0.1,
        ge=0.0,
        le=10.0,
        description="standard deviation of the gyroscope's constant error, in simulation",
    )
    gyro_noise_dps: float = Field(
        0.05,
        ge=0.0,
        le=10.0,
        description="standard deviation of a reading of the gyroscope, in simulation",
    )
    acceleration_noise_m_s2: float = Field(
        0.05,
        ge=0.0,
        le=10.0,
        description="standard deviation of a reading of the accelerometer, in simulation",
    )

    @model_validator(mode="after")
    def _ranges_where_they_are_open(self) -> Self:
        ranges = {
            "gyro_range_dps": self.gyro_range_dps,
            "acceleration_range_g": self.acceleration_range_g,
        }
        for key, value in ranges.items():
            if self.model == "imu_to_dxl" and value is not None:
                raise ValueError(f"{key}: an imu_to_dxl has 500 dps, and shows no acceleration")
            if self.model != "imu_to_dxl" and value is None:
                raise ValueError(f"{key}: required for a {self.model}: as its board is set up")
        if not all(map(math.isfinite, self.mounting_deg)):
            raise ValueError("mounting_deg: three finite angles")
        return self
