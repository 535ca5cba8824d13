"""Contrast of a body with its floor in a frame, near the expected body.

Three conditions need another comparison, and are recognised in the frame itself: a flickering lamp
(bands of rows), strong compression (blocks of 8 px), a hard shadow.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import cv2
import numpy as np

from snakewalk.config.arrays import Bytes, Floats, Image
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.cameras.floor_light import banded_floor, lit_floor, unexplained
from snakewalk.controller.cameras.pose_tracking import (
    REACH_M,
    BodyPrior,
    StandingOut,
    ToPixels,
    TrackedPose,
    track_pose,
)
from snakewalk.controller.images.compression import Compression, compression_of, without_blocks
from snakewalk.drivers.attitude import about_up

_CALM_PX = 200  # fewest pixels away from the body for the noise
_CLEAR = 0.2
_CLEAR_IN_BLOCKS = 0.4
"""Shares of the body's contrast: halos of compression have less, without and with blocks (ours)."""
_DISAGREES = 0.7
"""Variance of a pose over the square of its distance from that of the frame with blocks (ours)."""
DEEP_SHADE = 0.9
"""Share of the light that a hard shadow may remove (ours)."""
_COLOURLESS = 0.08  # largest spread of a shadow's light over the channels (ours)
_BRIGHT = 40.0  # grey levels of a floor that shows a shadow (ours)
_BODY = 1.25  # radii to each side of the axis that may belong to the body (ours)


@dataclass(frozen=True, slots=True)
class BodyContrast:
    """The part of a frame around an expected body, and of its floor."""

    frame: Image
    """(h, w[, 3]), of a compressed frame without its blocks."""
    coded: Image
    """(h, w[, 3]) picture as the camera sent it."""
    floors: tuple[Image, ...]
    """(h, w[, 3]) backgrounds: a pixel that one of them explains is floor."""
    near: Bytes
    """(h, w) 255 where the body can be."""
    origin_px: Floats
    """(2,) x, y of the first pixel in the frame."""
    to_px: ToPixels
    radius_px: float
    area_px: float
    """Area of the body."""
    compression: Compression | None

    @classmethod
    def around(
        cls,
        image: Image,
        floors: Sequence[Image],
        to_px: ToPixels,
        prior: BodyPrior,
        robot: RobotConfig,
    ) -> Self:
        """Cut the surroundings of an expected body out of a frame (H, W[, 3]) and its floors."""
        reach_m = REACH_M + 3.0 * robot.body_radius_m
        around = reach_m * np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])
        px = to_px((prior.links_m[:, None] + around).reshape(-1, 2))
        rows, columns = image.shape[:2]
        left, top = np.clip(np.floor(px.min(axis=0)).astype(int), 0, (columns - 1, rows - 1))
        right, low = np.clip(np.ceil(px.max(axis=0)).astype(int) + 1, 1, (columns, rows))
        high = slice(top, max(low, top + 1))
        wide = slice(left, max(right, left + 1))
        coded = np.ascontiguousarray(image[high, wide])
        compression = compression_of(image)
        frame = coded if compression is None else without_blocks(coded, compression)
        line = to_px(prior.links_m) - (left, top)
        metre = float(np.hypot(*np.diff(line, axis=0).T).sum()) / robot.centre_distance_m
        radius = robot.body_radius_m * metre
        near = np.zeros(frame.shape[:2], dtype=np.uint8)
        _draw(near, line, 2.0 * reach_m * metre)
        return cls(
            frame,
            coded,
            tuple(banded_floor(image[high], floor[high])[:, wide] for floor in floors),
            near,
            np.array([left, top], dtype=float),
            to_px,
            radius,
            2.0 * radius * robot.length_m * metre,
            compression,
        )

    def standing_out(self, shade: float) -> StandingOut:
        """Return each pixel's difference from the floor; a shadow removes ``shade`` of light."""
        now = _smooth(self.frame)
        difference = np.full(now.shape[:2], np.inf, dtype=np.float32)
        for floor in self.floors:
            difference = np.minimum(difference, unexplained(now, self._lit(floor), shade))
        away = difference[self.near == 0]
        some = away if away.size > _CALM_PX else difference.ravel()
        middle = float(np.median(some))
        above = some[some > middle] - middle
        spread = (1.4826 * float(np.median(above)) if above.size else 0.0) + 0.5
        clear = middle + 4.0 * spread
        body = difference[(self.near > 0) & (difference > clear)]
        low_level = middle + 2.0 * spread
        if body.size <= 0.2 * self.area_px:
            level = 255.0
        elif self.compression is not None:  # halos are not the body
            clear = _CLEAR_IN_BLOCKS if self.compression.quality is None else _CLEAR
            strongest = np.sort(difference[self.near > 0])[-int(self.area_px) :]
            level = float(np.median(strongest))
            low_level = max(low_level, clear * level)
        else:
            level = float(np.median(body))
        share = (difference - low_level) / max(0.7 * level - low_level, spread)
        share = np.clip(share, 0.0, 1.0) * (self.near > 0)
        return StandingOut(share.astype(np.float32), self.origin_px, self.to_px, self.compression)

    def hard_shadow(self, links_m: Floats, shade: float) -> float:
        """Area of dark colourless pixels next to a body at links (L, 2), in body areas.

        They are darker than a shadow that removes ``shade`` of the light.
        """
        if self.frame.ndim == 2:
            return 0.0
        now = _smooth(self.frame).astype(np.float32)
        dark = self.near > 0
        for floor in self.floors:
            lit = self._lit(floor).astype(np.float32)
            ratio = now / np.maximum(lit, 1.0)
            most, least = ratio.max(axis=2), ratio.min(axis=2)
            dark &= (most < 1.0 - shade) & (most - least < _COLOURLESS)
            dark &= lit.min(axis=2) > _BRIGHT
        body = np.zeros(dark.shape, dtype=np.uint8)
        _draw(body, self.to_px(links_m) - self.origin_px, 2.0 * _BODY * self.radius_px)
        return int((dark & (body == 0)).sum()) / self.area_px

    def _lit(self, floor: Image) -> Image:
        """(h, w[, 3]) the floor in the light of the frame, smoothed."""
        ground = np.ascontiguousarray(floor)
        if self.compression is None or self.frame.ndim == 2:
            return _smooth(lit_floor(self.frame, ground, self.area_px))
        channels = [  # compression shifts colours over large parts
            lit_floor(
                np.ascontiguousarray(self.frame[..., k]),
                np.ascontiguousarray(ground[..., k]),
                self.area_px,
            )
            for k in range(self.frame.shape[2])
        ]
        return _smooth(np.dstack(channels))


