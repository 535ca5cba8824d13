"""Description of an animal: its skin, and with legs also one cycle of its gait ([KP] 4)."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from snakewalk.config.base import Strict

Point = tuple[float, float, float]
Cycles = Annotated[float, Field(ge=0.0, lt=1.0)]
Place = Annotated[float, Field(ge=0.0, le=1.0)]
Degrees = Annotated[float, Field(ge=-180.0, le=180.0)]
Channel = Annotated[float, Field(ge=0.0, le=1.0)]


FeetPath = Literal["footfall", "gc-printed"]
"""Path of the feet of an animal with legs."""


class SectionConfig(Strict):
    """An ellipse across the body; lengths over the body's."""

    at: Place = Field(description="place along the body, 0 the head's tip")
    half_width: float = Field(
        ge=0.0, le=0.5, description="half of the body's width at this place, in body lengths"
    )
    half_height: float = Field(
        ge=0.0, le=0.5, description="half of the body's height at this place, in body lengths"
    )
    lift: float = Field(
        0.0, ge=-0.5, le=0.5, description="height of the section's middle above the body's axis"
    )


class FinConfig(Strict):
    """A fin; lengths over the body's."""

    at: Place = Field(description="middle of the root along the body")
    chord: float = Field(gt=0.0, le=0.8, description="length of the root")
    around_deg: float = Field(
        ge=-180.0,
        le=180.0,
        description="angle of the fin's root around the body: 90 the back, 0 left, -90 the belly",
    )
    span: float = Field(gt=0.0, le=0.5, description="length of the fin from root to tip")
    sweep: float = Field(
        0.0, ge=-0.5, le=0.5, description="backward distance of the tip's middle from the root's"
    )
    tip_chord: float = Field(
        0.4, gt=0.0, le=2.0, description="length of the fin's tip over the length of its root"
    )
    thickness: float = Field(
        0.004, gt=0.0, le=0.05, description="half of the fin's thickness at its root"
    )
    paired: bool = Field(False, description="whether the other side of the body has an equal one")

    @property
    def mirrored(self) -> Self:
        """The fin of a pair on the other side of the body."""
        return self.model_copy(update={"around_deg": 180.0 - self.around_deg})


class SkinConfig(Strict):
    """A body to be covered by PDE patches."""

    name: str = Field(description="name of the body")
    source: str = Field(description="source of the figures")
    sections: tuple[SectionConfig, ...] = Field(min_length=4, description="head to tail")
    fins: tuple[FinConfig, ...] = Field((), description="fins on the body")
    back_rgb: tuple[Channel, Channel, Channel] = Field(
        (0.66, 0.48, 0.20), description="colour of the back: red, green and blue from 0 to 1"
    )
    band_rgb: tuple[Channel, Channel, Channel] = Field(
        (0.36, 0.22, 0.11),
        description="colour of the bands across the back: red, green and blue from 0 to 1",
    )
    bands: int = Field(0, ge=0, le=60, description="dark bands across the back")
    eye_at: Place = Field(0.05, description="place of the eyes along the body")
    eye_radius: float = Field(
        0.006, gt=0.0, le=0.05, description="radius of the eyes in body lengths"
    )

    @model_validator(mode="after")
    def _from_tip_to_tip(self) -> Self:
        places = [section.at for section in self.sections]
        if places[0] != 0.0 or places[-1] != 1.0 or places != sorted(set(places)):
            raise ValueError("sections must rise in `at`, from 0 to 1")
        if any(min(s.half_width, s.half_height) == 0.0 for s in self.sections[1:-1]):
            raise ValueError("a section between the tips must be wider and higher than 0")
        return self

    @property
    def all_fins(self) -> tuple[FinConfig, ...]:
        """All fins, paired ones twice."""
        return (*self.fins, *(fin.mirrored for fin in self.fins if fin.paired))


