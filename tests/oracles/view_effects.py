"""Disturbances of a frame of an overhead camera with known truth: shadow, cover, bands, blocks."""

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np

from snakewalk.config.arrays import Floats, Image
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.cameras.overhead_camera import CameraModel
from snakewalk.controller.kinematics.links import body_in_world, half_lengths_m
from snakewalk.drivers.types import BodyPose

_FINE = 4  # times larger than a frame is a mask drawn
_HEIGHTS = 9  # of the body's section, whose shadows together are its shadow
_COVERED = 0.15, 0.20  # of the body's length


@dataclass(frozen=True, slots=True)
class View:
    """A frame without faults, and where its body is."""

    frame: Floats
    """(H, W, 3) grey levels."""
    axis_px: Floats
    """(N, 2) points along the body's axis, evenly spaced from the head's tip."""
    radius_px: float

    @classmethod
    def of(
        cls, robot: RobotConfig, model: CameraModel, pose: BodyPose, joint_rad: Floats, frame: Image
    ) -> "View":
        """Build the view of a frame (H, W, 3) of a robot with its head link at ``pose``."""
        body = body_in_world(robot, pose, joint_rad)
        half = half_lengths_m(robot)[:, None] * body.forward
        ends = np.stack([body.link_m + half, body.link_m - half], axis=1)[..., :2].reshape(-1, 2)
        px = model.in_image(ends, robot.body_radius_m)
        arc = np.concatenate([[0.0], np.hypot(*np.diff(px, axis=0).T).cumsum()])
        at = np.linspace(0.0, arc[-1], 400)
        axis = np.column_stack([np.interp(at, arc, px[:, 0]), np.interp(at, arc, px[:, 1])])
        radius_px = robot.body_radius_m * float(arc[-1]) / robot.length_m
        return cls(frame.astype(float), axis, radius_px)


Effect = Callable[[View, np.random.Generator], Floats]
"""A view and chance to a frame (H, W, 3)."""


def _mask(view: View, lines: list[tuple[Floats, float]]) -> Floats:
    """(H, W) share of each pixel that thick lines cover."""
    high, wide = view.frame.shape[:2]
    large = np.zeros((high * _FINE, wide * _FINE), np.uint8)
    for points_px, radius_px in lines:
        spots = np.rint(((points_px + 0.5) * _FINE - 0.5) * 16.0).astype(np.int32)
        thick = max(1, round(2.0 * radius_px * _FINE))
        cv2.polylines(large, [spots.reshape(-1, 1, 2)], False, 255, thick, cv2.LINE_8, 4)
    small = cv2.resize(large, (wide, high), interpolation=cv2.INTER_AREA)
    return np.asarray(small, dtype=float) / 255.0


def shadow(left: float) -> Effect:
    """Add the body's hard shadow in the sun, in which a share ``left`` of the light is left."""

    def effect(view: View, chance: np.random.Generator) -> Floats:
        turn, height = chance.uniform(0.0, 2.0 * np.pi), np.radians(chance.uniform(30.0, 60.0))
        away = np.array([np.cos(turn), np.sin(turn)]) / np.tan(height)
        radius = view.radius_px
        lines = [
            (view.axis_px + z * radius * away, radius * np.sqrt(max(1.0 - (z - 1.0) ** 2, 0.01)))
            for z in np.linspace(0.0, 2.0, _HEIGHTS)
        ]
        dark = cv2.GaussianBlur(_mask(view, lines), (0, 0), 0.4)
        free = dark * (1.0 - _mask(view, [(view.axis_px, radius)]))
        return np.asarray(view.frame * (1.0 - (1.0 - left) * free)[..., None])

    return effect


def _over(view: View, cover: Floats, colour: Floats, chance: np.random.Generator) -> Floats:
    """Lay a cover (H, W) with folds and noise over a view."""
    folds = cv2.GaussianBlur(chance.normal(0.0, 1.0, cover.shape), (0, 0), 4.0)
    lit = 1.0 + 0.1 * folds / max(float(folds.std()), 1e-9)
    noise = chance.normal(0.0, 3.0, view.frame.shape)
    return np.asarray(
        view.frame * (1.0 - cover[..., None]) + cover[..., None] * (colour * lit[..., None] + noise)
    )


