"""Links of the spine in a robot's file."""

from typing import Literal, Self

from pydantic import Field, model_validator

from snakewalk.config.base import Strict


class BellyConfig(Strict):
    """Shape with which a link meets the ground: a ball, a capsule along it, or two rails."""

    shape: Literal["ball", "capsule", "rails"] = Field(
        "capsule", description="shape of the part of a link that touches the ground"
    )
    width_m: float | None = Field(
        None, gt=0.002, le=1.0, description="width of rails, from outside to outside"
    )

    @model_validator(mode="after")
    def _rails_are_wide(self) -> Self:
        if self.shape == "rails" and self.width_m is None:
            raise ValueError("width_m: rails need their width")
        if self.shape != "rails" and self.width_m is not None:
            raise ValueError(
                f"width_m is of rails; a {self.shape} is as wide as body_radius_m says"
            )
        return self


LinkShape = Literal["ball", "capsule", "rails", "none"]


class LinkConfig(Strict):
    """Values of one link, `[[links]]` from the head; the other links have those of the chain."""

    length_m: float | None = Field(
        None,
        ge=0.0,
        le=1.0,
        description="length of the link between joint axes, for head and tail to "
        "the tip; 0 between the axes of a two-axis module; default: "
        "link_length_m",
    )
    mass_kg: float | None = Field(
        None, gt=0.0001, le=20.0, description="mass of the link; default: link_mass_kg"
    )
    radius_m: float | None = Field(
        None, gt=0.002, le=0.5, description="radius of the link; default: body_radius_m"
    )
    shape: LinkShape | None = Field(
        None,
        description="shape that meets the ground; default: belly.shape, or none if length_m is 0",
    )

    @model_validator(mode="after")
    def _is_as_long_as_its_shape(self) -> Self:
        if self.length_m is not None and 0.0 < self.length_m <= 0.005:
            raise ValueError("length_m: 0, or over 0.005")
        if self.length_m == 0.0 and self.shape in ("capsule", "rails"):
            raise ValueError(f"shape: a {self.shape} needs a length; ball or none")
        return self
