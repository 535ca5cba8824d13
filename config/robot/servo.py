"""Settings of the servos in a robot's file."""

from typing import Literal, Self

from pydantic import Field, model_validator

from snakewalk.config.base import Strict
from snakewalk.config.constants import DEFAULT_BAUD, DEFAULT_SERVO_MODEL
from snakewalk.config.motor import MotorConfig

Baud = Literal[9600, 57600, 115200, 1_000_000, 2_000_000, 3_000_000, 4_000_000, 4_500_000]
LAST_ID = 252


class ServoConfig(Strict):
    """Settings of all servos of the chain."""

    model: str = Field(
        DEFAULT_SERVO_MODEL,
        description="name as printed on the servo, or a file that describes the model "
        "(docs/how-to/add-a-servo-model.md)",
    )
    first_id: int = Field(1, ge=0, le=LAST_ID, description="ID of the joint next to the head")
    baud: Baud = Field(DEFAULT_BAUD, description="baud rate of the bus")
    supply_v: float = Field(12.0, ge=3.0, le=26.0, description="voltage of the servos' supply")
    supply_min_v: float | None = Field(
        None,
        gt=0.0,
        description="supply voltage below which a run stops; default: 10/12 of supply_v",
    )
    supply_max_v: float | None = Field(
        None,
        gt=0.0,
        description="supply voltage above which a run stops; default: 14.8/12 of supply_v",
    )
    over_current_a: float | None = Field(
        None,
        gt=0.0,
        description="servo current above which a run stops; default: 20/23 of the "
        "model's stall current",
    )
    position_p_gain: int = Field(800, ge=0, le=16383, description="Position P Gain (register 84)")
    position_i_gain: int = Field(0, ge=0, le=16383, description="Position I Gain (register 82)")
    position_d_gain: int = Field(0, ge=0, le=16383, description="Position D Gain (register 80)")
    pitch_p_gain: int = Field(
        400,
        ge=0,
        le=16383,
        description="Position P Gain of the pitch joints (register 84); a lower "
        "gain follows the ground",
    )
    pitch_lead_s: float = Field(
        0.25, ge=0.0, le=2.0, description="lead of pitch goals, for filter and servo lag"
    )
    pitch_current_limit_a: float = Field(
        0.1, gt=0.0, description="Goal Current of the pitch joints in current-based position mode"
    )
    armature_kg_m2: float = Field(
        0.045, ge=0.0, le=1.0, description="inertia of rotor and gears at the shaft, in simulation"
    )
    gear_drag_n_m_s: float = Field(
        0.03, ge=0.0, le=10.0, description="viscous loss of the gears at the shaft, in simulation"
    )
    motor: MotorConfig | None = Field(
        None,
        description="a table [servo.motor]; default: the model's constants, without friction",
    )

    @model_validator(mode="after")
    def _supply_is_within_its_limits(self) -> Self:
        low_v, high_v = self.supply_limits_v
        if not low_v <= self.supply_v <= high_v:
            raise ValueError(
                f"supply_v = {self.supply_v:g} is not within supply_min_v = {low_v:g} and "
                f"supply_max_v = {high_v:g}"
            )
        return self

    @property
    def supply_limits_v(self) -> tuple[float, float]:
        """Lowest and highest supply of a run without its own limits."""
        low_v, high_v = self.supply_min_v, self.supply_max_v
        return (
            self.supply_v * 10.0 / 12.0 if low_v is None else low_v,
            self.supply_v * 14.8 / 12.0 if high_v is None else high_v,
        )
