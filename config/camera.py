"""Schemas of cameras: one above a floor, and a stereo pair on the robot."""

from typing import Annotated, Self

from pydantic import Field, model_validator

from snakewalk.config.base import Strict
from snakewalk.config.pose import Metres3
from snakewalk.config.tags import FixedTag

PoseName = Annotated[str, Field(min_length=1, max_length=500)]
"""A pose source, with an argument after a colon where the source accepts one."""
Place = tuple[float, float]


class CameraConfig(Strict):
    """A camera above known ground, or one that sees tags (docs/overhead-camera.md)."""

    width_px: int = Field(640, ge=64, le=4096, description="width of the camera's picture")
    height_px: int = Field(480, ge=64, le=4096, description="height of the camera's picture")
    rate_hz: float = Field(30.0, gt=0.0, le=240.0, description="number of frames per second")
    field_width_m: float = Field(
        6.0, gt=0.1, le=100.0, description="width of the floor that an image shows"
    )
    height_m: float = Field(6.0, gt=0.2, le=100.0, description="height of the lens above the floor")
    centre_m: Place | None = Field(
        None,
        description="place on the floor below the lens, and in the image's middle "
        "if no corners are given; default in the simulator: the middle "
        "of start and waypoints",
    )
    turn_rad: float = Field(
        0.0, ge=-6.3, le=6.3, description="direction on the floor of the image's right"
    )
    corners_px: tuple[Place, Place, Place, Place] | None = Field(
        None, description="four corners in a real image in pixels, x to the right, y down"
    )
    corners_m: tuple[Place, Place, Place, Place] | None = Field(
        None, description="places on the floor of corners_px; with them the camera may be tilted"
    )
    markers_m: dict[str, Place] | None = Field(
        None,
        description="printed markers of `snakewalk pose markers`, by their numbers: where the "
        "middle of each lies on the floor; in place of corners",
    )
    marker_side_m: float = Field(
        0.15, gt=0.005, le=2.0, description="side of a printed marker, without its white margin"
    )
    place_m: Metres3 | None = Field(
        None, description="place of the lens in the world for `--pose tags`, together with aim_m"
    )
    aim_m: Metres3 | None = Field(
        None, description="place in the world that the middle of the picture shows"
    )
    roll_deg: float = Field(
        0.0, ge=-360.0, le=360.0, description="turn of the picture about the line of sight"
    )
    fixed_tags: tuple[FixedTag, ...] = Field(
        (),
        description="tags at known places, from which a camera for `--pose tags` "
        "estimates its place; instead of place_m",
    )
    lens: str | None = Field(
        None,
        description="lens file of `snakewalk pose lens`, which removes a real "
        "camera's distortion; default: no correction",
    )
    shade: float = Field(
        0.5, ge=0.0, le=0.9, description="largest share of the floor's light that a shadow removes"
    )
    learn_s: float = Field(
        60.0,
        ge=0.0,
        le=86_400.0,
        description="time constant for learning the floor around the body, so that objects "
        "that stay there become floor; 0: the floor stays as in its picture",
    )
    device: str | None = Field(
        None, description="real camera: a number, a device or an address that OpenCV opens"
    )
    latency_s: float = Field(
        0.0,
        ge=0.0,
        le=1.0,
        description="delay of a real camera's frames, as `snakewalk pose camera` measures it",
    )
    background: str | None = Field(
        None, description="image of the empty floor, needed with a real camera"
    )

    @model_validator(mode="after")
    def _corners_are_pairs(self) -> Self:
        if (self.corners_px is None) != (self.corners_m is None):
            raise ValueError("corners_px and corners_m are given together")
        return self

    @model_validator(mode="after")
    def _place_and_aim(self) -> Self:
        if (self.place_m is None) != (self.aim_m is None):
            raise ValueError("place_m and aim_m are given together")
        if self.place_m is not None and self.place_m == self.aim_m:
            raise ValueError("aim_m must not be the place of the lens")
        return self

    @model_validator(mode="after")
    def _markers_fix_a_floor(self) -> Self:
        if self.markers_m is None:
            return self
        wrong = [name for name in self.markers_m if not (name.isdecimal() and int(name) < 50)]
        if wrong:
            raise ValueError(f"markers_m: {wrong[0]}: a marker's number is 0 to 49")
        if len(self.markers_m) < 4:
            raise ValueError(f"markers_m: four are needed, given are {len(self.markers_m)}")
        if self.corners_m is not None:
            raise ValueError("markers_m or corners_m, not both")
        return self

    @property
    def marker_places_m(self) -> dict[int, Place]:
        """``markers_m`` by number."""
        return {int(name): place for name, place in (self.markers_m or {}).items()}


class StereoHeadConfig(Strict):
    """A pair of cameras on a mast on the spine that looks ahead and down (docs/maps.md).

    The simulator draws its pictures; noise, exposure and the camera's pose error are those of the
    simulated device.
    """

    link: int = Field(0, ge=0, description="link of the spine that carries the mast; 0 is the head")
    height_m: float = Field(
        0.25, ge=0.0, le=1.0, description="height of the lenses above the link's middle"
    )
    tilt_rad: float = Field(0.5, ge=-0.5, le=1.5, description="downward tilt of the cameras")
    baseline_m: float = Field(0.095, gt=0.01, le=0.5, description="distance between the lenses")
    width_px: int = Field(
        320, ge=160, le=2048, description="width of the picture of each camera of the head"
    )
    height_px: int = Field(
        240, ge=120, le=2048, description="height of the picture of each camera of the head"
    )
    focal_px: float = Field(
        200.0, gt=20.0, le=10_000.0, description="focal length of both cameras in pixels"
    )
    disparities: int = Field(
        80, ge=16, le=512, description="number of disparities to try, beginning at infinity"
    )
    exposure_s: float = Field(0.005, ge=0.0, le=0.1, description="exposure time of a picture")
    mass_kg: float = Field(
        0.055, ge=0.0, le=2.0, description="mass of cameras and mast, added to the link's mass"
    )
    position_error_m: float = Field(
        0.002,
        ge=0.0,
        le=0.1,
        description="standard deviation, along each axis, of a picture's measured place",
    )
    angle_error_rad: float = Field(
        0.005,
        ge=0.0,
        le=0.2,
        description="standard deviation, about each axis, of a picture's measured attitude",
    )

    @model_validator(mode="after")
    def _disparities_fit_the_picture(self) -> Self:
        if self.disparities > self.width_px // 2:
            raise ValueError(
                f"disparities: {self.disparities} of pictures {self.width_px} px wide; at most half"
            )
        return self


class MappingConfig(Strict):
    """How a run maps the ground by its robot's stereo head, and when it plans again."""

    spacing_m: float = Field(
        0.04, gt=0.005, le=0.5, description="distance between samples of the map"
    )
    period_s: float = Field(
        0.7, gt=0.01, le=60.0, description="time between two pictures of the stereo head"
    )
    latency_s: float = Field(
        0.3, ge=0.0, le=10.0, description="time from a picture to the update of the map"
    )
    error_m: float = Field(
        0.05, gt=0.001, le=0.5, description="expected error beyond which a point is left out"
    )
    far_m: float = Field(
        2.0, gt=0.1, le=20.0, description="distance from the lens beyond which a point is left out"
    )
    source: str = Field(
        "stereo",
        pattern=r"^[a-z][a-z0-9_-]*$",
        description="map source: stereo, or the name of a plug-in",
    )
    replan_bodies: float = Field(
        0.5, gt=0.05, le=10.0, description="body lengths of travel between two plans"
    )
