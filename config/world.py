"""What the ground is: shape, friction, and how steep a path may be."""

import math
from typing import Annotated, Literal, Self

from pydantic import Field

from config.base import Strict


class FrictionConfig(Strict):
    """Coulomb ellipse of the belly: along the body, and across it."""

    along: float = Field(0.1, gt=0.0, le=5.0)
    across: float = Field(0.7, gt=0.0, le=5.0)


class FlatGround(Strict):
    """A level floor."""

    kind: Literal["flat"] = "flat"
    size_m: float = Field(12.0, gt=0.5, description="edge of the drawn floor, centred at 0, 0")


class ElevationGround(Strict):
    """A crop of a real elevation model, scaled to the robot."""

    kind: Literal["elevation"] = "elevation"
    source: str = Field("jacksboro", description="'jacksboro' (packaged with matplotlib) or a .npz")
    row: int = Field(ge=0, description="first row of the crop")
    column: int = Field(ge=0, description="first column of the crop")
    rows: int = Field(ge=8, le=512)
    columns: int = Field(ge=8, le=512)
    spacing_m: float = Field(gt=0.0, description="distance between samples in the robot's world")
    vertical_scale: float = Field(gt=0.0, description="metres in the robot's world per metre")
    refine: int = Field(1, ge=1, le=8, description="cubic subdivision of each cell")


class PlannerConfig(Strict):
    """Where a path may go ([PT] 2.6.1)."""

    variance_window_m: float = Field(0.3, gt=0.0, description="radius of the elevation variance")
    variance_limit_m2: float = Field(4e-4, gt=0.0)
    slope_window_m: float = Field(0.1, gt=0.0, description="radius of the plane fitted for slope")
    slope_limit_rad: float = Field(0.35, gt=0.0, lt=1.5)
    length_weight: float = Field(3e-3, gt=0.0, description="metres of path against variance")
    node_spacing_m: float = Field(0.15, gt=0.0)
    bend_radius_m: float = Field(0.4, ge=0.0, description="wanted of every bend, where possible")
    edge_margin_m: float = Field(0.3, ge=0.0, description="kept free along the border")


class WorldConfig(Strict):
    """One world."""

    name: str
    ground: Annotated[FlatGround | ElevationGround, Field(discriminator="kind")] = FlatGround()
    friction: FrictionConfig = FrictionConfig()
    planner: PlannerConfig = PlannerConfig()

    def with_relief(self, factor: float) -> Self:
        """Return the same ground with its heights times ``factor``, and limits that scale along.

        A planner then lays the same paths, so that steepness alone is compared.
        """
        if not isinstance(self.ground, ElevationGround):
            return self
        limits = self.planner
        planner = limits.model_copy(
            update={
                "variance_limit_m2": limits.variance_limit_m2 * factor**2,
                "length_weight": limits.length_weight * factor**2,
                "slope_limit_rad": math.atan(factor * math.tan(limits.slope_limit_rad)),
            }
        )
        scale = self.ground.vertical_scale * factor
        ground = self.ground.model_copy(update={"vertical_scale": scale})
        return self.model_copy(update={"ground": ground, "planner": planner})
