"""A drawn view from above with known truth, where no OpenGL is needed: for tests and benchmarks."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np

from snakewalk.config.arrays import Floats, Image
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.cameras.markers.floor_markers import marker_picture
from snakewalk.controller.cameras.overhead_camera import CameraModel
from snakewalk.controller.kinematics.links import body_in_world, half_lengths_m
from snakewalk.drivers.types import BodyPose

_FINE = 16.0  # positions in 1/16 px, as cv2's shift of 4 bits
_OVER = 4  # drawn so many times larger, then averaged
_BODY = ((60, 90, 150), (30, 45, 70))


@dataclass(frozen=True, slots=True)
class DrawnView:
    """A floor of tiles with noise, and a robot drawn as capsules at the height of its axis."""

    robot: RobotConfig
    model: CameraModel
    size_px: tuple[int, int]
    """Width, height."""
    noise: float = 3.0
    seed: int = 0
    markers_m: Mapping[int, Sequence[float]] = field(default_factory=dict)
    """Places of printed markers, each with a cell of white around it."""
    marker_side_m: float = 0.15

    def empty_floor(self) -> Image:
        """(H, W, 3) the same without the robot."""
        return self._sensed(self._floor(), 0)

    def picture(self, pose: BodyPose, joint_rad: Floats, frame: int = 1) -> Image:
        """(H, W, 3) the robot with its head link at ``pose``; ``frame`` picks the noise."""
        robot, z_m = self.robot, self.robot.body_radius_m
        view = body_in_world(robot, pose, joint_rad)
        half = half_lengths_m(robot)[:, None] * view.forward
        ends = [
            self.model.in_image((view.link_m + side * half)[:, :2], z_m) for side in (1.0, -1.0)
        ]
        scale = np.hypot(*(ends[0] - ends[1]).T).sum() / robot.length_m
        image = cv2.resize(self._floor(), None, fx=_OVER, fy=_OVER, interpolation=cv2.INTER_NEAREST)
        thick = max(1, round(2.0 * robot.body_radius_m * scale * _OVER))
        for k, (one, other) in enumerate(zip(*ends, strict=True)):
            a, b = (_place(end) for end in (one, other))
            cv2.line(image, a, b, _BODY[k % 2], thick, cv2.LINE_8, 4)
        small = cv2.resize(image, self.size_px, interpolation=cv2.INTER_AREA)
        return self._sensed(np.asarray(small, dtype=np.uint8), frame)

    def _floor(self) -> Image:
        x, y = np.meshgrid(*(np.arange(side) // 80 for side in self.size_px))
        tiles = np.where((x + y) % 2, 150, 165).astype(np.uint8)
        return np.dstack([self._printed(tiles)] * 3)

    def _printed(self, floor: Image) -> Image:
        """Lay the markers, drawn eight times larger, onto the floor (H, W)."""
        large = cv2.resize(floor, None, fx=8, fy=8, interpolation=cv2.INTER_NEAREST)
        for number, place in self.markers_m.items():
            drawn = np.pad(marker_picture(number, 48), 8, constant_values=235)
            side_m, ends = self.marker_side_m * len(drawn) / 48, len(drawn) - 0.5
            half = 0.5 * side_m * np.array([[-1, 1], [1, 1], [1, -1], [-1, -1]])
            px = 8.0 * (self.model.in_image(np.array(place) + half, 0.0) + 0.5) - 0.5
            corners = np.array([[-0.5, -0.5], [ends, -0.5], [ends, ends], [-0.5, ends]])
            there = cv2.getPerspectiveTransform(corners.astype(np.float32), px.astype(np.float32))
            cv2.warpPerspective(
                drawn, there, large.shape[::-1], dst=large, flags=cv2.INTER_NEAREST,
                borderMode=cv2.BORDER_TRANSPARENT,
            )  # fmt: skip
        small = cv2.resize(large, self.size_px, interpolation=cv2.INTER_AREA)
        return np.asarray(small, dtype=np.uint8)

    def _sensed(self, image: Image, frame: int) -> Image:
        chance = np.random.default_rng((self.seed, frame))
        grey = image + chance.normal(0.0, self.noise, image.shape)
        return np.asarray(np.clip(np.rint(grey), 0.0, 255.0), dtype=np.uint8)


def _place(px: Floats) -> tuple[int, int]:
    x, y = np.rint(((px + 0.5) * _OVER - 0.5) * _FINE).astype(int).tolist()
    return x, y