class LegPairConfig(Strict):
    """A left and a right leg at one girdle; lengths over the body's.

    A leg hangs from its root: the hip, or the pivot of the shoulder blade. From there follow the
    blade, the upper and the lower segment, the cannon (metacarpus or metatarsus) and the foot.
    Parts of length 0 are missing. Angles of segments are in the plane of the leg.
    """

    at: Place = Field(description="place of the girdle along the body, 0 the head's tip")
    hip_side: float = Field(
        gt=0.0, le=0.3, description="distance of a leg's root from the body's middle plane"
    )
    hip_drop: float = Field(
        0.0, ge=-0.2, le=0.5, description="depth of the legs' roots below the body's axis"
    )
    foot_side: float = Field(
        gt=0.0, le=0.5, description="distance of a foot from the line of travel"
    )
    foot_ahead: float = Field(
        0.0, ge=-0.5, le=0.5, description="middle of a step, ahead of the hips"
    )
    blade: float = Field(
        0.0, ge=0.0, le=0.5, description="length of the shoulder blade, from its pivot; 0: none"
    )
    blade_deg: Degrees = Field(
        0.0, description="angle of the blade to the lower segment; its lower end ahead"
    )
    upper: float = Field(gt=0.0, le=0.5, description="length from hip or shoulder to knee or elbow")
    lower: float = Field(
        gt=0.0, le=0.5, description="length from knee or elbow to the next joint or foot"
    )
    cannon: float = Field(
        0.0, ge=0.0, le=0.5, description="length of metacarpus or metatarsus; 0: none"
    )
    cannon_deg: Degrees = Field(
        0.0,
        description="angle of the cannon on the ground, its lower end ahead: to the lower segment "
        "of a leg with a blade, else to the upper segment",
    )
    cannon_fold_deg: Degrees = Field(
        0.0, description="bend of the cannon in the middle of the air, its lower end behind"
    )
    foot: float = Field(
        0.0, ge=0.0, le=0.5, description="length of pastern and hoof, or of the sole; 0: none"
    )
    foot_deg: Degrees = Field(
        0.0, description="angle of the foot on the ground from the vertical, its toe ahead"
    )
    foot_out_deg: Degrees = Field(0.0, description="turn of the toe to the side")
    foot_fold_deg: Degrees = Field(
        0.0, description="bend of the foot in the middle of the air, its toe behind"
    )
    sole: Literal["round", "hoof", "toes"] = Field("round", description="end of the leg")
    toe: float = Field(0.0, ge=0.0, le=0.3, description="length of the longest toe, or of a hoof")
    thick: float = Field(gt=0.0, le=0.1, description="half of the width at hip or shoulder")
    deep: float = Field(
        1.0, gt=0.2, le=5.0, description="depth of hip or shoulder along the body over its width"
    )
    thin: float | None = Field(
        None, gt=0.0, le=0.1, description="half of the width above the foot; default: thick / 2"
    )
    knee: Literal["out", "ahead", "behind"] = Field(description="where knee or elbow points")
    duty: float = Field(gt=0.1, lt=0.95, description="share of the cycle on the ground")
    left: Cycles = Field(description="phase at which the left foot comes down, in cycles")
    right: Cycles = Field(description="phase at which the right foot comes down, in cycles")
    lift: float = Field(ge=0.0, le=0.3, description="height of a step")
    turn_rad: float = Field(
        0.0, ge=0.0, le=1.2, description="angle by which the girdle turns to either side"
    )

    @property
    def parts(self) -> dict[str, float]:
        """Names and lengths from the root to the ankle or fetlock, then the foot, if present."""
        names = ("blade", "upper", "lower", "cannon", "foot")
        return {name: part for name in names if (part := getattr(self, name)) > 0.0}

    @property
    def segments(self) -> tuple[float, ...]:
        """Lengths of the parts."""
        return tuple(self.parts.values())

    @property
    def sole_height(self) -> float:
        """Height of the foot's axis above the ground; toes lie on it."""
        thin = 0.5 * self.thick if self.thin is None else self.thin
        return thin if self.sole == "toes" and self.foot > 0.0 else 0.0


class OrnamentConfig(Strict):
    """A horn, an ear or a beard: a cone on the body; lengths over the body's."""

    at: Place = Field(description="place along the body that carries the ornament")
    root: Point = Field(
        description="offset of the ornament's base from this place: ahead, left, up"
    )
    tip: Point = Field(
        description="place of the tip in body lengths, from the base of the ornament"
    )
    thick: float = Field(gt=0.0, le=0.1, description="radius at the root")
    bow: Point = Field(
        (0.0, 0.0, 0.0), description="offset of the ornament's middle from the line to its tip"
    )
    swing_rad: float = Field(0.0, ge=0.0, le=1.2, description="amplitude of the swing, once a step")
    paired: bool = Field(False, description="whether the other side of the body has an equal one")
    dark: bool = Field(False, description="whether the ornament has the colour of the skin's bands")

    @property
    def mirrored(self) -> Self:
        """The ornament of a pair on the other side of the body."""
        ends = {"root": self.root, "tip": self.tip, "bow": self.bow}
        return self.model_copy(update={name: (x, -y, z) for name, (x, y, z) in ends.items()})


class AnimalConfig(Strict):
    """An animal on four legs that goes straight: prototype of a motion along a path."""

    name: str = Field(description="name of the animal")
    source: str = Field(description="source of the figures")
    skin: str = Field(
        description="skin of the body: a shipped skin, or a .toml in the folder of this file"
    )
    length_m: float = Field(gt=0.0, le=20.0, description="length from the head's tip to the tail's")
    height: float = Field(
        gt=0.0, le=1.5, description="height of the body's axis over the body's length"
    )
    stride: float = Field(
        gt=0.0, le=3.0, description="distance travelled per cycle, in body lengths"
    )
    cycle_s: float = Field(gt=0.02, le=20.0, description="duration of a cycle")
    leg_pairs: tuple[LegPairConfig, LegPairConfig] = Field(description="front, then hind")
    feet: FeetPath = Field(
        "footfall",
        description="paths of the feet: footfall (ours) stands still on the ground; gc-printed is "
        "[GC] Eq. 9-10 as printed, with one height for left and right",
    )
    vault: float = Field(
        0.0, ge=0.0, le=1.0, description="share of the body's vertical motion on legs as pendulums"
    )
    tail_swing_rad: float = Field(
        0.0, ge=0.0, le=1.5, description="amplitude of the swing of the tail's tip"
    )
    ornaments: tuple[OrnamentConfig, ...] = Field(
        (), description="horns, ears and beard of the animal"
    )

    @model_validator(mode="after")
    def _front_before_hind(self) -> Self:
        front, hind = self.leg_pairs
        if not front.at < hind.at:
            raise ValueError("leg_pairs: the front pair comes first: its `at` is smaller")
        return self

    @property
    def all_ornaments(self) -> tuple[OrnamentConfig, ...]:
        """All ornaments, paired ones twice."""
        return (
            *self.ornaments,
            *(ornament.mirrored for ornament in self.ornaments if ornament.paired),
        )

    @property
    def speed_m_s(self) -> float:
        """Speed of the prototype."""
        return self.stride * self.length_m / self.cycle_s
