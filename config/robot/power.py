"""Cables, leads and fuse of the supply."""

from typing import Self

from pydantic import Field, model_validator

from snakewalk.config.base import Strict


class PowerConfig(Strict):
    """Cables between servos, leads of the supply, and its fuse (docs/how-to/chain-voltage.md)."""

    inject_ids: tuple[int, ...] = Field(
        (),
        description="IDs of the servos to which a lead of the supply goes; "
        "default: the first of the chain",
    )
    cable_ohm: float = Field(
        0.055,
        gt=0.0,
        le=100.0,
        description="resistance of a cable between neighbours with both conductors "
        "and four contacts; default: 180 mm of AWG 21, and contacts of "
        "10 milliohm",
    )
    cables_ohm: tuple[float, ...] = Field(
        (), description="resistances of the cables from the head, if they differ"
    )
    lead_ohm: float = Field(
        0.02, gt=0.0, le=100.0, description="resistance of a lead from the supply, both conductors"
    )

    fuse_a: float | None = Field(
        None,
        gt=0.0,
        le=1000.0,
        description="rating of the supply's fuse: a run slows down before the estimated current of "
        "the whole chain reaches it, and ends if it is exceeded; not given: no limit",
    )

    @model_validator(mode="after")
    def _resistances_are_positive(self) -> Self:
        if any(not 0.0 < resistance_ohm <= 100.0 for resistance_ohm in self.cables_ohm):
            raise ValueError("cables_ohm: each over 0 and at most 100")
        return self