def _share(view: View, cover: Floats) -> float:
    """Share of the body's length that a cover (H, W) hides."""
    x, y = np.clip(np.rint(view.axis_px).astype(int), 0, np.array(cover.shape[::-1]) - 1).T
    return float((cover[y, x] > 0.5).mean())


def _drawn_cover(
    view: View, chance: np.random.Generator, draw: Callable[[np.random.Generator, int], Floats]
) -> Floats:
    """Return the first cover that hides the wanted share of the body."""
    for _ in range(500):
        cover = draw(chance, int(chance.integers(len(view.axis_px))))
        if _COVERED[0] <= _share(view, cover) <= _COVERED[1]:
            return cover
    raise AssertionError("no cover hides the wanted share")


def cloth(view: View, chance: np.random.Generator) -> Floats:
    """Cover 15 to 20 % of the body with a cloth of any colour."""

    def draw(chance: np.random.Generator, k: int) -> Floats:
        turn, size = chance.uniform(0.0, np.pi), chance.uniform(2.0, 8.0, 2) * view.radius_px
        ahead, side = (
            np.array([np.cos(turn), np.sin(turn)]),
            np.array([-np.sin(turn), np.cos(turn)]),
        )
        middle = view.axis_px[k] + chance.uniform(-1.0, 1.0, 2) * size.min()
        corners = [middle + size @ np.array([a * ahead, b * side]) for a, b in
                   ((1, 1), (1, -1), (-1, -1), (-1, 1))]  # fmt: skip
        mask = np.zeros(view.frame.shape[:2], np.float32)
        cv2.fillPoly(mask, [np.rint(corners).astype(np.int32)], 1.0, cv2.LINE_AA)
        return np.asarray(mask, dtype=float)

    cover = _drawn_cover(view, chance, draw)
    return _over(view, cover, chance.uniform(20.0, 240.0, 3), chance)


def hand(view: View, chance: np.random.Generator) -> Floats:
    """Cover 15 to 20 % of the body with a hand, whose arm reaches out of the picture."""

    def draw(chance: np.random.Generator, k: int) -> Floats:
        turn, mask = chance.uniform(0.0, 2.0 * np.pi), np.zeros(view.frame.shape[:2], np.float32)
        out = np.array([np.cos(turn), np.sin(turn)])
        palm = view.axis_px[k] + chance.uniform(-1.0, 2.0) * view.radius_px * out
        axes = (chance.uniform(1.5, 4.0, 2) * view.radius_px).tolist()
        spot = np.rint(palm).astype(int).tolist()
        size = max(1, round(axes[0])), max(1, round(axes[1]))
        cv2.ellipse(mask, spot, size, float(np.degrees(turn)), 0, 360, 1.0, -1, cv2.LINE_AA)
        far = np.rint(palm + 900.0 * out).astype(int).tolist()
        cv2.line(mask, spot, far, 1.0, max(1, round(2.5 * view.radius_px)), cv2.LINE_AA)
        return np.asarray(np.clip(mask, 0.0, 1.0), dtype=float)

    cover = _drawn_cover(view, chance, draw)
    return _over(view, cover, np.array([205.0, 160.0, 135.0]) * chance.uniform(0.5, 1.1), chance)


def bands(depth: float, *, hard: bool) -> Effect:
    """Add bands of a flickering lamp: rows lose up to ``depth`` of the light."""

    def effect(view: View, chance: np.random.Generator) -> Floats:
        rows = np.arange(view.frame.shape[0])
        wave = np.sin(2.0 * np.pi * (rows / chance.uniform(40.0, 200.0) + chance.random()))
        light = np.clip(0.5 + 4.0 * wave, 0.0, 1.0) if hard else 0.5 + 0.5 * wave
        return np.asarray(view.frame * (1.0 - depth * light)[:, None, None])

    return effect


def jpeg(quality: int) -> Effect:
    """Compress the frame."""

    def effect(view: View, chance: np.random.Generator) -> Floats:
        coded = cv2.imencode(".jpg", sensed(view.frame), [cv2.IMWRITE_JPEG_QUALITY, quality])[1]
        return np.asarray(cv2.imdecode(coded, cv2.IMREAD_COLOR), dtype=float)

    return effect


def sensed(frame: Floats) -> Image:
    """(H, W, 3) grey levels as a camera returns them."""
    return np.clip(np.rint(frame), 0.0, 255.0).astype(np.uint8)
