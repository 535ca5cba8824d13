"""Facts about a robot model that its file may not state."""

from typing import Annotated

from pydantic import Field

from snakewalk.config.answers import Answers
from snakewalk.controller.console.option import Flag


class RobotChoice(Answers):
    """Facts that a model may not state."""

    scale: float = Field(1.0, ge=1e-3, le=1e3, description="factor on lengths")
    mass_scale: float | None = Field(
        None,
        ge=1e-9,
        le=1e9,
        description="factor on masses; default: the cube of --scale; 1 for a model in millimetres "
        "and kilograms",
    )
    reverse: bool = Field(False, description="the first body of the model is the tail")
    assume: Annotated[dict[str, str], Flag(metavar="KEY=VALUE")] = Field(
        {}, description="KEY=VALUE: a value that a message asks for; may be repeated"
    )


NOTHING = RobotChoice()
"""Choice of nothing: the model states all."""
