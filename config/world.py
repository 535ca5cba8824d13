"""Description of the ground: shape, friction, and largest slope of a path."""

import math
from typing import Annotated, Literal, Self

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, model_validator

from snakewalk.config.arrays import Floats
from snakewalk.config.base import Name, Strict
from snakewalk.config.friction_law import LAWS, LawName


class FrictionConfig(Strict):
    """Friction of the belly: along the body, forward and back, and across it; and its law."""

    along: float = Field(0.1, gt=0.0, le=5.0, description="friction coefficient of sliding forward")
    across: float = Field(0.7, gt=0.0, le=5.0, description="friction coefficient across the body")
    back: float | None = Field(
        None,
        gt=0.0,
        le=5.0,
        description="friction coefficient of sliding backward, which scales "
        "resist; default: as forward",
    )

    law: LawName | None = Field(
        None,
        description="friction law of a link that slides obliquely "
        "(docs/physics.md); default: the ellipse, reported as assumed",
    )

    @property
    def backward(self) -> float:
        """Coefficient of sliding backward."""
        return self.along if self.back is None else self.back

    @property
    def law_name(self) -> LawName:
        """The law in use."""
        return self.law or LAWS[0]

    @property
    def law_text(self) -> str:
        """The law in use, and whether the file leaves it open."""
        return self.law or f"{LAWS[0]} (assumed)"

    @property
    def grip(self) -> tuple[float, float, float, float]:
        """Coefficients forward, across and back, and the code of the law, for compiled loops."""
        return self.along, self.across, self.backward, float(LAWS.index(self.law_name))


class FlatGround(Strict):
    """A level floor."""

    kind: Literal["flat"] = "flat"
    size_m: float = Field(12.0, gt=0.5, description="edge of the drawn floor, centred at 0, 0")


_HEIGHTS = {"vertical_scale", "height_m", "depth_m", "rise_m"}
_SLOPES = {"slope_rad", "rms_slope_rad"}


class _Relief(Strict):
    """Ground with heights."""

    def with_relief(self, factor: float) -> Self:
        """Return the ground with its heights times ``factor``."""
        update = {key: factor * value for key, value in self if key in _HEIGHTS}
        update |= {key: math.atan(factor * math.tan(v)) for key, v in self if key in _SLOPES}
        return self.model_copy(update=update)


class ElevationGround(_Relief):
    """A crop of a real elevation model, scaled to the robot."""

    kind: Literal["elevation"] = "elevation"
    source: str = Field("jacksboro", description="'jacksboro' (packaged with matplotlib) or a .npz")
    row: int = Field(ge=0, description="first row of the crop")
    column: int = Field(ge=0, description="first column of the crop")
    rows: int = Field(ge=8, le=512, description="rows of the crop")
    columns: int = Field(ge=8, le=512, description="columns of the crop")
    spacing_m: float = Field(
        ge=0.005, le=1.0, description="distance between samples in the robot's world"
    )
    vertical_scale: float = Field(
        gt=0.0, le=100.0, description="metres in the robot's world per metre"
    )
    refine: int = Field(1, ge=1, le=8, description="cubic subdivision of each cell")


class MapGround(_Relief):
    """Real ground as measured, with holes where nothing was: written by `snakewalk world`."""

    kind: Literal["map"] = "map"
    source: str = Field(description="an .npz with z_m, known, spacing_m, x0_m, y0_m")
    vertical_scale: float = Field(1.0, gt=0.0, le=100.0, description="factor on the file's heights")


class RampGround(_Relief):
    """A plane that rises along x, between a level run-in and a level top; its middle at x = 0."""

    kind: Literal["ramp"] = "ramp"
    slope_rad: float = Field(gt=0.0, le=1.0, description="angle of the ramp from the horizontal")
    length_m: float = Field(
        4.0, gt=0.0, le=50.0, description="length of the slope, measured horizontally"
    )
    level_m: float = Field(
        2.0,
        ge=0.1,
        le=50.0,
        description="length of the level ground before the slope, and of the top",
    )
    width_m: float = Field(8.0, gt=0.5, le=50.0, description="width of the ground along y")
    spacing_m: float = Field(0.1, ge=0.005, le=0.5, description="distance between samples")