def confirmed(
    robot: RobotConfig, contrast: BodyContrast, prior: BodyPrior, tracked: TrackedPose, shade: float
) -> TrackedPose:
    """Return the pose in a compressed frame, less certain if the frame with its blocks disagrees.

    Poses in other frames are returned as they are.
    """
    blocks = contrast.compression
    if tracked.fault or blocks is None or blocks.quality is None:
        return tracked
    as_coded = replace(contrast, frame=contrast.coded, compression=Compression(None))
    other = track_pose(robot, as_coded.standing_out(shade), prior, tracked.time_s)
    turn = other.heading_rad - tracked.heading_rad
    difference = np.append(other.head_m - tracked.head_m, np.angle(np.exp(1j * turn)))
    wider = replace(
        tracked, covariance=tracked.covariance + _DISAGREES * np.outer(difference, difference)
    )
    too_wide = wider.sigma_m > blocks.sigma_limit * robot.body_radius_m
    return replace(wider, fault=str(blocks)) if too_wide else wider


def links_at(prior: BodyPrior, tracked: TrackedPose) -> Floats:
    """(L, 2) centres of the links of an expected body at the found pose."""
    ahead = prior.forward[0]
    turn = tracked.heading_rad - float(np.arctan2(ahead[1], ahead[0]))
    away = prior.links_m - prior.links_m[0]
    return np.asarray(tracked.head_m + away @ about_up(-turn)[:2, :2])


def _smooth(image: Image) -> Image:
    return np.asarray(cv2.GaussianBlur(image, (3, 3), 0.0), dtype=np.uint8)


def _draw(mask: Bytes, line_px: Floats, wide_px: float) -> None:
    spots = np.rint(line_px).astype(np.int32).reshape(-1, 1, 2)
    cv2.polylines(mask, [spots], False, 255, max(1, round(wide_px)))
