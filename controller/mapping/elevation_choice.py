"""Facts about a file of elevations that it may not state."""

from typing import Annotated, Literal

from pydantic import Field

from snakewalk.config.answers import LISTED, Answers, TableAnswers
from snakewalk.config.key_types import LengthUnit
from snakewalk.controller.console.option import Flag

_Length = Literal["m", "cm", "mm", "km", "ft", "us-ft"]
SMALLEST = 1e-6
LARGEST = 1e6
"""Limits of lengths, m, and of factors: a value beyond them is in another unit (ours)."""


class ElevationChoice(Answers, TableAnswers):
    """Facts that a file of elevations may not state, and parts of it to use."""

    unit: Literal[_Length, "deg"] | None = Field(
        None, description="unit of the file; default: as it states"
    )
    height_unit: _Length | None = Field(
        None,
        description="unit of the file's heights; default: as it states, else as its lengths if "
        "metric",
    )
    cell: float | None = Field(
        None,
        ge=SMALLEST,
        le=LARGEST,
        description="distance between samples of a PNG, CSV or NPZ, in the file's unit",
    )
    height_step: float | None = Field(
        None,
        ge=SMALLEST,
        le=LARGEST,
        description="height per step of the file's values, in the file's unit",
    )
    no_data: float | None = Field(None, description="value of empty cells, such as -9999")
    point: Literal["lowest", "median", "highest"] | None = Field(
        None, description="point of a cell that counts; default: median"
    )
    up: Literal["z", "y", "x", "-z", "-y", "-x"] | None = Field(
        None, description="axis of a mesh or cloud that points up; default: z, of a GLB y"
    )
    classes: Annotated[tuple[Annotated[int, Field(ge=0, le=255)], ...] | None, LISTED] = Field(
        None, description="classes of LAS points, such as 2,9; default: ground, else all but noise"
    )
    assume: Annotated[dict[str, str], Flag(metavar="KEY=VALUE")] = Field(
        {}, description="KEY=VALUE: a value that a message asks for; may be repeated"
    )


class CalibrationChoice(Answers):
    """Facts that a calibration of two cameras may not state."""

    unit: LengthUnit = None
