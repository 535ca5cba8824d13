"""Options of a film of a fish, on the command line and in Python."""

from typing import Annotated, Literal

import typer
from pydantic import Field

from snakewalk.config.base import Strict
from snakewalk.controller.console import completion
from snakewalk.controller.console.option import Flag

FishBuild = Literal["carp", "eel"]
Build = Annotated[
    FishBuild,
    typer.Option(help="model of the body: carp (A0..A3 behind a rigid head) or eel (8 angles)"),
]


BUILD: FishBuild = "carp"


class FishFilmOptions(Strict):
    """The options of a rendered film; lengths in body lengths, if not in pixels."""

    motion: Annotated[str | None, Flag(complete=completion.RECORDINGS)] = Field(
        None, description="recording to render; default: a scripted fish"
    )
    build: Build = BUILD
    length_px: float = Field(120.0, ge=20, le=2000, description="body length in pixels")
    frames: int | None = Field(None, ge=2, description="largest number of frames to render")
    side: bool = Field(False, description="render a second film from the side")
    fins: float = Field(
        0.0, ge=0.0, le=0.3, description="length of pectoral fins seen from above, in body lengths"
    )
    seed: int = Field(0, ge=0, description="seed of patterns and noise")
