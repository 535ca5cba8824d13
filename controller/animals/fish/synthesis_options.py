"""Options of a synthesis of fish motion, on the command line and in Python."""

from itertools import pairwise
from pathlib import Path
from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from snakewalk.config.base import Strict
from snakewalk.config.constants import DEFAULT_ROBOT
from snakewalk.controller.console import completion
from snakewalk.controller.console.option import Flag, numbers

Point = tuple[float, float] | tuple[float, float, float]


def _points(points: tuple[Point, ...]) -> tuple[Point, ...]:
    if len({len(point) for point in points}) > 1:
        raise ValueError("give the height of all control points, or of none")
    for number, (before, other) in enumerate(pairwise(points), 1):
        if before == other:
            raise ValueError(f"control points {number} and {number + 1} are the same; remove one")
    return points


def _tank(walls: tuple[float, ...] | None) -> tuple[float, ...] | None:
    if walls is not None and max(walls[2] - walls[0], walls[3] - walls[1]) < 1.0:
        raise ValueError(
            "no wall is as long as the fish, whose length is 1; give XMIN,YMIN,XMAX,YMAX in body "
            "lengths"
        )
    return walls


class SynthesisOptions(Strict):
    """The options of a synthesis; angles in degrees, as on the command line."""

    through: Annotated[
        tuple[
            Annotated[
                Point,
                numbers("a control point is X,Y, as in 3,-1.5, or X,Y,Z with its height", 2, 3),
            ],
            ...,
        ],
        AfterValidator(_points),
    ] = Field((), description="control point X,Y or X,Y,Z; may be repeated")
    seconds: float = Field(
        20.0, ge=0.1, le=3600.0, description="shortest duration of a random motion in seconds"
    )
    seed: int = Field(0, ge=0, description="seed of the random order")
    radius: float = Field(0.1, ge=0.01, description="radius of a control point in body lengths")
    start: Annotated[tuple[float, float, float], numbers("give X,Y,DEGREES, as in 1,0.5,90", 3)] = (
        Field(
            (0.0, 0.0, 0.0),
            description="place and direction in degrees of the first posture: X,Y,DEGREES",
        )
    )
    tank: Annotated[
        tuple[float, float, float, float] | None,
        numbers("give XMIN,YMIN,XMAX,YMAX, as in -2,-2,6,4", 4),
        AfterValidator(_tank),
    ] = Field(None, description="walls to keep away from: XMIN,YMIN,XMAX,YMAX")
    avoid: tuple[Path, ...] = Field(
        (), description="track of another fish to keep away from; may be repeated"
    )
    apart: float = Field(
        0.5, ge=0.0, description="least distance from walls and other fish in body lengths"
    )
    limit_s: Annotated[float, Flag(("--limit",))] = Field(
        120.0,
        ge=1.0,
        le=3600.0,
        description="time limit in seconds for reaching all control points",
    )
    mirror: bool = Field(False, description="also use the mirror image of every segment")
    within_deg: Annotated[float, Flag(("--within",))] = Field(
        4.0, ge=0.1, le=45.0, description="largest difference from the basic posture in degrees"
    )
    merge_deg: Annotated[float, Flag(("--merge",))] = Field(
        20.0, ge=0.0, description="merge tail beats that differ by fewer degrees than this"
    )
    reference: Literal["straight", "commonest"] = Field(
        "straight", description="basic posture: straight, or the commonest of the film"
    )
    blend_s: Annotated[float, Flag(("--blend",))] = Field(
        0.25, ge=0.02, description="duration of the blend at a join in seconds"
    )
    robot: Annotated[str, Flag(complete=completion.ROBOTS)] = Field(
        DEFAULT_ROBOT, description="add the joint angles of this robot to the track"
    )