class RandomGround(_Relief):
    """Isotropic Gaussian hills and hollows, drawn from a seed of their own.

    The heights' autocorrelation falls as ``exp(-(r / correlation_m)**2)``. The made field is scaled
    so that the root mean square of its gradient, over its own triangles, is ``tan(rms_slope_rad)``.
    """

    kind: Literal["random"] = "random"
    rms_slope_rad: float = Field(
        gt=0.0, le=1.0, description="RMS slope of the ground: arctan of the RMS gradient"
    )
    correlation_m: float = Field(
        gt=0.0, le=10.0, description="distance at which the autocorrelation of the heights is 1/e"
    )
    seed: int = Field(0, ge=0, description="seed of the ground, independent of the run's")
    size_m: float = Field(8.0, gt=0.5, le=50.0, description="edge length of the square ground")
    spacing_m: float = Field(0.03, ge=0.005, le=0.5, description="distance between samples")

    @model_validator(mode="after")
    def _correlation_is_resolved(self) -> Self:
        if self.correlation_m < 3.0 * self.spacing_m:
            raise ValueError("correlation_m must be at least 3 spacing_m, or the hills are spikes")
        return self


class _LevelEnds(_Relief):
    """Ground with edges across x between level ends."""

    level_m: float = Field(
        2.0, ge=0.1, le=50.0, description="length of the level ground at each end"
    )
    spacing_m: float = Field(0.01, ge=0.005, le=0.1, description="distance between samples")


class StepsGround(_LevelEnds):
    """Steps across x, the middle of them at x = 0, between two level ends.

    A height field has no vertical face: a riser is a flank one sample wide, inclined by
    ``atan(height_m / spacing_m)``. Treads and ends are rounded to whole samples.
    """

    kind: Literal["steps"] = "steps"
    height_m: float = Field(gt=0.0, le=1.0, description="height of each step")
    tread_m: float = Field(gt=0.0, le=10.0, description="distance from step to step")
    count: int = Field(ge=1, le=100, description="number of steps")
    pattern: Literal["up", "up-down"] = Field(
        "up-down",
        description="arrangement of the steps: a staircase, or one up and one down in turn",
    )
    width_m: float = Field(3.0, gt=0.5, le=50.0, description="width of the ground along y")

    @model_validator(mode="after")
    def _treads_are_resolved(self) -> Self:
        if self.tread_m < 2.0 * self.spacing_m:
            raise ValueError("tread_m must be at least 2 spacing_m, or the steps are a ramp")
        return self


class GapsGround(_LevelEnds):
    """Trenches across x, the middle of them at x = 0, in a level floor.

    A trench is ``width_m`` wide between its upper edges; its walls are flanks one sample wide, as
    those of steps, so that its bottom is two samples narrower. Lengths are whole samples.
    """

    kind: Literal["gaps"] = "gaps"
    width_m: float = Field(gt=0.0, le=2.0, description="width of each trench, edge to edge")
    depth_m: float = Field(gt=0.0, le=2.0, description="depth of a trench")
    distance_m: float = Field(
        gt=0.0, le=10.0, description="distance between the middles of neighbouring trenches"
    )
    count: int = Field(ge=1, le=100, description="number of trenches")
    across_m: float = Field(3.0, gt=0.5, le=50.0, description="extent of the ground along y")

    @model_validator(mode="after")
    def _trenches_are_resolved_and_apart(self) -> Self:
        if self.width_m < 3.0 * self.spacing_m:
            raise ValueError("width_m must be at least 3 spacing_m, or a trench has no bottom")
        if self.distance_m < self.width_m + self.spacing_m:
            raise ValueError("distance_m must be over width_m plus spacing_m, or trenches merge")
        return self


class Water(Strict):
    """Still water from z = 0 to ``depth_m``; each link in it is dragged and carried.

    The coefficients are those of E. Kelasidi, K. Y. Pettersen, J. T. Gravdahl, P. Liljeback,
    Modeling of underwater snake robots, ICRA 2014.
    """

    depth_m: float = Field(0.6, gt=0.1, description="largest depth of the water")
    density_kg_m3: float = Field(1000.0, gt=0.0, le=3000.0, description="density of the water")
    drag_across: float = Field(
        2.0, ge=0.0, le=5.0, description="drag coefficient of flow across the body"
    )
    drag_along: float = Field(
        0.03, ge=0.0, le=1.0, description="drag coefficient of flow along the body"
    )
    linear_across_m_s: float = Field(
        0.0,
        ge=0.0,
        le=10.0,
        description="speed across the body below which the linear drag is larger",
    )
    linear_along_m_s: float = Field(
        0.0,
        ge=0.0,
        le=10.0,
        description="speed along the body below which the linear drag is larger",
    )
    buoyancy: float = Field(
        1.0,
        ge=0.0,
        le=5.0,
        description="buoyancy of a link under water divided by its weight; 1: neutral",
    )


class WaterGround(Water):
    """A pool with a level bottom."""

    kind: Literal["water"] = "water"
    size_m: float = Field(12.0, gt=0.5, description="edge of the drawn bottom, centred at 0, 0")


