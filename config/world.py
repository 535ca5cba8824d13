"""What the ground is: shape, friction, and how steep a path may be."""

import math
from typing import Annotated, Literal, Self

from pydantic import Field

from snakewalk.config.base import Strict


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


class WaterGround(Strict):
    """A pool: level bottom at z = 0, surface at ``depth_m``; each link is dragged and carried.

    The coefficients are those of E. Kelasidi, K. Y. Pettersen, J. T. Gravdahl, P. Liljeback,
    Modeling of underwater snake robots, ICRA 2014.
    """

    kind: Literal["water"] = "water"
    size_m: float = Field(12.0, gt=0.5, description="edge of the drawn bottom, centred at 0, 0")
    depth_m: float = Field(0.6, gt=0.1, description="of the water")
    density_kg_m3: float = Field(1000.0, gt=0.0, le=3000.0)
    drag_across: float = Field(2.0, ge=0.0, le=5.0, description="coefficient of the cross-flow")
    drag_along: float = Field(0.03, ge=0.0, le=1.0, description="coefficient of the skin")
    buoyancy: float = Field(
        1.0, ge=0.0, le=5.0, description="of a link under water over its weight; 1: trimmed neutral"
    )


class PoleObstacle(Strict):
    """A round pole to climb."""

    kind: Literal["pole"] = "pole"
    radius_m: float = Field(gt=0.005, le=1.0)
    length_m: float = Field(3.0, gt=0.1, le=50.0)
    upright: bool = Field(True, description="from the floor up; otherwise along x, off the floor")
    at_m: tuple[float, float] = Field((0.5, 0.0), description="x and y of its middle")
    friction: float = Field(0.8, gt=0.0, le=5.0, description="the same in all directions")


class PipeObstacle(Strict):
    """A round pipe to climb or creep through inside; the body starts in its middle."""

    kind: Literal["pipe"] = "pipe"
    radius_m: float = Field(gt=0.02, le=1.0, description="inner")
    length_m: float = Field(4.0, gt=0.1, le=50.0)
    upright: bool = Field(True, description="from the floor up; otherwise along x, off the floor")
    at_m: tuple[float, float] = Field((0.0, 0.0), description="x and y of its middle")
    friction: float = Field(0.8, gt=0.0, le=5.0, description="the same in all directions")


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
    ground: Annotated[FlatGround | ElevationGround | WaterGround, Field(discriminator="kind")] = (
        FlatGround()
    )
    friction: FrictionConfig = FrictionConfig()
    obstacle: Annotated[PoleObstacle | PipeObstacle, Field(discriminator="kind")] | None = None
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
