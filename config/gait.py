"""Which gait moves, with what parameters: a run's table, and the shipped sets of parameters."""

from pydantic import Field

from config.base import Strict

Parameters = dict[str, bool | int | float]


class GaitConfig(Strict):
    """A gait in place of a walk; its parameters and their ranges: `snakewalk gait show NAME`."""

    name: str = Field(description="one of `snakewalk gait list`")
    parameters: Parameters = Field({}, description="by name; the rest keep their defaults")
    duration_s: float = Field(20.0, gt=0.0, le=3600.0, description="then it comes to rest")
    look_heading_rad: float | None = Field(None, description="world heading that the head keeps")
    look_at_m: tuple[float, float] | None = Field(None, description="point that the head looks at")


class GaitSetConfig(Strict):
    """A shipped set of parameters for one robot."""

    name: str
    gait: str
    robot: str
    world: str | None = Field(None, description="default: the gait's own")
    parameters: Parameters = Field({}, description="by name; the rest keep their defaults")