class ShoreGround(_Relief, Water):
    """A pool whose bottom rises along x to level land; the waterline is x = 0."""

    kind: Literal["shore"] = "shore"
    slope_rad: float = Field(
        gt=0.0, le=1.0, description="slope of the beach, below and above the water"
    )
    pool_m: float = Field(
        2.0, ge=0.1, le=50.0, description="length of the pool's level bottom along x"
    )
    land_m: float = Field(2.0, ge=0.1, le=50.0, description="length of the level land along x")
    rise_m: float = Field(0.05, ge=0.0, le=5.0, description="height of the land above the water")
    width_m: float = Field(6.0, gt=0.5, le=50.0, description="width of the ground along y")
    spacing_m: float = Field(0.05, ge=0.005, le=0.5, description="distance between samples")


class _RoundObstacle(Strict):
    """A round obstacle along a line."""

    radius_m: float = Field(gt=0.005, le=1.0, description="radius of the obstacle")
    at_m: tuple[float, float] = Field((0.5, 0.0), description="x and y of the obstacle's middle")
    upright: bool = Field(
        True,
        description="whether the obstacle rises from the floor; otherwise it lies along x above",
    )
    friction: float = Field(
        0.8,
        gt=0.0,
        le=5.0,
        description="friction coefficient of the obstacle, equal in all directions",
    )

    def gap_m(self, x_m: ArrayLike, y_m: ArrayLike) -> Floats:
        """Distance of places on the floor from the obstacle; negative inside it, a pipe included.

        Infinite under a level obstacle.
        """
        gap_m = np.hypot(np.subtract(x_m, self.at_m[0]), np.subtract(y_m, self.at_m[1]))
        return np.asarray(gap_m - self.radius_m if self.upright else gap_m + np.inf)


class PoleObstacle(_RoundObstacle):
    """A round pole to climb."""

    kind: Literal["pole"] = "pole"
    length_m: float = Field(3.0, gt=0.1, le=50.0, description="length of the pole")


class PipeObstacle(_RoundObstacle):
    """A round pipe to climb or creep through inside; the body starts in its middle."""

    kind: Literal["pipe"] = "pipe"
    radius_m: float = Field(gt=0.02, le=1.0, description="inner radius of the pipe")
    length_m: float = Field(4.0, gt=0.1, le=50.0, description="length of the pipe")
    at_m: tuple[float, float] = Field((0.0, 0.0), description="x and y of the obstacle's middle")


class _StandingObstacle(Strict):
    """An obstacle that stands on the floor."""

    height_m: float = Field(0.15, gt=0.01, le=5.0, description="height above z = 0")
    at_m: tuple[float, float] = Field((0.0, 0.0), description="x and y of the obstacle's middle")
    friction: float = Field(
        0.3,
        ge=0.0,
        le=5.0,
        description="friction coefficient of the obstacle, equal in all directions",
    )


class PegsObstacle(_StandingObstacle):
    """A board of upright pegs to push off: rows across x, as far apart as pegs in a row."""

    kind: Literal["pegs"] = "pegs"
    radius_m: float = Field(0.03, gt=0.002, le=1.0, description="radius of a peg")
    spacing_m: float = Field(
        gt=0.0, le=10.0, description="distance from peg to peg in a row along y"
    )
    rows: int = Field(ge=1, le=100, description="number of rows of pegs along x")
    row_pegs: int = Field(ge=1, le=100, description="number of pegs in a row")
    pattern: Literal["square", "hexagonal"] = Field(
        "hexagonal",
        description="arrangement of the pegs; hexagonal: every other row is "
        "shifted by half a spacing",
    )

    @model_validator(mode="after")
    def _pegs_are_apart(self) -> Self:
        if self.spacing_m <= 2.0 * self.radius_m:
            raise ValueError("spacing_m must be over twice radius_m, or the pegs are a wall")
        return self

    def places_m(self) -> tuple[tuple[float, float], ...]:
        """X and y of each peg, row by row."""
        hexagonal = self.pattern == "hexagonal"
        apart_m = self.spacing_m * (math.sqrt(0.75) if hexagonal else 1.0)
        places = []
        for row in range(self.rows):
            shift = (0.25 if row % 2 else -0.25) if hexagonal else 0.0
            x_m = self.at_m[0] + (row - 0.5 * (self.rows - 1)) * apart_m
            for peg in range(self.row_pegs):
                along = peg - 0.5 * (self.row_pegs - 1) + shift
                places.append((x_m, self.at_m[1] + along * self.spacing_m))
        return tuple(places)

    def gap_m(self, x_m: ArrayLike, y_m: ArrayLike) -> Floats:
        """Distance of places on the floor from the nearest peg; negative inside it."""
        from scipy.spatial import KDTree  # noqa: PLC0415  slow, for lists and help

        places_m = np.stack(np.broadcast_arrays(x_m, y_m), axis=-1)
        return np.asarray(KDTree(self.places_m()).query(places_m)[0]) - self.radius_m


