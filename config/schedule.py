"""Requested speed and turn rate over time, and recorded actions (table ``repertoire`` of a run)."""

from typing import Annotated

from pydantic import Field

from snakewalk.config.base import Strict
from snakewalk.config.key_types import MOTION_S
from snakewalk.config.synthesis import Curve, Knots


class ScheduleConfig(Strict):
    """Wanted speed and turn; a curve is a number, or [[s, value]...]: linear between, level beyond.

    Below the half of the slowest action's speed the body rests, below nought it goes back.
    """

    speed_m_s: Annotated[Curve, Knots] = Field(0.4, description="requested speed along the body")
    turn_rad_s: Annotated[Curve, Knots] = Field(
        0.0, description="requested turn rate, positive to the left"
    )
    duration_s: float = Field(
        MOTION_S, gt=0.0, description="duration of the motion, after which the robot comes to rest"
    )


class RepertoireConfig(ScheduleConfig):
    """Recorded actions in place of a walk ([YT])."""

    file: str = Field(description="file that `snakewalk gait repertoire record` wrote")
    patience: int | None = Field(
        None,
        ge=1,
        description="number of cycles after which another action of the same kind "
        "follows; default: no change",
    )
