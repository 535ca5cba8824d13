"""What a shipped skin is: sections along a straight body, fins, and two colours."""

from typing import Annotated

from pydantic import Field, model_validator

from snakewalk.config.base import Strict

Place = Annotated[float, Field(ge=0.0, le=1.0)]
Channel = Annotated[float, Field(ge=0.0, le=1.0)]


class SectionConfig(Strict):
    """An ellipse across the body; lengths over the body's."""

    at: Place = Field(description="place along the body, 0 the head's tip")
    half_width: float = Field(ge=0.0, le=0.5)
    half_height: float = Field(ge=0.0, le=0.5)
    lift: float = Field(0.0, ge=-0.5, le=0.5, description="of its middle above the body's axis")


class FinConfig(Strict):
    """A fin; lengths over the body's."""

    at: Place = Field(description="middle of the root along the body")
    chord: float = Field(gt=0.0, le=0.8, description="length of the root")
    around_deg: float = Field(ge=-180.0, le=180.0, description="90 the back, 0 left, -90 the belly")
    span: float = Field(gt=0.0, le=0.5, description="from root to tip")
    sweep: float = Field(0.0, ge=-0.5, le=0.5, description="of the tip's middle, backwards")
    tip_chord: float = Field(0.4, gt=0.0, le=2.0, description="the tip's length over the root's")
    thickness: float = Field(0.004, gt=0.0, le=0.05, description="half of it, at the root")
    paired: bool = Field(False, description="the same on the other side")


class SkinConfig(Strict):
    """A body to be covered by PDE patches."""

    name: str
    source: str = Field(description="where the figures come from")
    sections: tuple[SectionConfig, ...] = Field(min_length=4, description="head to tail")
    fins: tuple[FinConfig, ...] = ()
    back_rgb: tuple[Channel, Channel, Channel] = (0.66, 0.48, 0.20)
    band_rgb: tuple[Channel, Channel, Channel] = (0.36, 0.22, 0.11)
    bands: int = Field(0, ge=0, le=60, description="dark bands across the back")
    eye_at: Place = Field(0.05, description="place of the eyes along the body")
    eye_radius: float = Field(0.006, gt=0.0, le=0.05)

    @model_validator(mode="after")
    def _from_tip_to_tip(self) -> "SkinConfig":
        places = [section.at for section in self.sections]
        if places[0] != 0.0 or places[-1] != 1.0 or places != sorted(set(places)):
            raise ValueError("sections must rise in `at`, from 0 to 1")
        if any(min(s.half_width, s.half_height) == 0.0 for s in self.sections[1:-1]):
            raise ValueError("a section between the tips must be wider and higher than 0")
        return self

    @property
    def all_fins(self) -> tuple[FinConfig, ...]:
        """Each fin, paired ones twice."""
        mirrored = [
            fin.model_copy(update={"around_deg": 180.0 - fin.around_deg})
            for fin in self.fins
            if fin.paired
        ]
        return (*self.fins, *mirrored)
