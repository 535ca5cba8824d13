"""Named types of keys that are also options of commands: type, bounds, description, default."""

from typing import Annotated, Literal

from pydantic import Field

Seed = Annotated[int, Field(ge=0, lt=2**63, description="seed of every random choice")]
SEED = 0
MotionSeconds = Annotated[
    float, Field(ge=0.1, le=3600.0, description="duration of the motion in seconds")
]
MOTION_S = 20.0
GaitChangeMethod = Annotated[
    Literal["blend", "cpg"],
    Field(description="method for changes of the gait: blend, or cpg (coupled oscillators)"),
]
BLEND: Literal["blend"] = "blend"
LengthUnit = Annotated[
    Literal["m", "cm", "mm", "km", "ft"] | None,
    Field(description="unit of the calibration's translation T if it states none"),
]
Disparities = Annotated[
    int, Field(ge=16, le=2048, description="largest disparity to try in pixels")
]
DISPARITIES = 128
