"""Schema of printed tags: those on the links of a robot, and those at known places."""

from typing import Self

from pydantic import Field, model_validator

from snakewalk.config.base import Strict
from snakewalk.config.pose import Degrees3, Metres3


class TagMount(Strict):
    """A tag on a link. Its x axis is the print's right, its y axis the print's top, z the normal.

    Angles are roll, pitch and yaw, turned about fixed axes in this order.
    """

    id: int = Field(ge=0, le=10_000, description="number of the tag in its dictionary")
    link: int = Field(ge=0, description="link of the spine that carries the tag; 0 is the head")
    offset_m: Metres3 = Field(
        description="middle of the tag from the link's centre: forward, left, up"
    )
    offset_deg: Degrees3 = Field(
        (0.0, 0.0, 0.0),
        description="roll, pitch and yaw of the tag's axes in the link's; default: the print's "
        "right is forward, and it faces up",
    )


class TagsConfig(Strict):
    """Printed tags on the links, for `--pose tags` (docs/how-to/tags.md)."""

    dictionary: str = Field(
        "APRILTAG_36h11",
        pattern=r"^[A-Za-z0-9_]+$",
        description="tag dictionary of OpenCV without the prefix DICT_, for "
        "example 4X4_50 or APRILTAG_36h11",
    )
    side_m: float = Field(
        0.04, gt=0.002, le=1.0, description="side of a tag: its black border, without the margin"
    )
    noise_px: float = Field(
        0.5, gt=0.01, le=20.0, description="standard deviation of a tag's corner in the picture"
    )
    on: tuple[TagMount, ...] = Field(
        min_length=1, description="tables of the tags on the robot, one for each tag"
    )

    @model_validator(mode="after")
    def _check_repeated_tags(self) -> Self:
        ids = [tag.id for tag in self.on]
        twice = sorted({number for number in ids if ids.count(number) > 1})
        if twice:
            raise ValueError(f"tag {twice[0]} is named twice")
        return self


class FixedTag(Strict):
    """A tag at a known place of the world, by which the camera finds its own place."""

    id: int = Field(ge=0, le=10_000, description="number of the tag in its dictionary")
    place_m: Metres3 = Field(description="middle of the tag in the world")
    turn_deg: Degrees3 = Field(
        (0.0, 0.0, 0.0),
        description="roll, pitch and yaw of the tag's axes; default: it lies flat, and the "
        "print's right points along x",
    )
    side_m: float | None = Field(
        None,
        gt=0.002,
        le=5.0,
        description="side length of the tag; default: that of the robot's tags",
    )
