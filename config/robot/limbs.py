"""Legs in a robot's file."""

from typing import Literal, NamedTuple, Self

from pydantic import Field, model_validator

from snakewalk.config.base import Strict


class LimbsConfig(Strict):
    """A pair of legs at one link of the spine; the right leg is the mirror image of the left one.

    At zero angles a leg points straight to the side. On both sides a positive yaw joint swings the
    leg forward, and a positive roll joint lifts the foot.
    """

    link: int = Field(ge=0, description="link of the spine that carries the legs; 0 is the head")
    joint_axes: str = Field(
        "yr",
        pattern=r"^[yr]{1,4}$",
        description="axes of a leg's servos from the hip, one letter each: y = yaw "
        "(swings), r = roll (lifts)",
    )
    hip_m: float = Field(
        0.03, ge=0.0, le=1.0, description="distance of the first joint from the spine's axis"
    )
    segments_m: tuple[float, ...] = Field(
        (0.035, 0.09),
        description="lengths of a leg's segments from joint to joint, the last to "
        "the middle of the foot",
    )
    segment_mass_kg: float = Field(
        0.09, gt=0.001, le=20.0, description="mass of each segment of a leg"
    )
    foot_radius_m: float = Field(
        0.012, gt=0.002, le=0.2, description="radius of the ball at the end of a leg"
    )
    foot_friction: float = Field(
        0.8, gt=0.0, le=3.0, description="friction coefficient in all directions; default: rubber"
    )
    yaw_limit_rad: float = Field(
        1.2, gt=0.05, le=3.1, description="largest angle of a leg's yaw joint to each side"
    )
    roll_limit_rad: float = Field(
        1.5, gt=0.05, le=3.1, description="largest angle of a leg's roll joint up and down"
    )

    @model_validator(mode="after")
    def _a_segment_a_joint(self) -> Self:
        if len(self.segments_m) != len(self.joint_axes):
            raise ValueError(
                f"segments_m: {len(self.joint_axes)} lengths, one a joint, not "
                f"{len(self.segments_m)}"
            )
        if any(not 0.002 < length <= 1.0 for length in self.segments_m):
            raise ValueError("segments_m: lengths over 0.002 and at most 1")
        return self


SIDES: tuple[Literal["left"], Literal["right"]] = ("left", "right")


class LimbJoint(NamedTuple):
    """One joint of a leg; it moves the link with its index plus one."""

    pair: int
    """Index of the pair of limbs in ``limbs``."""
    side: Literal["left", "right"]
    place: int
    """Number of the segment in its limb; 0 at the hip."""
    has_foot: bool
    """Whether the link that the joint moves ends in the foot."""

    @property
    def outward(self) -> float:
        """Direction of the leg along the body's y: 1 is left, -1 is right."""
        return 1.0 if self.side == "left" else -1.0
