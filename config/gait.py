"""Schemas of gaits: a run's table, and shipped parameter sets."""

from typing import Self

from pydantic import Field, model_validator

from snakewalk.config.base import Name, Strict
from snakewalk.config.compliance import ComplianceConfig
from snakewalk.config.key_types import BLEND, MOTION_S, GaitChangeMethod

Parameters = dict[str, bool | int | float]


class GaitChange(Strict):
    """Another gait at a time."""

    at_s: float = Field(gt=0.0, description="time of the change since the beginning of the run")
    name: str = Field(description="gait that the robot changes to; `snakewalk gait list` shows all")
    parameters: Parameters = Field(
        {}, description="values of gait parameters by name; the others keep their defaults"
    )


class AshoreConfig(Strict):
    """The gait that follows one that swims along waypoints, once the body has met the ground."""

    name: str = Field(description="gait on land, which walks along waypoints: trot or lateral-walk")
    parameters: Parameters = Field(
        {}, description="values of gait parameters by name; the others keep their defaults"
    )
    headway: float = Field(
        0.5,
        gt=0.0,
        lt=1.0,
        description="share of the best distance per cycle below which the body has met the ground",
    )


class GaitConfig(Strict):
    """A gait in place of a walk; its parameters and their ranges: `snakewalk gait show NAME`."""

    name: str = Field(description="name of the gait; `snakewalk gait list` shows all")
    parameters: Parameters = Field(
        {}, description="values of gait parameters by name; the others keep their defaults"
    )
    duration_s: float = Field(
        MOTION_S,
        gt=0.0,
        le=3600.0,
        description="duration of the motion, after which the robot comes to rest",
    )
    look_heading_rad: float | None = Field(None, description="world heading that the head keeps")
    look_at_m: tuple[float, float] | None = Field(None, description="point that the head looks at")
    then: tuple[GaitChange, ...] = Field(
        (), description="later gaits at rising times: tables of `at_s`, `name`, `parameters`"
    )
    ashore: AshoreConfig | None = Field(
        None,
        description="a table [gait.ashore]: gait along waypoints on land; default: none",
    )
    by: GaitChangeMethod = BLEND

    @model_validator(mode="after")
    def _times_rise(self) -> Self:
        times = [change.at_s for change in self.then]
        if times != sorted(set(times)) or (times and times[-1] >= self.duration_s):
            raise ValueError(f"then: times rise and lie before duration_s {self.duration_s:g}")
        return self


class GaitSetConfig(Strict):
    """A shipped set of parameters for one robot."""

    name: Name
    gait: str = Field(
        description="gait whose parameters this file has; `snakewalk gait list` shows all"
    )
    robot: str = Field(description="shipped robot that the parameters are for")
    world: str | None = Field(
        None, description="world of `snakewalk gait run`; default: the gait's own"
    )
    parameters: Parameters = Field(
        {}, description="values of gait parameters by name; the others keep their defaults"
    )
    compliance: ComplianceConfig | None = Field(
        None,
        description="a table [compliance]: joints yield to measured current; default: they do not",
    )