WALL_M = 0.04
"""Thickness of a corridor's wall."""


class CorridorObstacle(_StandingObstacle):
    """Two upright walls along x with a way between them."""

    kind: Literal["corridor"] = "corridor"
    width_m: float = Field(gt=0.01, le=50.0, description="distance between the walls")
    length_m: float = Field(4.0, gt=0.1, le=50.0, description="length of the walls")

    def gap_m(self, x_m: ArrayLike, y_m: ArrayLike) -> Floats:
        """Distance of places on the floor from the nearer wall; negative inside it."""
        along_m = np.abs(np.subtract(x_m, self.at_m[0])) - 0.5 * self.length_m
        middle_m = 0.5 * (self.width_m + WALL_M)
        across_m = np.abs(np.abs(np.subtract(y_m, self.at_m[1])) - middle_m) - 0.5 * WALL_M
        outside_m = np.hypot(np.maximum(along_m, 0.0), np.maximum(across_m, 0.0))
        return outside_m + np.minimum(np.maximum(along_m, across_m), 0.0)


class PlannerConfig(Strict):
    """Where a path may go ([PT] 2.6.1)."""

    variance_window_m: float = Field(
        0.3,
        gt=0.0,
        le=10.0,
        description="radius of the disc in which the variance of height is measured",
    )
    variance_limit_m2: float = Field(
        4e-4, gt=0.0, description="largest variance of height on a path"
    )
    slope_window_m: float = Field(
        0.1, gt=0.0, le=10.0, description="radius of the plane fitted for slope"
    )
    slope_limit_rad: float = Field(0.35, gt=0.0, lt=1.5, description="steepest slope on a path")
    length_weight: float = Field(
        3e-3, gt=0.0, description="weight of the path's length against the variance of height"
    )
    footprint_m: float = Field(
        0.6,
        gt=0.0,
        le=10.0,
        description="width of the strip that the body stands on: half its length",
    )
    climb_limit_rad: float = Field(
        0.2, gt=0.0, lt=1.5, description="steepest slope under the footprint that the body climbs"
    )
    climb_weight: float = Field(
        1.0,
        ge=0.0,
        description="additional cost of a metre uphill at climb_limit_rad, in metres of level path",
    )
    side_weight: float = Field(
        1.0,
        ge=0.0,
        description="additional cost of a metre on a side slope at "
        "climb_limit_rad, in metres of level path",
    )
    clearance_m: float = Field(
        0.6,
        ge=0.0,
        description="requested distance from ground that the body cannot climb, about half a body",
    )
    clearance_weight: float = Field(
        1.0,
        ge=0.0,
        description="additional cost of a metre next to ground that the body "
        "cannot climb, in metres of level path",
    )
    node_spacing_m: float = Field(
        0.15, ge=0.02, description="distance between places that a path may join"
    )
    bend_radius_m: float = Field(
        0.4, ge=0.0, le=100.0, description="requested radius of every bend, where possible"
    )
    edge_margin_m: float = Field(
        0.3, ge=0.0, description="width of the border of the ground that the path avoids"
    )


ReliefGround = (
    ElevationGround | MapGround | RampGround | RandomGround | StepsGround | GapsGround | ShoreGround
)
"""Grounds with a height field; the others are level."""


Obstacle = PoleObstacle | PipeObstacle | PegsObstacle | CorridorObstacle


class WorldConfig(Strict):
    """One world."""

    name: Name
    ground: Annotated[FlatGround | ReliefGround | WaterGround, Field(discriminator="kind")] = Field(
        FlatGround(), description="shape of the ground; its kind selects the other keys"
    )
    friction: FrictionConfig = FrictionConfig()
    obstacle: Annotated[Obstacle, Field(discriminator="kind")] | None = Field(
        None, description="object on the ground; its kind selects the other keys"
    )
    planner: PlannerConfig = PlannerConfig()

    def with_relief(self, factor: float) -> Self:
        """Return the world with its heights times ``factor``, and scaled limits.

        A planner then plans the same paths, so that only the steepness differs.
        """
        if isinstance(self.ground, FlatGround | WaterGround):
            return self
        limits = self.planner
        planner = limits.model_copy(
            update={
                "variance_limit_m2": limits.variance_limit_m2 * factor**2,
                "length_weight": limits.length_weight * factor**2,
                "slope_limit_rad": math.atan(factor * math.tan(limits.slope_limit_rad)),
                "climb_limit_rad": math.atan(factor * math.tan(limits.climb_limit_rad)),
            }
        )
        ground = self.ground.with_relief(factor)
        return self.model_copy(update={"ground": ground, "planner": planner})
