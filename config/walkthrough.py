"""File of a walk-through: the stereo positions of a route ([KP] 3.1 and 3.6)."""

from typing import Self

from pydantic import Field, model_validator

from snakewalk.config.base import Strict
from snakewalk.config.key_types import DISPARITIES, Disparities, LengthUnit

Pose = tuple[
    tuple[float, float, float, float],
    tuple[float, float, float, float],
    tuple[float, float, float, float],
]
"""Rows of (R | t): a point p of the left camera is ``R p + t`` in the world."""


class PairConfig(Strict):
    """Two pictures at the same moment."""

    left: str = Field(description="picture of the left camera; a path from the folder of this file")
    right: str = Field(description="picture of the right camera")


class PositionConfig(Strict):
    """One position of the route."""

    left: str | None = Field(None, description="picture of the left camera")
    right: str | None = Field(None, description="picture of the right camera")
    views: tuple[PairConfig, ...] = Field(
        (),
        description="instead of left and right: several pairs from one place, which differ by a "
        "rotation; the first one looks along the route",
    )
    distance_m: float | None = Field(
        None,
        gt=0.0,
        le=1000.0,
        description="distance to the next position, if the pictures agree on several motions",
    )
    pose: Pose | None = Field(
        None,
        description="known pose of the left camera, rows of a 3 by 4 matrix from the camera (x "
        "right, y down, z forward) to the world; used only to report errors",
    )

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        if (self.left is None) != (self.right is None):
            raise ValueError("left and right belong together")
        if (self.left is None) == (not self.views):
            raise ValueError("a position has either left and right, or views")
        return self

    @property
    def pairs(self) -> tuple[PairConfig, ...]:
        """Return all pairs of the position."""
        if self.left is None or self.right is None:
            return self.views
        return (PairConfig(left=self.left, right=self.right),)


class WalkthroughConfig(Strict):
    """Positions of a route, in order, taken with one stereo camera."""

    calibration: str = Field(
        description="calibration of OpenCV's stereoCalibrate (YAML, XML, JSON, NPZ), or a "
        "calib.txt; a path from the folder of this file"
    )
    unit: LengthUnit = None
    disparities: Disparities = DISPARITIES
    positions: tuple[PositionConfig, ...] = Field(
        min_length=1, max_length=200, description="positions in the order of the route"
    )
