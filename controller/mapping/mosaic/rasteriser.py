"""Pictures of a morphable model: textured triangles of a pixel grid with a depth buffer ([KP] 3.5).

Both meshes, of the valid region and of its part with counterparts, are drawn in one pass: without a
counterpart the share of the second texture is 0.
"""

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from snakewalk.config.arrays import Bools, Bytes, Floats, Image, Singles
from snakewalk.controller.mapping.mosaic.local_model import joined
from snakewalk.drivers.compiling import compiled, readonly_array

NEAREST_M = 0.01
"""Triangles with a nearer corner are not drawn (ours)."""
_UNSEEN = np.full(3, 150, np.uint8)
"""Colour of unseen pixels (ours)."""
_MATRIX = readonly_array("float64", 2, "C")
_FLOATS = readonly_array("float64", 3, "C")
_BOOLS = readonly_array("bool_", 2, "A")


@dataclass(slots=True)
class Canvas:
    """A picture with its depth buffer."""

    colour: Bytes
    """(H, W, 3) colours of the picture."""
    depth_m: Floats
    """(H, W); infinite where nothing was drawn."""
    blocked: Bools
    """(H, W) pixels that no longer change."""

    @classmethod
    def blank(cls, wide: int, tall: int) -> "Canvas":
        """Return an empty canvas."""
        return cls(
            np.zeros((tall, wide, 3), np.uint8),
            np.full((tall, wide), np.inf),
            np.zeros((tall, wide), bool),
        )

    @property
    def drawn(self) -> Bools:
        """(H, W) pixels that a triangle covers."""
        return np.isfinite(self.depth_m)

    def with_unseen(self) -> Image:
        """(H, W, 3) picture in which the pixels that no camera saw are grey."""
        return np.where(self.drawn[..., None], self.colour, _UNSEEN)


@dataclass(frozen=True, slots=True)
class SecondTexture:
    """Second texture of a grid."""

    texture: Image
    counterpart_px: Floats
    """(H, W, 2) vertices in the second texture, or NaN."""
    share: float
    """Share of the second texture at a counterpart."""


def cells(points_m: Floats) -> Bools:
    """(H - 1, W - 1) grid cells whose four corners belong to one surface."""
    depth = points_m[..., 2]
    along, across = joined(depth, 1), joined(depth, 0)
    return along[:-1] & along[1:] & across[:, :-1] & across[:, 1:]


def draw(
    canvas: Canvas,
    points_m: Floats,
    camera: Floats,
    drawn: Bools,
    texture: Image,
    blend: SecondTexture | None = None,
) -> None:
    """Draw a textured grid.

    Args:
        canvas: target.
        points_m: (H, W, 3) vertices in the axes of the camera.
        camera: (3, 3) matrix of the canvas.
        drawn: (H - 1, W - 1) cells to draw.
        texture: picture whose pixels are the vertices.
        blend: second texture.

    """
    screen = np.empty(points_m.shape)
    _project(np.ascontiguousarray(points_m), np.ascontiguousarray(camera), screen)
    source_px = np.full((*canvas.depth_m.shape, 2), np.nan, np.float32)
    _rasterise(screen, drawn, canvas.blocked, canvas.depth_m, source_px)
    fresh = np.isfinite(source_px[..., :1])
    colour = _texels(texture, source_px)
    if blend is not None and blend.share > 0.0:
        there_px = _texels(blend.counterpart_px.astype(np.float32), source_px)
        other = _texels(blend.texture, there_px)
        mixed = cv2.addWeighted(colour, 1.0 - blend.share, other, blend.share, 0.0)
        np.copyto(colour, mixed, where=np.isfinite(there_px[..., :1]))
    np.copyto(canvas.colour, colour, where=fresh)


def _texels(values: NDArray[Any], places_px: Singles) -> NDArray[Any]:
    """(H, W, k) bilinear values at columns and rows (H, W, 2); 0 or NaN outside."""
    return np.asarray(
        cv2.remap(
            values,
            np.ascontiguousarray(places_px[..., 0]),
            np.ascontiguousarray(places_px[..., 1]),
            cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_REPLICATE if values.dtype == np.uint8 else cv2.BORDER_CONSTANT,
            borderValue=(np.nan,) * 4,
        )
    )


@compiled(f"void({_FLOATS}, {_MATRIX}, float64[:, :, ::1])", makes_arrays=False)
def _project(points: Floats, camera: Floats, screen: Floats) -> None:
    """Write columns, rows and inverse depths of points (H, W, 3); NaN behind the camera."""
    for row in range(points.shape[0]):
        for column in range(points.shape[1]):
            z = points[row, column, 2]
            over = 1.0 / z if z > NEAREST_M else np.nan
            screen[row, column, 0] = camera[0, 0] * points[row, column, 0] * over + camera[0, 2]
            screen[row, column, 1] = camera[1, 1] * points[row, column, 1] * over + camera[1, 2]
            screen[row, column, 2] = over


@compiled(
    f"void({_FLOATS}, {_BOOLS}, {_BOOLS}, float64[:, ::1], float32[:, :, ::1])", makes_arrays=False
)
def _rasterise(
    screen: Floats,
    drawn: Bools,
    blocked: Bools,
    depth: Floats,
    source: Singles,
) -> None:
    """Write the depth and the source (column, row) of the nearest triangle of each pixel.

    ``screen`` (H, W, 3) holds columns, rows and inverse depths; NaN behind the camera.
    """
    tall, wide = depth.shape
    for cell in range(2 * drawn.size):
        row = cell // 2 // drawn.shape[1]
        column = cell // 2 % drawn.shape[1]
        half = cell % 2
        if not drawn[row, column]:
            continue
        ax, ay = screen[row + half, column, 0], screen[row + half, column, 1]
        bx, by = screen[row + 1, column + half, 0], screen[row + 1, column + half, 1]
        cx, cy = screen[row, column + 1, 0], screen[row, column + 1, 1]
        left, right = max(np.ceil(min(ax, bx, cx)), 0.0), min(max(ax, bx, cx), wide - 1.0)
        top, bottom = max(np.ceil(min(ay, by, cy)), 0.0), min(max(ay, by, cy), tall - 1.0)
        area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
        if not (left <= right and top <= bottom and area * area > 0.0):
            continue
        a, b, c = (
            screen[row + half, column, 2],
            screen[row + 1, column + half, 2],
            screen[row, column + 1, 2],
        )
        for y in range(int(top), int(bottom) + 1):
            for x in range(int(left), int(right) + 1):
                v = ((x - ax) * (cy - ay) - (cx - ax) * (y - ay)) / area
                w = ((bx - ax) * (y - ay) - (x - ax) * (by - ay)) / area
                if blocked[y, x] or min(1.0 - v - w, v, w) < -1e-9:
                    continue
                over = (1.0 - v - w) * a + v * b + w * c
                if 1.0 / over >= depth[y, x]:
                    continue
                depth[y, x] = 1.0 / over
                v, w = v * b / over, w * c / over
                source[y, x, 0] = column + v * half + w
                source[y, x, 1] = row + (1.0 - v - w) * half + v
